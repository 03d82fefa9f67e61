#include "tether/motion/joint_path.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <memory>

#include <ompl/base/goals/GoalStates.h>
#include <ompl/base/spaces/RealVectorStateSpace.h>
#include <ompl/geometric/PathGeometric.h>
#include <ompl/geometric/SimpleSetup.h>
#include <ompl/geometric/planners/rrt/RRTConnect.h>
#include <ompl/util/Console.h>
#include <ompl/util/RandomNumbers.h>

#include "tether/common/random.h"

namespace tether::motion {
namespace {

namespace ob = ompl::base;
namespace og = ompl::geometric;
using Eigen::VectorXd;
using Space = ob::RealVectorStateSpace;

// Tries at cutting corners off a path that was found.
constexpr int kShortCuts = 60;

/// Samples from a generator of our own: OMPL's seeds are global.
class Sampler : public ob::StateSampler {
 public:
  Sampler(const ob::StateSpace* space, uint64_t seed) : ob::StateSampler(space), random_(seed) {}

  void sampleUniform(ob::State* state) override {
    const auto& bounds = static_cast<const Space*>(space_)->getBounds();
    auto* values = state->as<Space::StateType>()->values;
    for (size_t i = 0; i < bounds.low.size(); ++i) values[i] = random_.Uniform(bounds.low[i], bounds.high[i]);
  }
  void sampleUniformNear(ob::State* state, const ob::State* near, double distance) override {
    const auto& bounds = static_cast<const Space*>(space_)->getBounds();
    for (size_t i = 0; i < bounds.low.size(); ++i) {
      const double middle = near->as<Space::StateType>()->values[i];
      state->as<Space::StateType>()->values[i] = random_.Uniform(std::max(bounds.low[i], middle - distance),
                                                                 std::min(bounds.high[i], middle + distance));
    }
  }
  void sampleGaussian(ob::State* state, const ob::State* mean, double deviation) override {
    sampleUniformNear(state, mean, 2 * deviation);
  }

 private:
  Random random_;
};

/// Counts the calls of `is_free`, and returns false once the limit is reached.
class Checker {
 public:
  explicit Checker(const JointPathProblem& problem) : problem_(problem) {}

  bool IsFree(const VectorXd& q) {
    ++checks_;
    return problem_.is_free(q);
  }
  /// The straight line between two configurations, both ends included.
  bool IsFree(const VectorXd& a, const VectorXd& b) {
    const int steps =
        std::max(1, static_cast<int>(std::ceil((b - a).cwiseAbs().maxCoeff() / problem_.resolution)));
    for (int i = 0; i <= steps; ++i) {
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

void CutCorners(const JointPathProblem& problem, Checker& checker, std::vector<VectorXd>& path) {
  Random random(problem.seed + 1);
  for (int i = 0; i < kShortCuts && path.size() > 2 && !checker.exhausted(); ++i) {
    auto a = static_cast<size_t>(random.Uniform(0, static_cast<double>(path.size()) - 1e-9));
    auto b = static_cast<size_t>(random.Uniform(0, static_cast<double>(path.size()) - 1e-9));
    if (a > b) std::swap(a, b);
    if (b < a + 2 || !checker.IsFree(path[a], path[b])) continue;
    path.erase(path.begin() + static_cast<std::ptrdiff_t>(a) + 1,
               path.begin() + static_cast<std::ptrdiff_t>(b));
  }
}

}  // namespace

JointPath FindJointPath(const JointPathProblem& problem) {
  assert(!problem.goals.empty() && problem.is_free);
  const auto n = static_cast<unsigned>(problem.start.size());
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

  ompl::msg::setLogLevel(ompl::msg::LOG_NONE);
  auto space = std::make_shared<Space>(n);
  ob::RealVectorBounds bounds(n);
  double longest = 0;
  for (unsigned i = 0; i < n; ++i) {
    bounds.setLow(i, std::min(problem.lower[i], problem.start[i]));
    bounds.setHigh(i, std::max(problem.upper[i], problem.start[i]));
    longest += std::pow(bounds.high[i] - bounds.low[i], 2);
  }
  space->setBounds(bounds);
  space->setStateSamplerAllocator(
      [&problem](const ob::StateSpace* sampled) { return std::make_shared<Sampler>(sampled, problem.seed); });
  og::SimpleSetup setup(space);
  const auto to_vector = [n](const ob::State* state) {
    return VectorXd(Eigen::Map<const VectorXd>(state->as<Space::StateType>()->values, n));
  };
  setup.setStateValidityChecker(
      [&](const ob::State* state) { return !checker.exhausted() && checker.IsFree(to_vector(state)); });
  setup.getSpaceInformation()->setStateValidityCheckingResolution(problem.resolution / std::sqrt(longest));
  ob::ScopedState<Space> state(space);
  const auto fill = [&](const VectorXd& q) {
    for (unsigned i = 0; i < n; ++i) state[i] = q[i];
  };
  fill(problem.start);
  setup.addStartState(state);
  auto goal_states = std::make_shared<ob::GoalStates>(setup.getSpaceInformation());
  for (const VectorXd& goal : goals) {
    fill(goal);
    goal_states->addState(state);
  }
  setup.setGoal(goal_states);
  auto planner = std::make_shared<og::RRTConnect>(setup.getSpaceInformation());
  planner->setRange(0.5);
  setup.setPlanner(planner);
  const ob::PlannerStatus solved =
      setup.solve(ob::PlannerTerminationCondition([&] { return checker.exhausted(); }));
  if (solved != ob::PlannerStatus::EXACT_SOLUTION) return finish(JointPathStatus::kGaveUp);
  for (const ob::State* point : setup.getSolutionPath().getStates()) result.q.push_back(to_vector(point));
  CutCorners(problem, checker, result.q);
  return finish(JointPathStatus::kFound);
}

}  // namespace tether::motion
