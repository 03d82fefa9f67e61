#pragma once

#include <atomic>
#include <cstdint>
#include <optional>
#include <string>

#include "tether/common/document/value.h"

namespace tether::bench {

/// Measurements of the campaigns on one scene; not for users of the room.

/// A scene of a campaign.
struct CampaignScene {
  std::string kind;  ///< A kind of Generate().
  int blocks = 0;    ///< For the kinds that have it.
  uint64_t seed = 0;

  /// "reach 17", "hanoi of 5 blocks 1".
  std::string Label() const;
};

/// A member of a record as text; empty if it has none of that name.
std::string TextOf(const Value& record, const char* key);

struct SceneMeasurementOptions {
  int restarts = 100;
  bool ipopt = false;  ///< Also plans with IPOPT, 10 s per solve.
  const std::atomic<bool>* stop = nullptr;
};

/// Plans the scene; if that fails, tries random starts until one of them finds a plan. Empty if interrupted.
std::optional<Value> MeasureRobustness(const CampaignScene& scene, const SceneMeasurementOptions& options);

/// Plans the scene, and compares the cost with the best of all random starts. Empty if interrupted.
std::optional<Value> MeasureQuality(const CampaignScene& scene, const SceneMeasurementOptions& options);

/// Plans the scene, and solves the first candidate's program once from the scene's own start. Empty if
/// interrupted.
std::optional<Value> MeasureGrowth(const CampaignScene& scene, const SceneMeasurementOptions& options);

/// Plans the scene, moves one object by up to 5 cm, and optimises the best candidate again: from a cold
/// start, and from a warm one with planning::Reoptimize. Empty if interrupted.
std::optional<Value> MeasureWarmStart(const CampaignScene& scene, const SceneMeasurementOptions& options);

}  // namespace tether::bench
