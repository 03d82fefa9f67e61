#include "tether/scenario/task_reader.h"

#include <algorithm>
#include <memory>
#include <vector>

#include "tether/common/log.h"
#include "tether/ltl/formula/cosafe.h"
#include "tether/ltl/formula/parser.h"
#include "tether/ltl/formula/words.h"
#include "tether/planning/modes/region_domain.h"
#include "tether/scenario/problem.h"

namespace tether::scenario {
namespace {

class TaskReader {
 public:
  TaskReader(const TaskSurroundings& around, Scenario& scenario, Diagnostics& diagnostics)
      : around_(around), scenario_(scenario), diagnostics_(diagnostics) {}

  void Read(const Value& value) {
    ObjectReader reader(value, "'task'", diagnostics_);
    Task& task = scenario_.task;
    task.where = value.where();
    const Value* domain = reader.Optional("domain");
    const Value* problem = reader.Optional("problem");
    const Value* goal = reader.Optional("goal");
    if (reader.Optional("max_actions") != nullptr)
      task.max_actions = ReadCount(reader, "max_actions", kMaxActions, 1, "a whole number above zero");
    if (reader.Optional("within_reach") != nullptr) task.within_reach = reader.TextList("within_reach");
    reader.Finish();
    if ((domain == nullptr) != (problem == nullptr)) {
      diagnostics_.Add(value.where(), std::string("'task' has no '") + (domain ? "problem" : "domain") + "'",
                       "domain and problem together: two PDDL files");
    }
    if (domain != nullptr)
      task.domain = around_.files.ExistingFile(*domain, "'domain' of 'task'", diagnostics_);
    if (problem != nullptr)
      task.problem = around_.files.ExistingFile(*problem, "'problem' of 'task'", diagnostics_);
    try {
      if (!task.domain.empty() && !task.problem.empty()) {
        scenario_.problem = ReadProblem(task.domain, task.problem);
        CheckProblem();
      } else if (domain == nullptr && problem == nullptr && goal != nullptr && around_.has_actions &&
                 !scenario_.scene.regions.empty() && diagnostics_.empty()) {
        scenario_.problem =
            planning::MakeRegionProblem(scenario_.scene, around_.where, task.where, diagnostics_);
        if (scenario_.problem != nullptr) CheckActions();
      }
    } catch (const InputError& error) {
      diagnostics_.Add(error);
    }
    if (goal != nullptr) {
      ReadGoal(*goal);
    } else if (domain == nullptr && problem == nullptr) {
      diagnostics_.Add(value.where(), "'task' has no goal", "domain and problem (PDDL files), or goal");
    }
  }

 private:
  std::shared_ptr<const symbolic::Problem> ReadProblem(const std::string& domain,
                                                       const std::string& problem) const {
    if (!around_.files.IsReplaced(domain) && !around_.files.IsReplaced(problem))
      return symbolic::ReadProblem(domain, problem);
    return symbolic::ParseProblem(around_.files.TextOf(problem), problem,
                                  symbolic::ParseDomain(around_.files.TextOf(domain), domain));
  }

  /// `{pddl: (…)}`, `{ltl: …, semantics: …}`, or a temporal formula alone.
  void ReadGoal(const Value& value) {
    if (value.is_scalar()) {
      ReadFormula(value, "'goal' of 'task'");
      return;
    }
    ObjectReader reader(value, "'goal' of 'task'", diagnostics_);
    const Value* pddl = reader.Optional("pddl");
    const Value* ltl = reader.Optional("ltl");
    scenario_.task.semantics = ReadChoice<ltl::Semantics>(
        reader, "semantics", Named({ltl::Semantics::kCosafe, ltl::Semantics::kLtlf}),
        scenario_.task.semantics);
    reader.Finish();
    if (value.is_object() && (pddl == nullptr) == (ltl == nullptr)) {
      diagnostics_.Add(value.where(), "'goal' of 'task' needs one formula", "pddl: (…) or ltl: …");
      return;
    }
    if (ltl != nullptr) ReadFormula(*ltl, "'ltl' of 'goal'");
    if (pddl == nullptr) return;
    const std::string text = ReadText(*pddl, "'pddl' of 'goal'", diagnostics_);
    if (scenario_.problem == nullptr) {
      NeedDomain("a PDDL goal", pddl->where());
      return;
    }
    try {
      scenario_.problem = symbolic::WithGoal(*scenario_.problem, text, pddl->where());
    } catch (const InputError& error) {
      diagnostics_.Add(error);
    }
  }

  void ReadFormula(const Value& value, const std::string& what) {
    Task& task = scenario_.task;
    task.ltl = ReadText(value, what, diagnostics_);
    if (task.ltl.empty()) return;
    try {
      const ltl::Semantics semantics = task.semantics;
      scenario_.goal = task::TemporalGoal{
          ltl::ReadEnds(ltl::ParseFormula(task.ltl, value.where()), semantics), semantics, value.where()};
      ltl::RequireSemantics(scenario_.goal->formula, semantics, value.where());
      for (const Diagnostic& warning :
           ltl::SemanticsWarnings(scenario_.goal->formula, semantics, value.where())) {
        LogWarning(warning.ToString());
      }
    } catch (const InputError& error) {
      diagnostics_.Add(error);
    }
    if (scenario_.problem == nullptr) NeedDomain("a temporal goal", value.where());
  }

