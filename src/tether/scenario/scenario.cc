#include "tether/scenario/scenario.h"

#include <algorithm>
#include <filesystem>
#include <memory>
#include <set>

#include "tether/common/bounds.h"
#include "tether/common/file.h"
#include "tether/common/log.h"
#include "tether/constraints/core/kind.h"
#include "tether/control/constraint_spec.h"
#include "tether/ltl/formula/cosafe.h"
#include "tether/ltl/formula/parser.h"
#include "tether/ltl/formula/words.h"
#include "tether/planning/ik/within_reach.h"
#include "tether/planning/modes/region_domain.h"
#include "tether/planning/skeleton/action_reader.h"
#include "tether/scenario/problem.h"
#include "tether/scenario/scene_reader.h"

namespace tether::scenario {
namespace {

namespace fs = std::filesystem;

/// One of `accepted`, or the fallback after a diagnostic.
std::string ReadChoice(ObjectReader& reader, std::string_view key, const std::vector<std::string>& accepted,
                       const std::string& fallback) {
  const Value* value = reader.Optional(key);
  if (value == nullptr) return fallback;
  const std::string text =
      ReadText(*value, "'" + std::string(key) + "' of " + reader.what(), reader.diagnostics());
  if (std::find(accepted.begin(), accepted.end(), text) != accepted.end()) return text;
  reader.diagnostics().Add(value->where(),
                           "'" + std::string(key) + "' of " + reader.what() + " is '" + text + "'",
                           SuggestFrom(text, accepted));
  return fallback;
}

control::ConstraintNames ControlNames(const scene::Scene& scene) {
  control::ConstraintNames names;
  for (const scene::Object& object : scene.objects) {
    names.objects.push_back(object.name);
    if (object.movable()) names.movable.push_back(object.name);
  }
  names.frames = FrameNames(scene);
  for (const scene::Robot& robot : scene.robots) names.frames.push_back(robot.name + "/base");
  return names;
}

/// A finite number from zero to `most`.
double ReadBound(ObjectReader& reader, std::string_view key, double fallback, const std::string& accepted,
                 double most = kGreatestNumber) {
  const double number = reader.Number(key, fallback);
  if (number > most) {
    reader.diagnostics().Add(
        reader.value().Find(key)->where(),
        "'" + std::string(key) + "' of " + reader.what() + " is " + reader.value().Find(key)->AsText(),
        "at most " + Value(most).AsText());
    return fallback;
  }
  if (number >= 0) return number;
  reader.diagnostics().Add(reader.value().Find(key)->where(),
                           "'" + std::string(key) + "' of " + reader.what() + " is negative", accepted);
  return fallback;
}

int ReadCount(ObjectReader& reader, std::string_view key, int fallback, int least,
              const std::string& accepted) {
  const int number = reader.Integer(key, fallback);
  if (number >= least) return number;
  reader.diagnostics().Add(reader.value().Find(key)->where(),
                           "'" + std::string(key) + "' of " + reader.what() + " is " + std::to_string(number),
                           accepted);
  return fallback;
}

class ScenarioParser {
 public:
  ScenarioParser(const std::string& path, const std::map<std::string, std::string>& files)
      : files_(files), folder_(fs::path(path).parent_path().string()) {
    scenario_.path = path;
  }

  Scenario Read() {
    if (fs::is_directory(scenario_.path)) {
      throw InputError({{Location{scenario_.path, 0, 0}, "this is a folder", "the path of a scenario file"}});
    }
    const Value document = ParseYaml(TextOf(scenario_.path), scenario_.path);
    if (document.is_null()) {
      throw InputError({{Location{scenario_.path, 0, 0}, "there is nothing in this file",
                         std::string("a scenario, which begins with format: ") + kScenarioFormat}});
    }
    ObjectReader reader(document, "the scenario", diagnostics_);
    if (!document.is_object()) diagnostics_.ThrowIfAny();
    if (const Value* format = reader.Required("format", std::string("format: ") + kScenarioFormat)) {
      if (format->AsText() != kScenarioFormat) {
        diagnostics_.Add(format->where(), "format is '" + format->AsText() + "'",
                         std::string("accepted: ") + kScenarioFormat);
        diagnostics_.ThrowIfAny();  // its keys would only be judged by the wrong rules
      }
    }
    scenario_.title = reader.Text("title", fs::path(scenario_.path).stem().string());
    scenario_.seed = reader.Natural("seed", 0);
    SceneReading reading = ReadScene(reader, folder_);
    scenario_.scene = std::move(reading.scene);
    scenario_.models = std::move(reading.models);
    where_ = std::move(reading.where);
    if (const Value* actions = reader.Optional("actions")) {
      has_actions_ = true;
      ReadLibraries(reader.TextList("actions"), *actions);
    }
    if (const Value* task = reader.Optional("task")) ReadTask(*task);
    if (const Value* constraints = reader.Optional("constraints")) ReadGlobalConstraints(*constraints);
    if (const Value* planning = reader.Optional("planning")) ReadPlanning(*planning);
    if (const Value* execution = reader.Optional("execution")) ReadExecution(*execution);
    if (const Value* perturb = reader.Optional("perturb")) ReadPerturb(*perturb);
    if (const Value* events = reader.Optional("events")) ReadEventList(*events);
    reader.Finish();
    if (within_reach_ != nullptr && scenario_.problem != nullptr) StateReach();
    diagnostics_.ThrowIfAny();
    return std::move(scenario_);
  }

