#pragma once

#include <optional>

#include "tether/bench/campaigns/campaign_scene.h"
#include "tether/common/document/value.h"

namespace tether::bench {

/// Runs the shipped scenario `scene.kind` once from perturbed initial poses, under disturbances that are
/// drawn from the seed, and says which limits were passed. Empty if interrupted.
std::optional<Value> MeasureDisturbed(const CampaignScene& scene, const std::atomic<bool>* stop);

/// The summary of the records of one scene.
Value SummarizeDisturbed(const std::vector<const Value*>& records);
/// The same for people, of one row of the summary.
std::string DisturbedText(const Value& row);

}  // namespace tether::bench
