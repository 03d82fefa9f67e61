#pragma once

#include <map>
#include <optional>
#include <vector>

#include "tether/common/random.h"
#include "tether/planning/program/program_builder.h"

namespace tether::planning {

/// Arrangements of several objects that a skeleton puts down on one support: starts for the optimiser.
/// Whether all of them find a place depends on all places together. An arrangement puts down one after the
/// other, as the skeleton does, on a grid over the support, in an order of the grid's places that differs
/// from attempt to attempt (bottom-left filling from each corner, then random orders): objects in their
/// present yaw or else along the support's edges, with object and hand clear of all that stands there.
class Packing {
 public:
  /// Fewer objects than this on one support need no arranging.
  static constexpr size_t kFewest = 3;

  /// `guess` is of all steps; it is read and kept by reference, as are the others.
  Packing(const SceneFacts& facts, const std::vector<BoundStep>& steps, const KeyPoseProgram& guess);

  /// Whether some support gets kFewest objects or more.
  static bool IsNeeded(const SceneFacts& facts, const std::vector<BoundStep>& steps) {
    return !FindGroups(steps, facts.hand()).empty();
  }
  struct Arrangement {
    std::map<int, math::Pose> placed;  ///< Key poses by step: placements, and raised grasps.
    bool tight = false;                ///< Carried objects do not have their full clearance.
  };
  /// None if this attempt finds no arrangement.
  std::optional<Arrangement> Arrange(int attempt, const Random& random) const;

 private:
  struct Placing {
    int step;  // that puts it down
    int pick;  // that grasps it; −1: none
    FrameId object;
  };
  struct Group {
    FrameId support;
    std::vector<Placing> placings;
  };
  struct Fit {
    int attempt;
    double clearance;  // between what is put down and the rest, m
    double raised;     // of the grasp, as a share of the object's height
    bool aligned;      // with the support's edges, not as they came
  };

  static std::vector<Group> FindGroups(const std::vector<BoundStep>& steps, FrameId hand);
  bool ArrangeGroup(const Group& group, const Fit& fit, Random& random, std::map<int, math::Pose>& poses,
                    std::map<FrameId, math::Pose>& X_W) const;
  /// Places in the support's plane, in the order in which they are tried, m.
  static std::vector<Eigen::Vector2d> Places(const geometry::Shape& support, const Eigen::Vector2d& wanted,
                                             int attempt, Random& random);
  /// Stands there, clear of everything but what carries it.
  bool StandsClear(const Placing& placing, FrameId support, const math::Pose& X_WO, double clearance,
                   const std::map<FrameId, math::Pose>& X_W) const;
  bool HandIsClear(const Placing& placing, const math::Pose& X_WHand,
                   const std::map<FrameId, math::Pose>& X_W) const;
  math::Pose PoseOf(FrameId solid, int step, const std::map<FrameId, math::Pose>& X_W) const;

  const SceneFacts& facts_;
  const KeyPoseProgram& guess_;
  std::vector<Group> groups_;
};

}  // namespace tether::planning
