#include "tether/evaluation/loop/replanning.h"

#include <time.h>

#include <algorithm>
#include <utility>

#include "tether/planning/modes/region_domain.h"
#include "tether/scenario/problem.h"

namespace tether::evaluation {
namespace {

// A plan from a disturbed state may be longer than the task says by this many actions.
constexpr int kMoreActions = 6;
// Work is counted, so that the same run is planned in the same way on any machine.
constexpr int kMostCandidates = 24;
constexpr int kMostVariants = 12;
// Objects that are not seen are in nobody's way and out of reach, m.
constexpr double kUnseenHeight = 100;

/// CPU time of this thread so far, s.
double ThreadCpu() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

/// The scene with objects and the acting robot as requested. What can be moved hangs on the world; other
/// frames keep their parents, which may have been moved.
scene::Scene ObservedScene(const scene::Scene& scene, const execution::PlanRequest& request) {
  scene::Scene observed = scene;
  for (scene::Object& object : observed.objects) {
    const auto found = request.X_WO.find(object.name);
    if (found == request.X_WO.end()) {
      // It is somewhere, but not where it was.
      if (object.movable()) {
        object.parent = scene::kWorld;
        object.X_ParentObject = math::Pose(Eigen::Vector3d(0, 0, kUnseenHeight));
      }
      continue;
    }
    if (object.movable()) object.parent = scene::kWorld;
    const auto parent = request.X_WO.find(object.parent);
    const math::Pose X_WParent =
        parent != request.X_WO.end() ? parent->second : scene.InitialPose(object.parent);
    object.X_ParentObject = math::Between(X_WParent, found->second);
  }
  if (!observed.robots.empty()) {
    observed.robots.front().q.assign(request.q.data(), request.q.data() + request.q.size());
  }
  return observed;
}

/// The argument of a fact `at`.
std::string PlaceOfHand(const execution::PlanRequest& request) {
  const symbolic::Problem& problem = *request.problem;
  const int at = problem.domain->FindPredicate("at");
  for (const symbolic::Fact& fact : request.facts) {
    if (fact.predicate == at && fact.arguments.size() == 1)
      return problem.objects[ToIndex(fact.arguments[0])].name;
  }
  return "";
}

/// The PDDL problem whose initial state is the requested one.
std::shared_ptr<const symbolic::Problem> ObservedProblem(const scenario::Scenario& scenario,
                                                         const scene::Scene& observed,
                                                         const execution::PlanRequest& request) {
  if (scenario.task.domain.empty())
    return planning::MakeRegionProblem(observed, {PlaceOfHand(request), request.held, request.unseen});
  auto now = std::make_shared<symbolic::Problem>(*request.problem);
  now->init = request.facts;
  for (const std::string& name : scenario.task.within_reach) {
    const int predicate = now->domain->FindPredicate(name);
    std::erase_if(now->init, [&](const symbolic::Fact& fact) { return fact.predicate == predicate; });
    scenario::AddWithinReach(scenario, observed, predicate, {}, *now);
  }
  return now;
}

/// The goal without the conjuncts that are lost, whose texts go to `broken`.
task::TemporalGoal WithoutBroken(const std::shared_ptr<const symbolic::Task>& task,
                                 const task::TemporalGoal& goal, std::vector<std::string>* broken) {
  const ltl::Formula& formula = goal.formula;
  std::vector<ltl::Formula> left;
  const auto part = [&](const ltl::Formula& conjunct) {
    task::TemporalGoal one{conjunct, goal.semantics, goal.where};
    for (const ltl::Letter& letter : goal.read) {
      std::vector<std::string> names;
      for (size_t i = 0; i < formula.atoms().size(); ++i) {
        if (ltl::IsTrue(letter, static_cast<int>(i))) names.push_back(formula.atoms()[i]);
      }
      one.read.push_back(ltl::MakeLetter(conjunct.atoms(), names));
    }
    return one;
  };
  const ltl::Formula::Node& root = formula.node(formula.root());
  const std::vector<int> conjuncts =
      root.op == ltl::Operator::kAnd ? root.operands : std::vector<int>{formula.root()};
  for (const int node : conjuncts) {
    const ltl::Formula conjunct = formula.Sub(node);
    if (task::Product(task, part(conjunct)).Start())
      left.push_back(conjunct);
    else
      broken->push_back(conjunct.ToString());
  }
  if (broken->empty()) return goal;
  if (left.empty()) return part(ltl::Formula());
  return part(left.size() == 1 ? left[0] : ltl::Formula::Make(ltl::Operator::kAnd, left));
}

planning::Problem MakeProblem(const scenario::Scenario& scenario, const scene::Scene& observed,
                              const execution::PlanRequest& request, const std::atomic<bool>* stop) {
  scenario::PlanningOverrides overrides;
  overrides.threads = 1;
  overrides.stop = stop;
  planning::Problem problem = scenario::MakeProblem(scenario, observed, overrides);
  problem.robot.holds = request.held;
  // What was undone takes actions of its own.
  if (problem.search.max_actions > 0) problem.search.max_actions += kMoreActions;
  problem.search.max_candidates = kMostCandidates;
  problem.search.not_first = request.failed;
  problem.motion = false;  // Each transit is planned as it begins.
  problem.program.max_variants = std::min(problem.program.max_variants, kMostVariants);
  return problem;
}

}  // namespace

execution::PlanAnew MakePlanAnew(const scenario::Scenario& scenario, const scene::Scene& scene,
                                 const std::atomic<bool>* stop) {
  return [&scenario, &scene, stop](const execution::PlanRequest& request) {
    execution::PlanAnswer answer;
    const double begin = ThreadCpu();
    try {
      const scene::Scene observed = ObservedScene(scene, request);
      answer.task = symbolic::Task::Ground(ObservedProblem(scenario, observed, request));
      planning::Problem problem = MakeProblem(scenario, observed, request, stop);
      if (request.goal) answer.goal = WithoutBroken(answer.task, *request.goal, &answer.broken);
      problem.goal = answer.goal;
      planning::PlanReport report = planning::PlanTask(problem, *answer.task);
      if (report.best() == nullptr && !problem.search.not_first.empty()) {
        problem.search.not_first.clear();
        report = planning::PlanTask(problem, *answer.task);
      }
      answer.reason = report.message.empty() ? planning::ToString(report.status) : report.message;
      if (!request.unseen.empty()) answer.reason = "'" + request.unseen.front() + "' is not seen";
      if (const planning::CandidateReport* best = report.best(); best != nullptr) answer.plan = best->plan;
    } catch (const InputError& error) {
      answer.reason = error.what();
    } catch (const LimitReached& limit) {
      answer.reason = limit.what();
    }
    answer.cpu = ThreadCpu() - begin;
    return answer;
  };
}

}  // namespace tether::evaluation
