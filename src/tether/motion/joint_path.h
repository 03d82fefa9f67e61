#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include <Eigen/Core>

namespace tether::motion {

/// A path-planning problem in joint space.
struct JointPathProblem {
  Eigen::VectorXd lower, upper;        ///< n, rad: the space that is searched.
  Eigen::VectorXd start;               ///< n, rad
  std::vector<Eigen::VectorXd> goals;  ///< n each, rad: the path ends at one of them.
  /// Whether a configuration is free. Called along the path, `resolution` apart.
  std::function<bool(const Eigen::VectorXd&)> is_free;
  double resolution = 0.03;  ///< rad, the most that a joint moves between two checks.
  int max_checks = 20000;    ///< Gives up after so many calls of `is_free`: the same on every machine.
  uint64_t seed = 1;
};

enum class JointPathStatus {
  kFound,
  kNoFreeGoal,  ///< No goal is free.
  kStartNotFree,
  kGaveUp,  ///< At `max_checks`: says nothing about what is possible.
};

struct JointPath {
  JointPathStatus status = JointPathStatus::kGaveUp;
  std::vector<Eigen::VectorXd> q;  ///< From the start to a goal, straight in between; empty unless found.
  int checks = 0;                  ///< Calls of `is_free`.
};

/// Bidirectional rapidly-exploring random trees (RRT-Connect, Kuffner and LaValle 2000), then short
/// cuts. Deterministic: the same problem gives the same path. `goals` must not be empty.
JointPath FindJointPath(const JointPathProblem& problem);

}  // namespace tether::motion
