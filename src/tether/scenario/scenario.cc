#include "tether/scenario/scenario.h"

#include <algorithm>
#include <filesystem>
#include <set>

#include "tether/common/bounds.h"
#include "tether/common/file.h"
#include "tether/common/log.h"
#include "tether/constraints/core/kind.h"
#include "tether/control/constraint_spec.h"
#include "tether/planning/skeleton/action_reader.h"
#include "tether/scenario/scenario_reading.h"
#include "tether/scenario/scene_reader.h"
#include "tether/scenario/task_reader.h"

namespace tether::scenario {
namespace {

// Poses that come more seldom or later than this can't be servoed to while they move: 1/s, s.
constexpr double kSlowestRate = 5;
constexpr double kLongestDelay = 0.5;

namespace fs = std::filesystem;

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

class ScenarioParser {
 public:
  ScenarioParser(const std::string& path, const std::map<std::string, std::string>& files)
      : files_(path, files) {
    scenario_.path = path;
  }

  Scenario Read() {
    if (fs::is_directory(scenario_.path)) {
      throw InputError({{Location{scenario_.path, 0, 0}, "this is a folder", "the path of a scenario file"}});
    }
    const Value document = ParseYaml(files_.TextOf(scenario_.path), scenario_.path);
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
    SceneReading reading = ReadScene(reader, files_.folder());
    scenario_.scene = std::move(reading.scene);
    scenario_.models = std::move(reading.models);
    where_ = std::move(reading.where);
    if (const Value* actions = reader.Optional("actions")) {
      has_actions_ = true;
      libraries_read_ = actions->is_array();
      ReadLibraries(reader.TextList("actions"), *actions);
    }
    const Value* task = reader.Optional("task");
    if (task != nullptr)
      ReadTask(*task, {files_, where_, has_actions_, libraries_read_}, scenario_, diagnostics_);
    if (const Value* constraints = reader.Optional("constraints")) ReadGlobalConstraints(*constraints);
    if (const Value* planning = reader.Optional("planning")) ReadPlanning(*planning);
    if (const Value* execution = reader.Optional("execution")) ReadExecution(*execution);
    if (const Value* perturb = reader.Optional("perturb")) ReadPerturb(*perturb);
    if (const Value* sensing = reader.Optional("sensing")) ReadSensing(*sensing);
    if (const Value* events = reader.Optional("events")) ReadEventList(*events);
    reader.Finish();
    const Value* within_reach = task == nullptr ? nullptr : task->Find("within_reach");
    if (within_reach != nullptr && scenario_.problem != nullptr)
      StateReach(*within_reach, scenario_, diagnostics_);
    diagnostics_.ThrowIfAny();
    return std::move(scenario_);
  }

