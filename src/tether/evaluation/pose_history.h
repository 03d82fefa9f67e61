#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "tether/math/pose.h"

namespace tether::evaluation {

/// The time over which rest is judged, s: a simulated contact trembles from step to step.
inline constexpr double kRestWindow = 0.1;

/// The poses of all objects over the last kRestWindow.
class PoseHistory {
 public:
  /// Adds the poses in the world at `time` (s, not decreasing); calls that come more often than needed are
  /// skipped.
  void Add(double time, const std::map<std::string, math::Pose>& X_WO);
  /// The poses kRestWindow before `time`; at the start, the first that there are. None if nothing was added.
  std::map<std::string, math::Pose> Before(double time) const;

 private:
  std::vector<std::pair<double, std::map<std::string, math::Pose>>> samples_;  ///< The oldest first.
};

}  // namespace tether::evaluation
