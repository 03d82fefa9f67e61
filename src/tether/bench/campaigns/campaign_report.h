#pragma once

#include <string>

namespace tether::bench {

/// A campaign's records (`tether campaign --output`) or summary (`--json`) as a report: of records how often
/// each outcome was, the spread of each measurement, and its distribution as a figure. Throws InputError for
/// a file that is neither.
struct CampaignReport {
  std::string svg, html;
};
CampaignReport ReportCampaign(const std::string& path);

}  // namespace tether::bench
