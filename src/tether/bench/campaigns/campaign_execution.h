#pragma once

#include <optional>

#include "tether/bench/campaigns/campaign_scene.h"
#include "tether/common/document/value.h"

namespace tether::bench {

/// Plans the scene, with the arm or without it, and executes the best plan in the simulation: did it reach
/// the goal? Empty if interrupted.
std::optional<Value> MeasureExecution(const CampaignScene& scene, bool no_robot,
                                      const std::atomic<bool>* stop);

/// The summary of the records of one kind of scenes.
Value SummarizeExecution(const std::vector<const Value*>& records);
/// The same for people, of one row of the summary.
std::string ExecutionText(const Value& row);

}  // namespace tether::bench
