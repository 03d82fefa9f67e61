#include "tether/motion/joint_path.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <utility>

#include "tether/common/random.h"
#include "tether/motion/path_tree.h"

namespace tether::motion {
namespace {

using Eigen::VectorXd;

// Tries at cutting corners off a path that was found.
constexpr int kShortCuts = 60;
// A tree grows by at most this towards a sample, rad.
constexpr double kStep = 0.5;

/// Counts the calls of `is_free`, and answers no once the limit is reached.
class Checker {
 public:
  explicit Checker(const JointPathProblem& problem) : problem_(problem) {}

  bool IsFree(const VectorXd& q) {
    if (exhausted()) return false;
    ++checks_;
    return problem_.is_free(q);
  }
  /// The straight line between two configurations, without `a`, which is known to be free.
  bool IsFree(const VectorXd& a, const VectorXd& b) {
    const int steps =
        std::max(1, static_cast<int>(std::ceil((b - a).cwiseAbs().maxCoeff() / problem_.resolution)));
    // The far end first: it is the likeliest not to be free.
    for (int i = steps; i > 0; --i) {
      if (!IsFree(a + (b - a) * (static_cast<double>(i) / steps))) return false;
    }
    return true;
  }
  bool exhausted() const { return checks_ >= problem_.max_checks; }
  int checks() const { return checks_; }

 private:
  const JointPathProblem& problem_;
  int checks_ = 0;
};

/// RRT-Connect (Kuffner and LaValle 2000): two trees, of which one grows towards a sample and the other then
/// towards what was reached, by turns.
class Search {
 public:
  Search(const JointPathProblem& problem, const std::vector<VectorXd>& goals, Checker& checker)
      : checker_(checker),
        random_(problem.seed),
        from_start_(problem.start.size()),
        from_goals_(problem.start.size()) {
    from_start_.Add(problem.start, -1);
    for (const VectorXd& goal : goals) from_goals_.Add(goal, -1);
    // The start may lie outside.
    lower_ = problem.lower.cwiseMin(problem.start);
    upper_ = problem.upper.cwiseMax(problem.start);
  }

  /// From the start to a goal; empty if the checker gave up before.
  std::vector<VectorXd> Run() {
    bool start_grows = true;
    // A straight line is tried before any sample.
    int reached = 0;
    while (!checker_.exhausted()) {
      PathTree& growing = start_grows ? from_start_ : from_goals_;
      PathTree& other = start_grows ? from_goals_ : from_start_;
      if (reached >= 0) {
        const int met = Connect(other, growing.q(reached));
        if (met >= 0) {
          return start_grows ? JoinTrees(from_start_, reached, from_goals_, met)
                             : JoinTrees(from_start_, met, from_goals_, reached);
        }
        start_grows = !start_grows;
      }
      reached = Extend(start_grows ? from_start_ : from_goals_, SampleBetween(lower_, upper_, random_));
      if (reached < 0) start_grows = !start_grows;
    }
    return {};
  }

 private:
  /// Grows the tree by one step towards q; the new node, or −1 if that is not free.
  int Extend(PathTree& tree, const VectorXd& q) { return Extend(tree, tree.Nearest(q), q); }
  int Extend(PathTree& tree, int from, const VectorXd& q) {
    const VectorXd near = tree.q(from);
    const double distance = (q - near).norm();
    const VectorXd next = distance <= kStep ? q : VectorXd(near + (q - near) * (kStep / distance));
    return checker_.IsFree(near, next) ? tree.Add(next, from) : -1;
  }

  /// Grows the tree step by step as far as q; the node there, or −1.
  int Connect(PathTree& tree, const VectorXd& q) {
    int node = tree.Nearest(q);
    while (node >= 0 && tree.q(node) != q) node = Extend(tree, node, q);
    return node;
  }

  Checker& checker_;
  Random random_;
  PathTree from_start_, from_goals_;
  VectorXd lower_, upper_;
};

void CutCorners(const JointPathProblem& problem, Checker& checker, std::vector<VectorXd>& path) {
  Random random(problem.seed + 1);
  for (int i = 0; i < kShortCuts && path.size() > 2 && !checker.exhausted(); ++i) {
    auto a = static_cast<size_t>(random.Index(static_cast<int>(path.size())));
    auto b = static_cast<size_t>(random.Index(static_cast<int>(path.size())));
    if (a > b) std::swap(a, b);
    if (b < a + 2 || !checker.IsFree(path[a], path[b])) continue;
    path.erase(path.begin() + static_cast<std::ptrdiff_t>(a) + 1,
               path.begin() + static_cast<std::ptrdiff_t>(b));
  }
}

}  // namespace

JointPath FindJointPath(const JointPathProblem& problem) {
  assert(!problem.goals.empty() && problem.is_free);
  JointPath result;
  Checker checker(problem);
  const auto finish = [&](JointPathStatus status) {
    result.status = status;
    result.checks = checker.checks();
    return result;
  };
  if (!checker.IsFree(problem.start)) return finish(JointPathStatus::kStartNotFree);
  std::vector<VectorXd> goals;
  for (const VectorXd& goal : problem.goals) {
    if (checker.IsFree(goal)) goals.push_back(goal);
  }
  if (goals.empty()) return finish(JointPathStatus::kNoFreeGoal);
  result.q = Search(problem, goals, checker).Run();
  if (result.q.empty()) return finish(JointPathStatus::kGaveUp);
  CutCorners(problem, checker, result.q);
  return finish(JointPathStatus::kFound);
}

}  // namespace tether::motion
