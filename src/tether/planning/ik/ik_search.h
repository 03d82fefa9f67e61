#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "tether/constraints/core/arm_function.h"
#include "tether/planning/program/frame_tree.h"
#include "tether/planning/program/step_context.h"
#include "tether/robot/posture.h"

namespace tether::planning {

/// Links keep this clear of things and of each other where there is room, m …
inline constexpr double kLinkClearance = 0.01;
/// … and this at least.
inline constexpr double kLeastLinkClearance = 0.002;
/// Joints keep this from their limits, rad.
inline constexpr double kLimitMargin = 0.03;

/// The other end of a straight motion of the hand from or to a key pose.
struct ApproachEnd {
  constraints::Offset offset;   ///< From the hand at the key pose.
  double length = 0;            ///< m
  bool at_step_before = false;  ///< It is the key pose of the step before: `offset` does not count.
};

/// An IK solution of a key pose, or why there is none.
struct IkSolution {
  Eigen::VectorXd q;   ///< n, rad: if none was found, the best that was found.
  bool found = false;  ///< The hand is at the key pose, joints are within their limits, links are clear.
  /// If not found, why, as a phrase that can follow the action's name: "4.5 cm beyond reach". If found, why
  /// approach or retreat is not free; empty if both are.
  std::string problem;
  robot::Posture posture;
  std::optional<ApproachEnd>
      blocked;  ///< If found: the end of the first approach or retreat that is not free.
};

/// Searches for IK solutions. One object per skeleton and thread.
class IkSearch {
 public:
  /// The problem must have a robot model.
  IkSearch(const SceneFacts& facts, const FrameTree& tree);

  /// One per key pose. Each search begins at the solution of the key pose before, so that consecutive ones
  /// are of the same branch where possible; only where that fails, elsewhere. `tree` and `poses`, the steps'
  /// variables, give the poses of everything.
  std::vector<IkSolution> Find(const FrameTree& tree, const std::vector<math::Pose>& poses);

  /// Adds a start of the search at a step.
  void Suggest(int step, const Eigen::VectorXd& q) { suggested_[step] = q; }

  /// Sets what the links have to keep clear of after a step, and the hand's pose in the base frame.
  void SetStep(const FrameTree& tree, const std::vector<math::Pose>& poses, int step);
  robot::PostureProblem& problem() { return problem_; }
  robot::PostureSolver& solver() { return solver_; }

  /// Why a posture at the present step is not accepted.
  std::string Explain(const robot::Posture& posture) const;

  /// The solid of the scene, and its part, that an obstacle of problem() is.
  struct ObstacleName {
    int solid;  ///< In SceneFacts::solids().
    int part;
  };
  const ObstacleName& NameOf(int obstacle) const { return names_[static_cast<size_t>(obstacle)]; }

 private:
  IkSolution FindOne(const Eigen::VectorXd& from, const Eigen::VectorXd* other);
  /// A solution with a joint at its limit is replaced by one with room, if there is one.
  void PreferRoom(const Eigen::VectorXd& from, robot::Posture& best);

  const SceneFacts& facts_;
  math::Pose X_BaseW_;
  robot::PostureSolver solver_;
  robot::PostureProblem problem_;
  Eigen::VectorXd start_;
  std::vector<ObstacleName> names_;
  std::vector<std::vector<int>> touching_;  // links that touch a part at the start, by parts of solids
  std::vector<math::Pose> X_W_;
  std::map<int, Eigen::VectorXd> suggested_;
};

/// "4.5 cm beyond reach" for a hand at this pose (base frame): how far its last joint is out of any reach of
/// the arm, m; ≤ 0 within it. An outer bound: above zero it is a proof.
double BeyondReach(const robot::Model& model, const math::Pose& X_BH);

}  // namespace tether::planning
