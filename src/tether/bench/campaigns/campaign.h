#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tether/common/document/value.h"

namespace tether::bench {

/// A measurement on many random scenes. Planning is without the arm (`--no-robot`) but in campaign
/// `execution`, with the native solver, in one thread.
struct CampaignOptions {
  std::string name;                ///< One of CampaignNames().
  std::vector<std::string> kinds;  ///< Of scenes: reach, stack, and for execution clutter, around, posts,
                                   ///< shelf; of runs, for control: seeds, moved, crossing; of disturbed:
                                   ///< scenarios. Empty: all but around, posts and shelf. growth has none.
  std::optional<int>
      scenes;             ///< Per kind (growth: per number of blocks); none: as many as the name asks for.
  bool no_robot = false;  ///< Of execution: plan without the arm.
  std::string scenario;   ///< Of control: the scenario file; empty: the shipped assistive one.
  std::string command;    ///< Of control: velocity or torque, in place of the scenario's; empty: that.
  int restarts = 100;     ///< Random starts, of every candidate, per scene.
  uint64_t seed = 1;      ///< Of the first scene; the others follow it.
  std::string output;     ///< File with a line of JSON per scene; empty: none.
  const std::atomic<bool>* stop = nullptr;

  /// Throws InputError naming the options that are wrong.
  void Validate() const;
};

/// The campaigns, each with one line of explanation: robustness, quality, warm, growth,
/// execution, control, disturbed.
std::vector<std::pair<std::string, std::string>> CampaignNames();

struct CampaignResult {
  std::vector<Value> records;  ///< One per scene, in order; see docs/campaigns.md.
  bool interrupted = false;    ///< `records` holds those that were finished.
};

/// Called after each scene, with its number among all, how many there are, and its record.
using RecordCallback = std::function<void(int, int, const Value&)>;

/// Measures all scenes. Records of scenes that `output` holds already are used; each further one is added to
/// it as soon as it is finished, so that an interrupted campaign can be continued. An incomplete last line is
/// dropped. Throws InputError for wrong options, and for a file that is of another campaign.
CampaignResult RunCampaign(const CampaignOptions& options, const RecordCallback& on_record = {});

/// A line of progress for people, for RecordCallback; empty where there is nothing to tell.
std::string CampaignLine(int number, int count, const Value& record);

/// The summary of the records, format `tether.campaign/1`.
Value SummarizeCampaign(const CampaignOptions& options, const CampaignResult& result);
/// The same for people.
std::string CampaignTable(const Value& summary);

}  // namespace tether::bench
