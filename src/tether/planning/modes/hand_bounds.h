#pragma once

#include <optional>
#include <string>
#include <vector>

#include "tether/planning/program/step_context.h"
#include "tether/planning/skeleton/skeleton_binding.h"

namespace tether::planning {

struct Ball {
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  double radius = 0;
};

/// What is known of the hand at a key pose before anything is optimised, in the world.
struct HandBound {
  std::optional<Ball> place;                ///< The hand's origin is in it.
  std::optional<Eigen::Vector3d> approach;  ///< The hand's z axis.
};

/// Where constraints tie the hand to something that was not moved (constraints::Kind::locate and align),
/// whatever the key poses: one per step. None if some step attaches a frame to a descendant of it.
std::optional<std::vector<HandBound>> BoundHand(const SceneFacts& facts, const std::vector<BoundStep>& steps);

/// A proof that an action has no key pose within the arm's reach.
struct ReachRefutation {
  int action_index = 0;
  std::string reason;  ///< "pick(box): 4.5 cm beyond reach"
  /// The proof depends only on the poses of these movable objects, which no earlier action moved. Empty: it
  /// depends on more.
  std::vector<FrameId> unmoved;
};

/// The first action that is out of reach whatever the key poses: the least distance of the hand's last joint
/// there exceeds the arm's length (robot::OuterReach). A proof; none without an arm.
std::optional<ReachRefutation> RefuteByReach(const SceneFacts& facts, const std::vector<BoundStep>& steps);

}  // namespace tether::planning
