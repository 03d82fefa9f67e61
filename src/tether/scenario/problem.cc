#include "tether/scenario/problem.h"
#include "tether/scene/resting_contact.h"

#include <algorithm>
#include <cmath>
#include <thread>

#include "tether/common/log.h"
#include "tether/ltl/formula/cosafe.h"
#include "tether/ltl/formula/parser.h"
#include "tether/ltl/formula/words.h"
#include "tether/planning/check/region_check.h"
#include "tether/planning/ik/within_reach.h"
#include "tether/planning/program/effort.h"
#include "tether/robot/model.h"

namespace tether::scenario {
namespace {

planning::ActingRobot MakeActingRobot(const Scenario& scenario, const scene::Scene& scene, bool with_model) {
  const scene::Robot* robot = ActingRobot(scene);
  if (robot == nullptr) {
    throw InputError(
        {{Location{scenario.path, 0, 0}, "there is no robot to act", "'robots: {panda: {model: panda}}'"}});
  }
  const std::shared_ptr<const robot::Model>& model = scenario.models.at(robot->name);
  robot::State state(model);
  state.Set(Eigen::Map<const Eigen::VectorXd>(robot->q.data(), static_cast<Eigen::Index>(robot->q.size())),
            Eigen::VectorXd::Zero(model->dof()));
  planning::ActingRobot acting;
  acting.name = robot->name;
  acting.model = with_model ? model : nullptr;
  acting.X_WBase = scene.InitialPose(robot->name);
  acting.X_WHand = acting.X_WBase * state.X_BH();
  if (with_model) acting.q = state.q();
  return acting;
}

/// The arms that do not act: obstacles.
std::vector<planning::ActingRobot> MakeOtherRobots(const Scenario& scenario, const scene::Scene& scene,
                                                   const std::string& acting) {
  std::vector<planning::ActingRobot> others;
  for (const scene::Robot& robot : scene.robots) {
    if (robot.name == acting) continue;
    planning::ActingRobot other;
    other.name = robot.name;
    other.model = scenario.models.at(robot.name);
    other.X_WBase = scene.InitialPose(robot.name);
    other.q = Eigen::Map<const Eigen::VectorXd>(robot.q.data(), static_cast<Eigen::Index>(robot.q.size()));
    others.push_back(std::move(other));
  }
  return others;
}

nlp::Backend ChooseBackend(const Scenario& scenario, const std::string& override_name) {
  const nlp::Backend backend =
      override_name.empty() ? scenario.planning.solver : nlp::ParseBackend(override_name);
  if (const std::string why_not = nlp::MakeSolver(backend)->WhyNot(); !why_not.empty())
    throw InputError(why_not, "");
  return backend;
}

void CheckOverrides(const PlanningOverrides& overrides) {
  Diagnostics diagnostics;
  const auto at_least = [&](const auto& value, auto least, const char* name, const char* accepted) {
    if (value && !(*value >= least)) diagnostics.Add({}, std::string(name) + " is too small", accepted);
  };
  at_least(overrides.max_actions, 1, "--max-actions", "a whole number above zero");
  at_least(overrides.max_plans, 0, "--max-plans", "a number of plans; 0: all");
  at_least(overrides.threads, 0, "--threads", "a number of threads; 0: all processors");
  if (overrides.threads && *overrides.threads > kMostThreads)
    diagnostics.Add({}, "--threads is " + std::to_string(*overrides.threads),
                    "up to " + std::to_string(kMostThreads));
  if (overrides.time_limit_s && std::isnan(*overrides.time_limit_s)) {
    diagnostics.Add({}, "--time-limit is not a number", "a time in s; 0: no limit");
  } else {
    at_least(overrides.time_limit_s, 0.0, "--time-limit", "a time in s; 0: no limit");
  }
  at_least(overrides.max_iterations, 1, "--max-iterations", "a whole number above zero");
  diagnostics.ThrowIfAny();
}

/// The goal in place of the problem's, if there is one.
std::optional<task::TemporalGoal> ChooseGoal(const Scenario& scenario, const PlanningOverrides& overrides) {
  if (!overrides.goal.empty())
    return ReadTemporalGoal(overrides.goal, overrides.semantics.empty() ? "cosafe" : overrides.semantics);
  if (overrides.semantics.empty()) return scenario.goal;
  if (!scenario.goal) {
    throw InputError("--semantics has no effect without a temporal goal", "--goal FORMULA");
  }
  task::TemporalGoal goal = *scenario.goal;
  goal.semantics = ltl::ReadSemantics(overrides.semantics);
  goal.formula = ltl::ReadEnds(goal.formula, goal.semantics);
  ltl::RequireSemantics(goal.formula, goal.semantics, goal.where);
  return goal;
}

planning::SearchMethod ChooseSearch(const std::string& name) {
  if (name.empty()) return planning::SearchMethod::kAstar;
  const auto found = std::find(SearchNames().begin(), SearchNames().end(), name);
  if (found == SearchNames().end())
    throw InputError("--search: unknown '" + name + "'", SuggestFrom(name, SearchNames()));
  return static_cast<planning::SearchMethod>(found - SearchNames().begin());
}

/// Some action of the domain has steps for which any pose in a region serves.
bool HasRegionActions(const Scenario& scenario) {
  if (scenario.problem == nullptr) return false;
  return std::any_of(scenario.actions.begin(), scenario.actions.end(), [&](const auto& action) {
    return planning::HasRegionStep(action) && scenario.problem->domain->FindAction(action.name) >= 0;
  });
}

}  // namespace

const std::vector<std::string>& SearchNames() {
  static const std::vector<std::string> names = {"astar", "greedy", "dijkstra", "bfs"};
  return names;
}

task::TemporalGoal ReadTemporalGoal(const std::string& formula, const std::string& semantics) {
  const ltl::Semantics read = ltl::ReadSemantics(semantics);
  task::TemporalGoal goal{ltl::ReadEnds(ltl::ParseFormula(formula), read), read, {}};
  for (const Diagnostic& warning : SemanticsWarnings(goal.formula, goal.semantics))
    LogWarning(warning.ToString());
  return goal;
}

const scene::Robot* ActingRobot(const scene::Scene& scene) {
  return scene.robots.empty() ? nullptr : &scene.robots.front();
}

std::shared_ptr<const symbolic::Task> MakeTask(const Scenario& scenario, const Limits& limits) {
  const Location where = scenario.task.where.line > 0 ? scenario.task.where : Location{scenario.path, 0, 0};
  if (scenario.problem == nullptr && !scenario.task.ltl.empty()) {
    throw InputError(
        {{where, "the scenario has no actions", "actions: [regions], for a scene with regions"}});
  }
  if (scenario.problem == nullptr) {
    throw InputError({{where, "the scenario has no task",
                       "'task' with 'domain' and 'problem', two PDDL files, or with a goal and regions"}});
  }
  return symbolic::Task::Ground(scenario.problem, limits);
}

void AddWithinReach(const Scenario& scenario, const scene::Scene& scene, int predicate, const Location& where,
                    symbolic::Problem& problem) {
  const scene::Robot* robot = ActingRobot(scene);
  const auto& types = problem.domain->predicates[ToIndex(predicate)].parameters[0].types;
  for (size_t i = 0; i < problem.objects.size(); ++i) {
    const std::string& object = problem.objects[i].name;
    if (scene.FindObject(object) != nullptr && problem.domain->Fits(problem.objects[i].types, types) &&
        planning::WithinReach(*scenario.models.at(robot->name), scene.InitialPose(robot->name), scene,
                              object))
      problem.init.push_back({predicate, {static_cast<int>(i)}, where});
  }
}

planning::Problem MakeProblem(const Scenario& scenario, const scene::Scene& scene,
                              const PlanningOverrides& overrides) {
  CheckOverrides(overrides);
  const PlanningSettings& settings = scenario.planning;
  planning::Problem problem;
  problem.title = scenario.title;
  problem.scene = scene::WithCarriers(scene);
  problem.actions = scenario.actions;
  for (const GlobalConstraint& constraint : scenario.constraints)
    problem.constraints.push_back(constraint.spec);
  problem.robot = MakeActingRobot(scenario, scene, settings.robot && !overrides.no_robot);
  problem.program.weights = settings.weights;
  problem.program.objective = settings.objective;
  problem.program.home = settings.home;
  problem.program.backend = ChooseBackend(scenario, overrides.solver);
  problem.program.solver.trace = overrides.trace;
  problem.goal = ChooseGoal(scenario, overrides);
  problem.search.method = ChooseSearch(overrides.search);
  problem.search.cheapest_only = HasRegionActions(scenario);
  problem.search.max_actions = overrides.max_actions.value_or(
      scenario.task.max_actions.value_or(problem.search.cheapest_only ? 0 : kMaxActions));
  problem.program.max_iterations =
      overrides.max_iterations ? overrides.max_iterations : settings.max_iterations;
  problem.program.solver.max_iterations = planning::EffortOf(problem.program).again;
  problem.search.max_plans = overrides.max_plans ? overrides.max_plans : settings.max_plans;
  problem.search.min_candidates = settings.min_candidates;
  problem.search.patience = settings.patience;
  problem.search.time_limit_s = overrides.time_limit_s.value_or(settings.time_limit_s);
  problem.search.memory_limit = overrides.memory_limit;
  const int threads = overrides.threads.value_or(settings.threads);
  problem.search.threads =
      threads > 0 ? threads : static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
  problem.search.seed = overrides.seed.value_or(scenario.seed);
  problem.search.stop = overrides.stop;
  problem.motion = !overrides.no_motion;
  problem.others = MakeOtherRobots(scenario, scene, problem.robot.name);
  return problem;
}

}  // namespace tether::scenario
