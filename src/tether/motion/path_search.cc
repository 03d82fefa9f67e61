#include "tether/motion/path_search.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>
#include <utility>

#include "tether/common/random.h"
#include "tether/motion/path_shortening.h"
#include "tether/motion/path_tree.h"

namespace tether::motion {
namespace {

using Eigen::VectorXd;

// Dynamic domains: a node next to something is extended only towards samples within a radius, which shrinks
// and grows by these factors.
constexpr double kFirstRadius = 4.0, kLeastRadius = 1.0, kRadiusFactor = 1e-4;

constexpr int64_t kSamplesPerCheck = 50;
// On a manifold: steps shorter than this share of what is asked lead nowhere, nor do longer ones than this;
// a step towards a configuration leaves no more than this share of the distance.
constexpr double kLeastStep = 0.2, kMostStep = 2, kProgress = 0.98;

class Search {
 public:
  /// `manifold`: null for none.
  Search(const PathProblem& problem, const std::vector<int>& free_goals, LineChecker& checker,
         TiltManifold* manifold)
      : problem_(problem),
        checker_(checker),
        manifold_(manifold),
        dynamic_(problem.scene != nullptr && manifold == nullptr),
        random_(problem.seed),
        from_start_(problem.start.size()),
        from_goals_(problem.start.size()) {
    from_start_.Add(problem.start, -1, 0);
    for (const int goal : free_goals) from_goals_.Add(problem.goals[static_cast<size_t>(goal)], -1, goal);
    // The start may lie outside.
    lower_ = problem.lower.cwiseMin(problem.start);
    upper_ = problem.upper.cwiseMax(problem.start);
  }

  bool Run(Path& path) {
    if (TryStraight(path)) return true;
    bool found = manifold_ != nullptr && TryAlongManifold(path);
    // Samples that lead to no check are bounded too.
    const int64_t most = problem_.max_checks * (dynamic_ ? kSamplesPerCheck : 1);
    for (int64_t i = 0; i < most && !found && checker_.checks() < problem_.max_checks; ++i)
      found = Grow(path);
    path.nodes = from_start_.size() + from_goals_.size();
    return found;
  }

 private:
  /// The nearest goal along a straight line.
  bool TryStraight(Path& path) {
    std::vector<std::pair<double, int>> goals;
    for (int i = 0; i < from_goals_.size(); ++i)
      goals.emplace_back((from_goals_.q(i) - problem_.start).norm(), i);
    std::sort(goals.begin(), goals.end());
    for (const auto& [distance, node] : goals) {
      const VectorXd goal = from_goals_.q(node);
      if (!checker_.IsFree(problem_.start, goal)) continue;
      path.q = {problem_.start, goal};
      path.goal = from_goals_.root(node);
      return true;
    }
    return false;
  }

  /// The nearest goal along a straight line that is drawn onto the manifold step by step.
  bool TryAlongManifold(Path& path) {
    for (int goal = 0; goal < from_goals_.size(); ++goal) {
      const int met = Connect(from_start_, from_goals_.q(goal));
      if (met < 0) continue;
      path.q = JoinTrees(from_start_, met, from_goals_, goal);
      path.goal = from_goals_.root(goal);
      return true;
    }
    return false;
  }

  /// A step from `from` towards `to`, drawn onto the manifold if there is one; false if that leads nowhere.
  bool StepTowards(const VectorXd& from, const VectorXd& to, VectorXd* next) {
    const double distance = (to - from).norm();
    *next = distance <= problem_.range ? to : VectorXd(from + (to - from) * (problem_.range / distance));
    if (manifold_ == nullptr) return true;
    if (!manifold_->Project(next)) return false;
    *next = next->cwiseMax(lower_).cwiseMin(upper_);
    const double length = (*next - from).norm();
    return length > kLeastStep * std::min(distance, problem_.range) && length < kMostStep * problem_.range;
  }

