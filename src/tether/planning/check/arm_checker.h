#pragma once

#include "tether/constraints/core/context.h"
#include "tether/planning/program/frame_tree.h"
#include "tether/planning/program/step_context.h"
#include "tether/robot/kinematics.h"
#include "tether/robot/model.h"

namespace tether::planning {

/// Judges configurations of the arm: a part of the checker. The hand's pose comes from MuJoCo's kinematics,
/// which the optimiser's rows do not use.
class ArmChecker {
 public:
  /// The problem must have a robot model.
  explicit ArmChecker(const SceneFacts& facts);

  /// Reports to the collector whatever speaks against `q` as an IK solution of X_WHand: the hand's error,
  /// joints beyond their limits, links that overlap with the scene after the step or with each other.
  void Check(const FrameTree& tree, const std::vector<math::Pose>& poses, int step, const math::Pose& X_WHand,
             const Eigen::VectorXd& q, constraints::Findings& findings);

 private:
  void CheckLinks(const FrameTree& tree, const std::vector<math::Pose>& poses, int step,
                  constraints::Findings& findings);

  const SceneFacts& facts_;
  const robot::Model& model_;
  robot::State state_;
  robot::Kinematics kinematics_, at_start_;
  geometry::Shape hand_;
};

}  // namespace tether::planning
