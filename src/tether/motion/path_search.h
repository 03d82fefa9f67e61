#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "tether/motion/path_checker.h"
#include "tether/motion/tilt_limit.h"

namespace tether::motion {

/// A path in joint space: for the arm of a scene, or among what a predicate says.
struct PathProblem {
  std::shared_ptr<const CollisionScene> scene;
  /// In place of a scene, whether a configuration is free: asked along lines, `resolution` apart.
  std::function<bool(const Eigen::VectorXd&)> is_free = {};
  double resolution = 0.03;  ///< rad
  double range = 1.5;        ///< A tree grows by at most this at once, rad.
  /// Keeps the hand, or what it holds, turned: the path stays on this manifold, to within its tolerance at
  /// samples `resolution` apart. None: no such limit.
  std::optional<TiltLimit> tilt = {};
  std::shared_ptr<const robot::Model> model = {};  ///< With a tilt: whose hand it is.
  Eigen::VectorXd lower, upper;                    ///< n, rad: the space that is searched.
  Eigen::VectorXd start;                           ///< n, rad
  std::vector<Eigen::VectorXd> goals;              ///< n each, rad: the path ends at one of them.
  uint64_t seed = 1;
  int64_t max_checks = 4'000'000;  ///< Gives up after so many configurations: the same on every machine.
  int shortcuts = 12;              ///< Tries at cutting off pieces of the path, after its corners.
  int smoothing = 0;               ///< Rounds of cutting corners to half, for gentler turns.
  Lanes lanes = Lanes::kBest;
};

enum class PathStatus {
  kFound,
  kStartNotFree,
  kNoFreeGoal,
  kGaveUp,  ///< At `max_checks`: says nothing about what is possible.
};

struct Path {
  PathStatus status = PathStatus::kGaveUp;
  std::vector<Eigen::VectorXd> q;  ///< From the start to a goal, straight in between; empty unless found.
  int goal = -1;                   ///< Into `goals`.
  int64_t checks = 0, exact_checks = 0;
  int nodes = 0;       ///< Of both trees.
  std::string reason;  ///< Why there is none, in a sentence.
};

/// Bidirectional rapidly-exploring random trees (RRT-Connect, Kuffner and LaValle 2000) with dynamic domains
/// (Yershova et al. 2005) and balanced growth, then shortcuts and smoothing. Every piece of the path is
/// proved free in a scene (see PathChecker). Polls the limits of its thread. The same problem gives the same
/// path, with and without SIMD. `goals` must not be empty.
Path FindPath(const PathProblem& problem);

/// Its length, rad.
double PathLength(const std::vector<Eigen::VectorXd>& path);

}  // namespace tether::motion