  void NeedDomain(const std::string& goal, const Location& where) {
    if (!scenario_.task.domain.empty() || !diagnostics_.empty()) return;
    // A scene with regions lacks nothing but actions; it need not be planned.
    if (!scenario_.scene.regions.empty() && !around_.has_actions) return;
    diagnostics_.Add(where, goal + " without a domain",
                     "'domain' and 'problem' beside 'goal', or a scene with regions");
  }

  /// Every PDDL object has a body or a region.
  void CheckProblem() {
    const symbolic::Problem& problem = *scenario_.problem;
    std::vector<std::string> bodies;
    for (const scene::Object& object : scenario_.scene.objects) bodies.push_back(object.name);
    for (const scene::Region& region : scenario_.scene.regions) bodies.push_back(region.name);
    for (const auto& [name, members] : scenario_.scene.groups) bodies.push_back(name);
    for (const scene::Robot& robot : scenario_.scene.robots) bodies.push_back(robot.name);
    for (const symbolic::TypedName& object : problem.objects) {
      if (std::find(bodies.begin(), bodies.end(), object.name) != bodies.end()) continue;
      diagnostics_.Add(object.where,
                       "PDDL object '" + object.name + "' is not in the scene " + scenario_.path,
                       SuggestFrom(object.name, bodies));
    }
    CheckActions();
  }

  /// Every PDDL action has a geometry.
  void CheckActions() {
    const symbolic::Problem& problem = *scenario_.problem;
    // The domain of regions is supplied: there is no file to point to.
    const bool supplied = scenario_.task.domain.empty();
    std::vector<std::string> known;
    for (const planning::ActionSchema& action : scenario_.actions) known.push_back(action.name);
    for (const symbolic::Action& action : problem.domain->actions) {
      const auto found = std::find_if(scenario_.actions.begin(), scenario_.actions.end(),
                                      [&](const auto& schema) { return schema.name == action.name; });
      if (found == scenario_.actions.end()) {
        // A library that could not be read may hold it.
        if (!around_.libraries_read) continue;
        diagnostics_.Add(supplied ? scenario_.task.where : action.where,
                         "action '" + action.name + "' has no geometry",
                         supplied        ? "actions: [regions], or 'domain' and 'problem' of the task"
                         : known.empty() ? "an action library under 'actions' of " + scenario_.path
                                         : SuggestFrom(action.name, known));
      } else if (found->parameters.size() != action.parameters.size()) {
        diagnostics_.Add(supplied ? found->where : action.where,
                         "action '" + action.name + "' has " + std::to_string(action.parameters.size()) +
                             " parameters, but its geometry (" + found->where.ToString() + ") has " +
                             std::to_string(found->parameters.size()),
                         "the same number");
      }
    }
  }

  const TaskSurroundings& around_;
  Scenario& scenario_;
  Diagnostics& diagnostics_;
};

}  // namespace

void ReadTask(const Value& value, const TaskSurroundings& surroundings, Scenario& scenario,
              Diagnostics& diagnostics) {
  TaskReader(surroundings, scenario, diagnostics).Read(value);
}

void StateReach(const Value& value, Scenario& scenario, Diagnostics& diagnostics) {
  auto problem = std::make_shared<symbolic::Problem>(*scenario.problem);
  const scene::Robot* robot = ActingRobot(scenario.scene);
  if (robot == nullptr || !scenario.models.contains(robot->name)) {
    diagnostics.Add(value.where(), "'within_reach' needs an arm, and there is none",
                    "a robot under 'robots'");
    return;
  }
  std::vector<std::string> unary;
  for (const auto& predicate : problem->domain->predicates) {
    if (predicate.parameters.size() == 1) unary.push_back(predicate.name);
  }
  for (const std::string& name : scenario.task.within_reach) {
    const int index = problem->domain->FindPredicate(name);
    if (index < 0 || problem->domain->predicates[index].parameters.size() != 1) {
      diagnostics.Add(value.where(),
                      "'within_reach' names '" + name + "', which is not a predicate of one parameter",
                      SuggestFrom(name, unary));
      continue;
    }
    for (const symbolic::Fact& fact : problem->init) {
      if (fact.predicate != index) continue;
      diagnostics.Add(fact.where,
                      ":init states '" + name + "', which 'within_reach' of " + scenario.path +
                          " takes from the arm's reach",
                      "one of the two");
    }
    if (diagnostics.empty()) AddWithinReach(scenario, scenario.scene, index, value.where(), *problem);
  }
  scenario.problem = std::move(problem);
}

}  // namespace tether::scenario