 private:
  std::string Resolve(const std::string& path) const {
    return fs::path(path).is_absolute() ? path : (fs::path(folder_) / path).lexically_normal().string();
  }

  std::string TextOf(const std::string& path) const {
    const auto found = files_.find(path);
    return found == files_.end() ? ReadFile(path) : found->second;
  }

  /// The file's path if it is there; else empty, after a diagnostic at the place that names it.
  std::string ExistingFile(const Value& value, const std::string& what) {
    const std::string name = ReadText(value, what, diagnostics_);
    if (name.empty()) return "";
    const std::string path = Resolve(name);
    std::error_code ignored;
    if (files_.contains(path) || fs::is_regular_file(path, ignored)) return path;
    diagnostics_.Add(value.where(), what + ": there is no file '" + path + "'",
                     "a path relative to the scenario");
    return "";
  }

  void ReadLibraries(const std::vector<std::string>& names, const Value& list) {
    const std::vector<std::string> frames = FrameNames(scenario_.scene);
    const planning::ActionReadOptions options{constraints::KindNames(), frames};
    std::set<std::string> defined;
    for (size_t i = 0; i < names.size(); ++i) {
      const Location where = list.items()[i].where();
      const bool is_path = names[i].find('/') != std::string::npos || names[i].ends_with(".yaml");
      const std::string path =
          is_path ? Resolve(names[i])
                  : (fs::path(robot::DataDirectory()) / "models" / "actions" / (names[i] + ".yaml")).string();
      std::error_code ignored;
      if (!fs::is_regular_file(path, ignored)) {
        diagnostics_.Add(
            where, is_path ? "there is no file '" + path + "'" : "unknown action library '" + names[i] + "'",
            SuggestFrom(names[i], ShippedActionLibraries()) + ", or a path relative to the scenario");
        libraries_read_ = false;
        continue;
      }
      try {
        const Value document = ReadYaml(path);
        for (planning::ActionSchema& action : planning::ParseActions(document, options, diagnostics_)) {
          CheckConstraintParameters(action);
          if (!defined.insert(action.name).second) {
            diagnostics_.Add(action.where, "action '" + action.name + "' is defined twice",
                             "each action once");
          } else {
            scenario_.actions.push_back(std::move(action));
          }
        }
      } catch (const InputError& error) {
        diagnostics_.Add(error);
        libraries_read_ = false;
      }
    }
  }

  void CheckConstraintParameters(const planning::ActionSchema& action) {
    for (const planning::StepSchema& step : action.steps) {
      for (const planning::ConstraintSpec& spec : step.constraints) {
        CheckParameters(spec, action.parameters);
      }
    }
  }

  /// Parameters of the right type, and every frame one of the scene or of `more`.
  void CheckParameters(const planning::ConstraintSpec& spec, const std::vector<std::string>& more) {
    const constraints::Kind* kind = constraints::FindKind(spec.kind);
    if (kind == nullptr) return;
    std::vector<std::string> known = more;
    known.insert(known.end(), {constraints::kHand, constraints::kMoved});
    for (const std::string& frame : FrameNames(scenario_.scene)) known.push_back(frame);
    const constraints::Parameters parameters =
        constraints::ReadParameters(*kind, spec.parameters, diagnostics_);
    for (const std::string& frame : parameters.AllFrames()) {
      if (frame.empty() || std::find(known.begin(), known.end(), frame) != known.end()) continue;
      diagnostics_.Add(PlaceOf(frame, spec.parameters, spec.where),
                       "constraint '" + spec.kind + "' names '" + frame + "', which is not in the scene",
                       SuggestFrom(frame, known));
    }
  }

