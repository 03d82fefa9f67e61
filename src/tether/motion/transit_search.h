#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "tether/math/pose.h"
#include "tether/motion/collision_scene.h"
#include "tether/motion/path_search.h"

namespace tether::motion {

/// A pose of the hand that a transit may end at, in the base frame.
struct TransitGoal {
  math::Pose X_BH;
  /// Where the hand goes on from there, along straight lines: IK solutions from which the arm can't follow
  /// are not used.
  std::vector<math::Pose> then;
  /// An IK solution of this or a near pose, rad; it is preferred. Empty: none is known.
  Eigen::VectorXd near;
};

/// Moves the end of a transit to 2 cm above the goal, which becomes the first pose after it: for goals where
/// something touches that may. `up_B`: a unit vector.
void EndAbove(TransitGoal& goal, const Eigen::Vector3d& up_B);

/// A motion of the arm from a configuration to one of several poses of the hand.
struct TransitProblem {
  /// Its clearance is what is wanted; where the start or every goal has less room, less is kept.
  Snapshot snapshot;
  Eigen::VectorXd start;           ///< n, rad
  std::vector<TransitGoal> goals;  ///< The first is preferred; not empty.
  /// The path keeps this, if the start and the goals do.
  std::optional<TiltLimit> tilt = {};
  /// A path that was found earlier, from about the same start to about the first goal: it is used where it is
  /// still free, with its ends replaced. Empty: none.
  std::vector<Eigen::VectorXd> known;
  uint64_t seed = 1;
  int random_starts = 8;         ///< Of the search for IK solutions, besides those that suggest themselves.
  int64_t max_checks = 800'000;  ///< As in PathProblem: of all paths that are searched together.
};

struct Transit {
  PathStatus status = PathStatus::kGaveUp;
  std::vector<Eigen::VectorXd> path;  ///< From the start, straight in between; empty unless found.
  int goal = -1;                      ///< Into `goals`.
  bool near = false;                  ///< It leads to the branch of that goal's IK solution `near`.
  Eigen::VectorXd end;                ///< n, rad: after the straight motions of that goal.
  double clearance = 0;  ///< That the path keeps everywhere but where it leaves a touching start, m.
  int64_t checks = 0;
  std::string reason;   ///< Why there is none, in a sentence.
  std::string blocker;  ///< What stands in the way, if one thing does: a name of the snapshot.

  bool found() const { return status == PathStatus::kFound; }
};

/// Finds IK solutions of the goals (several branches), prefers those near the start, far from joint limits
/// and singularities, and searches a path to them, with rounded corners. A start that touches something by at
/// most 2 cm is left first, so that what is touched gets no nearer. Deterministic; bounded by counted checks.
/// Polls the limits of its thread.
Transit FindTransit(const TransitProblem& problem);

/// The least distance from anything along a path, m, at samples of 0.05 rad; `most` if it is more.
double LeastClearance(const Snapshot& snapshot, const std::vector<Eigen::VectorXd>& path, double most = 0.1);

}  // namespace tether::motion
