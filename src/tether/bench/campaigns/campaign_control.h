#pragma once

#include <optional>

#include "tether/bench/campaigns/campaign_scene.h"
#include "tether/common/document/value.h"

namespace tether::bench {

/// Runs a scenario once from perturbed initial poses. `scene.kind` is "seeds", or "moved" or "crossing" with
/// an obstacle of obstacle.h. `command` is "velocity" or "torque", in place of what the scenario's controller
/// commands; empty: that. Empty if interrupted.
std::optional<Value> MeasureControl(const CampaignScene& scene, const std::string& scenario,
                                    const std::string& command, const std::atomic<bool>* stop);

/// The summary of the records of one kind.
Value SummarizeControl(const std::vector<const Value*>& records);
/// The same for people, of one row of the summary.
std::string ControlText(const Value& row);

}  // namespace tether::bench
