#include "tether/evaluation/loop/replanning.h"

#include <algorithm>
#include <utility>

#include "tether/scenario/problem.h"

namespace tether::evaluation {
namespace {

// A plan from a disturbed state may be longer than the task says by this many actions.
constexpr int kMoreActions = 6;
// Work is counted, so that the same run is planned in the same way on any machine.
constexpr int kMostCandidates = 24;
constexpr int kMostVariants = 12;

/// The scene with objects and the acting robot as requested. What can be moved hangs on the world; other
/// frames keep their parents, which may have been moved.
scene::Scene ObservedScene(const scene::Scene& scene, const execution::PlanRequest& request) {
  scene::Scene observed = scene;
  for (scene::Object& object : observed.objects) {
    const auto found = request.X_WO.find(object.name);
    if (found == request.X_WO.end()) continue;
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

/// The PDDL problem whose initial state is the requested one.
std::shared_ptr<const symbolic::Problem> ObservedProblem(const scenario::Scenario& scenario,
                                                         const scene::Scene& observed,
                                                         const execution::PlanRequest& request) {
  auto problem = std::make_shared<symbolic::Problem>(*scenario.problem);
  problem->init = request.facts;
  for (const std::string& name : scenario.task.within_reach) {
    const int predicate = problem->domain->FindPredicate(name);
    std::erase_if(problem->init, [&](const symbolic::Fact& fact) { return fact.predicate == predicate; });
    scenario::AddWithinReach(scenario, observed, predicate, {}, *problem);
  }
  return problem;
}

}  // namespace

execution::PlanAnew MakePlanAnew(const scenario::Scenario& scenario, const scene::Scene& scene,
                                 const std::atomic<bool>* stop) {
  return [&scenario, &scene, stop](const execution::PlanRequest& request) {
    execution::PlanAnswer answer;
    try {
      const scene::Scene observed = ObservedScene(scene, request);
      answer.task = symbolic::Task::Ground(ObservedProblem(scenario, observed, request));
      scenario::PlanningOverrides overrides;
      overrides.threads = 1;
      overrides.stop = stop;
      planning::Problem problem = scenario::MakeProblem(scenario, observed, overrides);
      problem.robot.holds = request.held;
      // What was undone takes actions of its own.
      if (problem.search.max_actions > 0) problem.search.max_actions += kMoreActions;
      problem.search.max_candidates = kMostCandidates;
      problem.motion = false;  // Each transit is planned as it begins.
      problem.program.max_variants = std::min(problem.program.max_variants, kMostVariants);
      planning::PlanReport report = planning::PlanTask(problem, *answer.task);
      answer.reason = report.message.empty() ? planning::ToString(report.status) : report.message;
      if (const planning::CandidateReport* best = report.best(); best != nullptr) answer.plan = best->plan;
    } catch (const InputError& error) {
      answer.reason = error.what();
    } catch (const LimitReached& limit) {
      answer.reason = limit.what();
    }
    return answer;
  };
}

}  // namespace tether::evaluation