  /// One sample: the smaller tree grows towards it, then the other towards what was reached.
  bool Grow(Path& path) {
    const bool start_grows = from_start_.size() <= from_goals_.size();
    PathTree& tree = start_grows ? from_start_ : from_goals_;
    PathTree& other = start_grows ? from_goals_ : from_start_;
    const VectorXd sample = SampleBetween(lower_, upper_, random_);
    double distance = 0;
    const int nearest = tree.Nearest(sample, &distance);
    double& radius = tree.radius(nearest);
    if ((dynamic_ && distance > radius) || distance == 0) return false;
    const VectorXd near = tree.q(nearest);
    VectorXd next;
    if (!StepTowards(near, sample, &next)) return false;
    if (!checker_.IsFree(near, next)) {
      radius = std::isinf(radius) ? kFirstRadius : std::max(radius * (1 - kRadiusFactor), kLeastRadius);
      return false;
    }
    if (!std::isinf(radius)) radius *= 1 + kRadiusFactor;
    const int added = tree.Add(next, nearest, tree.root(nearest));
    const int met = Connect(other, next);
    if (met < 0) return false;
    path.q = start_grows ? JoinTrees(from_start_, added, from_goals_, met)
                         : JoinTrees(from_start_, met, from_goals_, added);
    path.goal = from_goals_.root(start_grows ? met : added);
    return true;
  }

  /// Grows the tree step by step as far as q; the node there, or −1.
  int Connect(PathTree& tree, const VectorXd& q) {
    if (manifold_ != nullptr) return ConnectAlongManifold(tree, q);
    double distance = 0;
    int node = tree.Nearest(q, &distance);
    const int steps = std::max(1, static_cast<int>(std::ceil(distance / problem_.range)));
    const VectorXd from = tree.q(node);
    VectorXd last = from;
    for (int i = 1; i <= steps; ++i) {
      const VectorXd next = i == steps ? q : VectorXd(from + (q - from) * (static_cast<double>(i) / steps));
      if (!checker_.IsFree(last, next)) return -1;
      node = tree.Add(next, node, tree.root(node));
      last = next;
    }
    return node;
  }

  int ConnectAlongManifold(PathTree& tree, const VectorXd& q) {
    double distance = 0;
    int node = tree.Nearest(q, &distance);
    while (distance > 0) {
      const VectorXd last = tree.q(node);
      VectorXd next;
      if (distance <= problem_.range) {
        next = q;
      } else if (!StepTowards(last, q, &next) || (q - next).norm() > distance * kProgress) {
        return -1;
      }
      if (!checker_.IsFree(last, next)) return -1;
      node = tree.Add(next, node, tree.root(node));
      distance = (q - next).norm();
    }
    return node;
  }

  const PathProblem& problem_;
  LineChecker& checker_;
  TiltManifold* manifold_;
  bool dynamic_;  // Domains shrink: where lines are long.
  Random random_;
  PathTree from_start_, from_goals_;
  VectorXd lower_, upper_;
};

}  // namespace

Path FindPath(const PathProblem& problem) {
  assert(!problem.goals.empty() && (problem.scene != nullptr) != static_cast<bool>(problem.is_free));
  Path path;
  std::unique_ptr<LineChecker> made;
  if (problem.scene != nullptr) {
    made = std::make_unique<PathChecker>(problem.scene, problem.lanes);
  } else {
    made = std::make_unique<SampledChecker>(problem.is_free, problem.resolution);
  }
  std::optional<TiltManifold> manifold;
  std::unique_ptr<LineChecker> upright;
  if (problem.tilt) {
    manifold.emplace(problem.model, *problem.tilt);
    upright = std::make_unique<TiltChecker>(*made, *manifold, problem.resolution);
  }
  LineChecker& checker = upright != nullptr ? *upright : *made;
  const auto finish = [&](PathStatus status, std::string reason) {
    path.status = status;
    path.reason = std::move(reason);
    path.checks = checker.checks();
    path.exact_checks = checker.exact_checks();
    return path;
  };
  if (!checker.IsFree(problem.start))
    return finish(PathStatus::kStartNotFree, "at the start, " + checker.Why(problem.start));
  std::vector<int> free_goals;
  for (size_t i = 0; i < problem.goals.size(); ++i) {
    if (checker.IsFree(problem.goals[i])) free_goals.push_back(static_cast<int>(i));
  }
  if (free_goals.empty())
    return finish(PathStatus::kNoFreeGoal, "at the goal, " + checker.Why(problem.goals.front()));
  if (!Search(problem, free_goals, checker, manifold ? &*manifold : nullptr).Run(path))
    return finish(PathStatus::kGaveUp,
                  "no path was found with " + std::to_string(problem.max_checks) + " configurations");
  ShortenPath(problem, checker, path.q);
  SmoothPath(problem.smoothing, checker, path.q);
  return finish(PathStatus::kFound, "");
}

double PathLength(const std::vector<VectorXd>& path) {
  double length = 0;
  for (size_t i = 0; i + 1 < path.size(); ++i) length += (path[i + 1] - path[i]).norm();
  return length;
}

}  // namespace tether::motion
