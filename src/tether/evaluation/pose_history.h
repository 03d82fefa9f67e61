#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "tether/math/pose.h"

namespace tether::evaluation {

/// Rest is judged from the motion in so long a time, s: a simulated contact trembles from step to step.
inline constexpr double kRestWindow = 0.1;

/// Where all objects were in the last kRestWindow.
class PoseHistory {
 public:
  /// Takes the poses in the world at `time` (s, never less than before); some are skipped, if they come more
  /// often than is of use.
  void Add(double time, const std::map<std::string, math::Pose>& X_WO);
  /// The poses kRestWindow before `time`; at the start, the first that there are. None if nothing was added.
  std::map<std::string, math::Pose> Before(double time) const;

 private:
  std::vector<std::pair<double, std::map<std::string, math::Pose>>> samples_;  ///< The oldest first.
};

}  // namespace tether::evaluation