  /// Where this text stands in `value`, at any depth; else `fallback`.
  static Location PlaceOf(const std::string& text, const Value& value, const Location& fallback) {
    if (value.is_scalar() && value.AsText() == text) return value.where();
    Location found = fallback;
    for (const Value& item : value.items()) found = PlaceOf(text, item, found);
    for (const Value::Member& member : value.members()) found = PlaceOf(text, member.value, found);
    return found;
  }

  void ReadTask(const Value& value) {
    ObjectReader reader(value, "'task'", diagnostics_);
    Task& task = scenario_.task;
    task.where = value.where();
    const Value* domain = reader.Optional("domain");
    const Value* problem = reader.Optional("problem");
    const Value* goal = reader.Optional("goal");
    if (reader.Optional("max_actions") != nullptr)
      task.max_actions = ReadCount(reader, "max_actions", kMaxActions, 1, "a whole number above zero");
    within_reach_ = reader.Optional("within_reach");
    if (within_reach_ != nullptr) task.within_reach = reader.TextList("within_reach");
    reader.Finish();
    if ((domain == nullptr) != (problem == nullptr)) {
      diagnostics_.Add(value.where(), std::string("'task' has no '") + (domain ? "problem" : "domain") + "'",
                       "domain and problem together: two PDDL files");
    }
    if (domain != nullptr) task.domain = ExistingFile(*domain, "'domain' of 'task'");
    if (problem != nullptr) task.problem = ExistingFile(*problem, "'problem' of 'task'");
    try {
      if (!task.domain.empty() && !task.problem.empty()) {
        scenario_.problem = ReadProblem(task.domain, task.problem);
        CheckProblem();
      } else if (domain == nullptr && problem == nullptr && goal != nullptr && has_actions_ &&
                 !scenario_.scene.regions.empty() && diagnostics_.empty()) {
        scenario_.problem = planning::MakeRegionProblem(scenario_.scene, where_, task.where, diagnostics_);
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

  std::shared_ptr<const symbolic::Problem> ReadProblem(const std::string& domain,
                                                       const std::string& problem) const {
    if (!files_.contains(domain) && !files_.contains(problem)) return symbolic::ReadProblem(domain, problem);
    return symbolic::ParseProblem(TextOf(problem), problem, symbolic::ParseDomain(TextOf(domain), domain));
  }

  /// Adds to the initial state what the arm reaches, for the predicates of `within_reach`.
  void StateReach() {
    auto problem = std::make_shared<symbolic::Problem>(*scenario_.problem);
    const scene::Robot* robot = ActingRobot(scenario_.scene);
    if (robot == nullptr || !scenario_.models.contains(robot->name)) {
      diagnostics_.Add(within_reach_->where(), "'within_reach' asks for an arm, and there is none",
                       "a robot under 'robots'");
      return;
    }
    std::vector<std::string> unary;
    for (const auto& predicate : problem->domain->predicates) {
      if (predicate.parameters.size() == 1) unary.push_back(predicate.name);
    }
    for (const std::string& name : scenario_.task.within_reach) {
      const int index = problem->domain->FindPredicate(name);
      if (index < 0 || problem->domain->predicates[static_cast<size_t>(index)].parameters.size() != 1) {
        diagnostics_.Add(within_reach_->where(),
                         "'within_reach' names '" + name + "', which is no predicate of one parameter",
                         SuggestFrom(name, unary));
        continue;
      }
      for (const symbolic::Fact& fact : problem->init) {
        if (fact.predicate != index) continue;
        diagnostics_.Add(fact.where,
                         ":init states '" + name + "', which 'within_reach' of " + scenario_.path +
                             " takes from the arm's reach",
                         "one of the two");
      }
      if (!diagnostics_.empty()) continue;
      const auto& types = problem->domain->predicates[static_cast<size_t>(index)].parameters[0].types;
      for (size_t i = 0; i < problem->objects.size(); ++i) {
        const std::string& object = problem->objects[i].name;
        if (scenario_.scene.FindObject(object) != nullptr &&
            problem->domain->Fits(problem->objects[i].types, types) &&
            planning::WithinReach(*scenario_.models.at(robot->name), scenario_.scene.InitialPose(robot->name),
                                  scenario_.scene, object))
          problem->init.push_back({index, {static_cast<int>(i)}, within_reach_->where()});
      }
    }
    scenario_.problem = std::move(problem);
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
    scenario_.task.semantics = ReadChoice(reader, "semantics", {"cosafe", "ltlf"}, scenario_.task.semantics);
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
      const ltl::Semantics semantics =
          task.semantics == "ltlf" ? ltl::Semantics::kLtlf : ltl::Semantics::kCosafe;
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
    // A scene with regions only lacks actions; nobody has to plan it.
    if (!scenario_.scene.regions.empty() && !has_actions_) return;
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
                       "PDDL object '" + object.name + "' is nothing in the scene " + scenario_.path,
                       SuggestFrom(object.name, bodies));
    }
    CheckActions();
  }

  /// Every PDDL action has a geometry.
  void CheckActions() {
    const symbolic::Problem& problem = *scenario_.problem;
    // Of the supplied domain nobody has seen a line.
    const bool supplied = scenario_.task.domain.empty();
    std::vector<std::string> known;
    for (const planning::ActionSchema& action : scenario_.actions) known.push_back(action.name);
    for (const symbolic::Action& action : problem.domain->actions) {
      const auto found = std::find_if(scenario_.actions.begin(), scenario_.actions.end(),
                                      [&](const auto& schema) { return schema.name == action.name; });
      if (found == scenario_.actions.end()) {
        // A library that could not be read may hold it.
        if (!libraries_read_) continue;
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

  /// Those of the velocity controller are told from those of key poses by their kinds.
  void ReadGlobalConstraints(const Value& list) {
    const std::vector<std::string> control_kinds =
        control::ConstraintSpecKinds(control::ConstraintPlace::kScenario);
    const auto is_control = [&](const Value& item) {
      return item.is_object() && item.members().size() == 1 &&
             std::find(control_kinds.begin(), control_kinds.end(), item.members()[0].key) !=
                 control_kinds.end();
    };
    Value of_poses = list.is_array() ? Value::Array() : list, of_control = Value::Array();
    of_poses.set_where(list.where());
    for (const Value& item : list.items()) (is_control(item) ? of_control : of_poses).Append(item);
    scenario_.control_constraints = control::ReadConstraintSpecs(
        of_control, control::ConstraintPlace::kScenario, ControlNames(scenario_.scene), diagnostics_);
    std::vector<std::string> kinds = constraints::KindNames();
    kinds.insert(kinds.end(), control_kinds.begin(), control_kinds.end());
    const auto specs =
        planning::ParseConstraints(of_poses, "'constraints' of the scenario", kinds, diagnostics_);
    for (const planning::ConstraintSpec& spec : specs) {
      GlobalConstraint constraint{spec, std::nullopt};
      constraint.spec.parameters = Value::Object();
      constraint.spec.parameters.set_where(spec.parameters.where());
      for (const Value::Member& member : spec.parameters.members()) {
        if (member.key == "relax") {
          constraint.relax =
              ReadInteger(member.value, "'relax' of constraint '" + spec.kind + "'", diagnostics_);
        } else {
          constraint.spec.parameters.Set(member.key, member.value, member.where);
        }
      }
      CheckParameters(constraint.spec, {});
      scenario_.constraints.push_back(std::move(constraint));
    }
  }

  void ReadPlanning(const Value& value) {
    ObjectReader reader(value, "'planning'", diagnostics_);
    PlanningSettings& planning = scenario_.planning;
    planning.solver = ReadChoice(reader, "solver", {"native", "ipopt", "nlopt"}, planning.solver);
    if (const Value* weights = reader.Optional("weights")) {
      ObjectReader inner(*weights, "'weights' of 'planning'", diagnostics_);
      planning.weight_translation =
          ReadBound(inner, "translation", planning.weight_translation, "zero or more");
      planning.weight_rotation = ReadBound(inner, "rotation", planning.weight_rotation, "zero or more");
      inner.Finish();
    }
    planning.objective = ReadChoice(reader, "objective", {"squares", "length"}, planning.objective);
    planning.home = reader.Bool("home", planning.home);
    planning.robot = reader.Bool("robot", planning.robot);
    if (reader.Optional("max_plans") != nullptr)
      planning.max_plans = ReadCount(reader, "max_plans", 0, 0, "a number of plans; 0: all");
    planning.min_candidates =
        ReadCount(reader, "min_candidates", planning.min_candidates, 1, "a number of candidates above zero");
    planning.patience = ReadBound(reader, "patience", planning.patience, "a factor of zero or more");
    planning.threads =
        ReadCount(reader, "threads", planning.threads, 0, "a number of threads; 0: all processors");
    if (planning.threads > kMostThreads) {
      diagnostics_.Add(value.Find("threads")->where(),
                       "'threads' of 'planning' is " + std::to_string(planning.threads),
                       "up to " + std::to_string(kMostThreads));
    }
    planning.time_limit_s =
        ReadBound(reader, "time_limit", planning.time_limit_s, "a time in s; 0: no limit");
    if (reader.Optional("max_iterations") != nullptr)
      planning.max_iterations = ReadCount(reader, "max_iterations", 1, 1, "a whole number above zero");
    reader.Finish();
  }

  void ReadExecution(const Value& value) {
    ObjectReader reader(value, "'execution'", diagnostics_);
    ExecutionSettings& execution = scenario_.execution;
    execution.controller =
        ReadChoice(reader, "controller", {"operational_space", "constrained_torque", "constrained_velocity"},
                   execution.controller);
    if (const Value* force = reader.Optional("max_force")) {
      execution.max_force =
          ReadPositive(*force, "'max_force' of 'execution' (N)", diagnostics_, execution.max_force);
    }
    if (const Value* rate = reader.Optional("rate")) {
      execution.rate = ReadPositive(*rate, "'rate' of 'execution' (Hz)", diagnostics_, execution.rate);
      if (execution.rate < kSlowestRate || execution.rate > kFastestRate) {
        diagnostics_.Add(rate->where(), "'rate' of 'execution' is " + rate->AsText() + " Hz",
                         "10 to 100000 Hz");
        execution.rate = kFastestRate;
      }
    }
    const bool velocity = execution.controller == "constrained_velocity";
    for (const auto& [key, number] :
         {std::pair{"gain", &execution.gain}, std::pair{"damping", &execution.damping}}) {
      const Value* given = reader.Optional(key);
      if (given == nullptr) continue;
      *number = velocity ? ReadPositive(*given, std::string("'") + key + "' of 'execution'", diagnostics_)
                         : ReadBound(reader, key, 1, "zero or more");
    }
    if (const Value* timeout = reader.Optional("timeout")) {
      execution.timeout_s =
          ReadPositive(*timeout, "'timeout' of 'execution' (s)", diagnostics_, execution.timeout_s);
    }
    reader.Finish();
  }

  void ReadPerturb(const Value& value) {
    ObjectReader reader(value, "'perturb'", diagnostics_);
    scenario_.perturb.position = ReadBound(reader, "position", 0, "a distance in m", kGreatestLength);
    scenario_.perturb.rotation = ReadBound(reader, "rotation", 0, "an angle in rad");
    reader.Finish();
  }

  void ReadEventList(const Value& value) {
    const EventNames names{&scenario_.scene, &scenario_.actions};
    if (!value.is_scalar()) {
      scenario_.events = ParseEvents(value, names, diagnostics_);
      return;
    }
    const std::string path = ExistingFile(value, "'events'");
    if (path.empty()) return;
    try {
      scenario_.events = ParseEvents(ReadYaml(path), names, diagnostics_);
    } catch (const InputError& error) {
      diagnostics_.Add(error);
    }
  }

  const std::map<std::string, std::string>& files_;
  std::string folder_;
  std::map<std::string, Location> where_;  ///< Where the scene's names were written.
  bool has_actions_ = false;               ///< There is a list of libraries.
  bool libraries_read_ = true;             ///< None of those named is missing or broken.
  const Value* within_reach_ = nullptr;    ///< The key of the task.
  Diagnostics diagnostics_;
  Scenario scenario_;
};

}  // namespace

std::vector<std::string> ShippedActionLibraries() {
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(fs::path(robot::DataDirectory()) / "models" / "actions")) {
    if (entry.path().extension() == ".yaml") names.push_back(entry.path().stem().string());
  }
  std::sort(names.begin(), names.end());
  return names;
}

Scenario LoadScenario(const std::string& path) { return LoadScenario(path, {}); }

Scenario LoadScenario(const std::string& path, const std::map<std::string, std::string>& files) {
  return ScenarioParser(path, files).Read();
}

}  // namespace tether::scenario
