#include <array>
#include <fstream>

#include "apps/tether/commands.h"
#include "tether/bench/campaigns/campaign_report.h"
#include "tether/common/exit_code.h"
#include "tether/common/output/outputs.h"
#include "tether/evaluation/report/figure.h"
#include "tether/evaluation/report/run_page.h"

namespace tether::app {
namespace {

/// Whether it is a campaign's file: JSON that does not say that it is a run's log, of whatever version.
bool IsCampaign(const std::string& path) {
  std::array<char, 256> first{};
  std::ifstream stream(path, std::ios::binary);
  stream.read(first.data(), first.size());
  const std::string_view begin(first.data(), static_cast<size_t>(stream.gcount()));
  return begin.find("tether.campaign") != std::string_view::npos;
}

}  // namespace

int ReportCommand(const ReportArguments& arguments) {
  Outputs outputs;
  outputs.Add(arguments.output, "--output");
  outputs.Require({arguments.log});
  const bool html = arguments.output.ends_with(".html") || arguments.output.ends_with(".htm");
  std::string text;
  if (IsCampaign(arguments.log)) {
    const bench::CampaignReport report = bench::ReportCampaign(arguments.log);
    text = html ? report.html : report.svg;
    if (text.empty())
      throw InputError("--output: a campaign's summary has nothing to draw", "a file that ends with .html");
  } else {
    const evaluation::RunLog log = evaluation::ReadRunLog(arguments.log);
    text = html ? evaluation::WriteRunPage(log) : evaluation::DrawRunLog(log);
  }
  outputs.WriteText(arguments.output, text);
  outputs.Finish();
  return kExitSuccess;
}

}  // namespace tether::app