 private:
  void ReadLibraries(const std::vector<std::string>& names, const Value& list) {
    const std::vector<std::string> frames = FrameNames(scenario_.scene);
    const planning::ActionReadOptions options{constraints::KindNames(), frames};
    std::set<std::string> defined;
    for (size_t i = 0; i < names.size(); ++i) {
      const Location where = list.items()[i].where();
      const bool is_path = names[i].find('/') != std::string::npos || names[i].ends_with(".yaml");
      const std::string path =
          is_path ? files_.Resolve(names[i])
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
    std::vector<std::string> frames = parameters.AllFrames();
    std::sort(frames.begin(), frames.end());
    const auto twice = std::adjacent_find(frames.begin(), frames.end());
    if (twice != frames.end() && !twice->empty()) {
      diagnostics_.Add(spec.where, "constraint '" + spec.kind + "' names '" + *twice + "' twice",
                       "different frames");
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

  /// Constraints of the velocity controller and of key poses differ by their kinds.
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
    CheckJointMargins();
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

  /// A margin from both limits that leaves a joint nothing to move in.
  void CheckJointMargins() {
    for (const control::ConstraintSpec& spec : scenario_.control_constraints) {
      if (spec.kind != "joint_limits") continue;
      for (const auto& [name, model] : scenario_.models) {
        for (int i = 0; i < model->dof(); ++i) {
          const double half = 0.5 * (model->upper()[i] - model->lower()[i]);
          if (spec.margin < half) continue;
          diagnostics_.Add(spec.where,
                           "'margin' of joint_limits is " + Value(spec.margin).AsText() +
                               " rad, which leaves " + model->joint_names()[i] + " of '" + name +
                               "' no room between its limits",
                           "less than " + Value(half).AsText() + " rad");
          break;
        }
      }
    }
  }

  void ReadPlanning(const Value& value) {
    ObjectReader reader(value, "'planning'", diagnostics_);
    PlanningSettings& planning = scenario_.planning;
    planning.solver = ReadChoice<nlp::Backend>(
        reader, "solver", Named({nlp::Backend::kNative, nlp::Backend::kIpopt, nlp::Backend::kNlopt}),
        planning.solver);
    if (const Value* weights = reader.Optional("weights")) {
      ObjectReader inner(*weights, "'weights' of 'planning'", diagnostics_);
      planning.weights.translation =
          ReadBound(inner, "translation", planning.weights.translation, "zero or more");
      planning.weights.rotation = ReadBound(inner, "rotation", planning.weights.rotation, "zero or more");
      inner.Finish();
    }
    planning.objective = ReadChoice<planning::Objective>(
        reader, "objective",
        {{"squares", planning::Objective::kSquares}, {"length", planning::Objective::kLength}},
        planning.objective);
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
    planning.latency = ReadBound(reader, "latency", planning.latency, "a time in s, up to 10", 10);
    if (reader.Optional("max_iterations") != nullptr)
      planning.max_iterations = ReadCount(reader, "max_iterations", 1, 1, "a whole number above zero");
    reader.Finish();
  }

  void ReadExecution(const Value& value) {
    ObjectReader reader(value, "'execution'", diagnostics_);
    ExecutionSettings& execution = scenario_.execution;
    execution.controller =
        ReadChoice<Controller>(reader, "controller",
                               Named({Controller::kConstrainedTorque, Controller::kOperationalSpace,
                                      Controller::kConstrainedVelocity}),
                               execution.controller);
    if (const Value* force = reader.Optional("max_force")) {
      execution.max_force_where = force->where();
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
    for (const auto& [key, number] :
         {std::pair{"gain", &execution.gain}, std::pair{"damping", &execution.damping}}) {
      const Value* given = reader.Optional(key);
      if (given == nullptr) continue;
      *number = ReadPositive(*given, std::string("'") + key + "' of 'execution'", diagnostics_);
    }
    if (const Value* timeout = reader.Optional("timeout")) {
      execution.timeout_s =
          ReadPositive(*timeout, "'timeout' of 'execution' (s)", diagnostics_, execution.timeout_s);
    }
    reader.Finish();
  }

  void ReadSensing(const Value& value) {
    ObjectReader reader(value, "'sensing'", diagnostics_);
    robot::Sensing& sensing = scenario_.sensing;
    if (const Value* torques = reader.Optional("torques")) {
      ObjectReader inner(*torques, "'torques' of 'sensing'", diagnostics_);
      sensing.torque_noise = ReadBound(inner, "noise", 0, "a torque in Nm, zero or more");
      sensing.torque_bias = ReadBound(inner, "bias", 0, "a torque in Nm, zero or more");
      sensing.mass_error = ReadBound(inner, "mass_error", 0, "a share, 0 to 1", 1);
      sensing.torque_delay = ReadBound(inner, "delay", 0, "a time in s, up to 1", 1);
      inner.Finish();
    }
    if (const Value* noise = reader.Optional("noise")) {
      ObjectReader inner(*noise, "'noise' of 'sensing'", diagnostics_);
      sensing.pose_noise = ReadBound(inner, "position", 0, "a distance in m", kGreatestLength);
      sensing.angle_noise = ReadBound(inner, "rotation", 0, "an angle in rad");
      inner.Finish();
    }
    sensing.pose_rate = ReadBound(reader, "rate", 0, "measurements per second; 0: in every tick");
    sensing.pose_delay = ReadBound(reader, "latency", 0, "a time in s, up to 10", 10);
    sensing.dropout = ReadBound(reader, "dropout", 0, "a share, 0 to 1", 1);
    if ((sensing.pose_rate > 0 && sensing.pose_rate < kSlowestRate) || sensing.pose_delay > kLongestDelay)
      LogWarning(scenario_.path + ": 'sensing' is slower than control can follow what moves (" +
                 Value(kSlowestRate).AsText() + " measurements per second, " + Value(kLongestDelay).AsText() +
                 " s of latency): the arm comes to where things were");
    reader.Finish();
  }

  void ReadPerturb(const Value& value) {
    ObjectReader reader(value, "'perturb'", diagnostics_);
    scenario_.perturb.position = ReadBound(reader, "position", 0, "a distance in m", kGreatestLength);
    scenario_.perturb.rotation = ReadBound(reader, "rotation", 0, "an angle in rad");
    reader.Finish();
  }

  void ReadEventList(const Value& value) {
    const EventNames names{&scenario_.scene, &scenario_.actions, scenario_.problem.get()};
    if (!value.is_scalar()) {
      scenario_.events = ParseEvents(value, names, diagnostics_);
      return;
    }
    const std::string path = files_.ExistingFile(value, "'events'", diagnostics_);
    if (path.empty()) return;
    try {
      scenario_.events = ParseEvents(ReadYaml(path), names, diagnostics_);
    } catch (const InputError& error) {
      diagnostics_.Add(error);
    }
  }

  ScenarioFiles files_;
  std::map<std::string, Location> where_;  ///< Where the scene's names were written.
  bool has_actions_ = false;               ///< There is a list of libraries.
  bool libraries_read_ = true;             ///< None of those named is missing or broken.
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

std::string ToString(Controller controller) {
  switch (controller) {
    case Controller::kConstrainedTorque:
      return "constrained_torque";
    case Controller::kOperationalSpace:
      return "operational_space";
    case Controller::kConstrainedVelocity:
      return "constrained_velocity";
  }
  return "unknown";
}

Scenario LoadScenario(const std::string& path) { return LoadScenario(path, {}); }

Scenario LoadScenario(const std::string& path, const std::map<std::string, std::string>& files) {
  return ScenarioParser(path, files).Read();
}

}  // namespace tether::scenario
