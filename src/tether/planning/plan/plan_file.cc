#include "tether/planning/plan/plan_file.h"

#include <algorithm>

#include "tether/common/document/reader.h"
#include "tether/common/text.h"
#include "tether/geometry/hull/polytope.h"
#include "tether/planning/skeleton/action_reader.h"
#include "tether/planning/skeleton/skeleton_binding.h"

namespace tether::planning {
namespace {

Value WritePosition(const Eigen::Vector3d& p) { return Value(Eigen::VectorXd(p)); }

Value WriteQuaternion(const math::Pose& X) {
  const Eigen::Quaterniond q = X.Quaternion();
  return Value(Eigen::VectorXd(Eigen::Vector4d(q.w(), q.x(), q.y(), q.z())));
}

Value WritePrimitive(const geometry::Primitive& primitive) {
  const auto round = [](double radius, double length) {
    return Value::Object().Set("radius", radius).Set("length", length);
  };
  Value form = Value::Object();
  if (const auto* box = std::get_if<geometry::Box>(&primitive)) form.Set("box", WritePosition(box->size));
  if (const auto* sphere = std::get_if<geometry::Sphere>(&primitive)) form.Set("sphere", sphere->radius);
  if (const auto* capsule = std::get_if<geometry::Capsule>(&primitive)) {
    form.Set("capsule", round(capsule->radius, capsule->length));
  }
  if (const auto* cylinder = std::get_if<geometry::Cylinder>(&primitive)) {
    form.Set("cylinder", round(cylinder->radius, cylinder->length));
  }
  if (const auto* hull = std::get_if<geometry::Hull>(&primitive)) {
    Value points = Value::Array();
    for (const Eigen::Vector3d& p : hull->polytope->vertices) points.Append(WritePosition(p));
    form.Set("hull", points);
  }
  return form;
}

Value WriteShape(const geometry::Shape& shape) {
  Value parts = Value::Array();
  for (const geometry::Part& part : shape.parts) {
    Value form = WritePrimitive(part.primitive);
    form.Set("pose", Value::Object()
                         .Set("position", WritePosition(part.X_SP.p))
                         .Set("quaternion_wxyz", WriteQuaternion(part.X_SP)));
    parts.Append(form);
  }
  return parts;
}

Value WriteForm(const scene::RegionForm& form) {
  if (const auto* disc = std::get_if<scene::Disc>(&form)) return Value::Object().Set("disc", disc->radius);
  if (const auto* rectangle = std::get_if<scene::Rectangle>(&form)) {
    return Value::Object().Set("rectangle", Value(Eigen::VectorXd(rectangle->size)));
  }
  return WritePrimitive(std::get<geometry::Primitive>(form));
}

/// A hash of all that planning reads of an action: FNV-1a of its text.
std::string Digest(const ActionSchema& action) {
  Value steps = Value::Array();
  for (const StepSchema& step : action.steps) {
    Value constraints = Value::Array();
    for (const ConstraintSpec& spec : step.constraints) {
      constraints.Append(Value::Object().Set(spec.kind, spec.parameters));
    }
    Value allow = Value::Array();
    for (const auto& [first, second] : step.allow) {
      allow.Append(first);
      allow.Append(second);
    }
    steps.Append(Value::Object()
                     .Set("control", step.control)
                     .Set("target", step.target)
                     .Set("region", step.target_is_region)
                     .Set("constraints", constraints)
                     .Set("allow", allow));
  }
  uint64_t hash = 0xcbf29ce484222325u;
  for (char c : WriteJson(steps, 0)) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3u;
  char text[20];
  FormatInto(text, sizeof text, "%016llx", static_cast<unsigned long long>(hash));
  return text;
}

/// Compares one kind of named thing of two fingerprints.
void CompareNamed(const Value& made_for, const Value& used_with, const std::string& key,
                  const std::string& noun, const std::string& difference, Diagnostics& diagnostics) {
  const Value* before = made_for.Find(key);
  const Value& now = *used_with.Find(key);
  if (before == nullptr || !before->is_object()) {
    diagnostics.Add(before ? before->where() : made_for.where(), "'made_for' lacks '" + key + "'",
                    "a plan as tether writes it");
    return;
  }
  std::vector<std::string> names;
  for (const Value::Member& member : now.members()) names.push_back(member.key);
  for (const Value::Member& member : before->members()) {
    const Value* same = now.Find(member.key);
    if (same == nullptr) {
      diagnostics.Add(member.where,
                      "the plan was made for another scenario: there is no " + noun + " '" + member.key + "'",
                      names.empty() ? "" : SuggestFrom(member.key, names));
    } else if (WriteJson(*same, 0) != WriteJson(member.value, 0)) {
      diagnostics.Add(
          member.where,
          "the plan was made for another scenario: " + noun + " '" + member.key + "' has " + difference, "");
    }
  }
  for (const std::string& name : names) {
    if (before->Find(name) != nullptr) continue;
    diagnostics.Add(before->where(),
                    "the plan was made for another scenario: " + noun + " '" + name + "' was not there", "");
  }
}

void CompareFingerprints(const Value& made_for, const Value& used_with, Diagnostics& diagnostics) {
  CompareNamed(made_for, used_with, "robots", "robot", "another model", diagnostics);
  CompareNamed(made_for, used_with, "objects", "object", "another shape", diagnostics);
  CompareNamed(made_for, used_with, "regions", "region", "another form", diagnostics);
  CompareNamed(made_for, used_with, "actions", "action", "other parameters, steps or constraints",
               diagnostics);
}

class PlanParser {
 public:
  PlanParser(const scene::Scene& scene, const std::vector<ActionSchema>& actions, Diagnostics& diagnostics)
      : scene_(scene), schemas_(actions), diagnostics_(diagnostics) {}

  Plan Parse(ObjectReader& reader) {
    Plan plan;
    plan.robot = reader.Text("robot", "");
    if (!plan.robot.empty() && scene_.FindRobot(plan.robot) == nullptr) {
      diagnostics_.Add(reader.value().Find("robot")->where(), "there is no robot '" + plan.robot + "'",
                       "a robot of the scenario");
    }
    plan.actions = reader.TextList("actions");
    const std::vector<Expected> expected = Expect(reader.value().Find("actions"), plan.actions);
    plan.cost = reader.Number("cost", 0);
    if (const Value* steps = reader.Required("steps", "a list of key poses")) {
      if (!steps->is_array())
        diagnostics_.Add(steps->where(), "'steps' is " + steps->KindName(), "a list of key poses");
      for (const Value& step : steps->items()) plan.steps.push_back(ParseStep(step, plan));
      if (diagnostics_.empty()) CompareSteps(plan, expected, *steps);
      SetModes(&plan);
    }
    return plan;
  }

 private:
  /// A key pose as the actions of a plan require it.
  struct Expected {
    std::string action;
    int action_index = 0;
    std::string control, target;
    bool target_is_region = false;
  };

  /// The key poses that `actions` require, in order.
  std::vector<Expected> Expect(const Value* list, const std::vector<std::string>& actions) {
    std::vector<Expected> expected;
    for (size_t i = 0; i < actions.size(); ++i) {
      const Location where =
          list != nullptr && i < list->items().size() ? list->items()[i].where() : Location{};
      const ActionCall call = ParseActionCall(actions[i]);
      std::vector<std::string> names;
      const ActionSchema* schema = nullptr;
      for (const ActionSchema& candidate : schemas_) {
        names.push_back(candidate.name);
        if (candidate.name == call.name) schema = &candidate;
      }
      if (schema == nullptr) {
        diagnostics_.Add(where, "unknown action '" + call.name + "' in the plan",
                         SuggestFrom(call.name, names));
        continue;
      }
      if (schema->parameters.size() != call.arguments.size()) {
        diagnostics_.Add(where,
                         "action '" + actions[i] + "' of the plan has " +
                             std::to_string(call.arguments.size()) + " arguments",
                         "it takes " + std::to_string(schema->parameters.size()));
        continue;
      }
      for (const std::string& argument : call.arguments) CheckFrame(argument, where, "in the plan's actions");
      for (const StepSchema& step : BindAction(*schema, call.arguments)) {
        expected.push_back(
            {actions[i], static_cast<int>(i), step.control, step.target, step.target_is_region});
      }
    }
    return expected;
  }

  void CompareSteps(const Plan& plan, const std::vector<Expected>& expected, const Value& list) {
    for (size_t i = 0; i < std::min(plan.steps.size(), expected.size()); ++i) {
      const PlanStep& step = plan.steps[i];
      const Expected& wanted = expected[i];
      if (step.action == wanted.action && step.action_index == wanted.action_index &&
          step.control == wanted.control && step.target == wanted.target &&
          step.target_is_region == wanted.target_is_region)
        continue;
      diagnostics_.Add(
          list.items()[i].where(),
          "key pose " + std::to_string(i + 1) + " is of '" + step.control + "' in '" + step.target +
              "', for " + step.action + " (action_index " + std::to_string(step.action_index) + ")",
          "the plan's actions require '" + wanted.control + "' in '" + wanted.target + "', for " +
              wanted.action + " (action_index " + std::to_string(wanted.action_index) + ")");
      return;
    }
    if (plan.steps.size() != expected.size()) {
      diagnostics_.Add(list.where(), "the plan has " + std::to_string(plan.steps.size()) + " key poses",
                       "its actions require " + std::to_string(expected.size()));
    }
  }

  PlanStep ParseStep(const Value& value, const Plan& plan) {
    PlanStep step;
    ObjectReader reader(value, "step", diagnostics_);
    step.action = reader.Text("action", "");
    step.action_index = reader.Integer("action_index", 0);
    if (step.action_index < 0 || step.action_index >= static_cast<int>(plan.actions.size())) {
      diagnostics_.Add(value.where(), "'action_index' of step is " + std::to_string(step.action_index),
                       plan.actions.empty() ? "no step: the plan has no actions"
                                            : "0 to " + std::to_string(plan.actions.size() - 1));
    }
    step.control = ReadFrame(reader, "control");
    step.target_is_region = value.Find("region") != nullptr;
    step.target = ReadFrame(reader, step.target_is_region ? "region" : "target");
    if (step.target_is_region) {
      if (!step.target.empty() && scene_.FindRegion(step.target) == nullptr) {
        diagnostics_.Add(value.Find("region")->where(), "'" + step.target + "' is not a region",
                         "a region, or 'target' with a pose");
      }
    } else {
      ReadPoseOf(reader, step);
    }
    step.face = reader.Text("face", "");
    const std::string mode = reader.Text("mode", "free");
    if (!FindStepMode(mode)) {
      diagnostics_.Add(value.Find("mode")->where(), "'mode' of step is '" + mode + "'",
                       SuggestFrom(mode, StepModeNames()));
    }
    reader.Text("held", "");
    reader.Text("tool", "");
    if (const Value* q = reader.Optional("q")) step.q = ReadJoints(*q, plan, "'q' of step");
    ReadMotion(reader, step, plan);
    if (const Value* force = reader.Optional("max_force"))
      step.max_force = ReadPositive(*force, "'max_force' of step (N)", diagnostics_);
    if (const Value* execute = reader.Optional("execute")) {
      if (!execute->is_array()) {
        diagnostics_.Add(execute->where(), "'execute' of step is " + execute->KindName(), "a list of verbs");
      }
      for (const Value& verb : execute->items()) {
        if (auto parsed = ParseVerb(verb, diagnostics_)) step.execute.push_back(std::move(*parsed));
      }
    }
    reader.Finish();
    return step;
  }

  Eigen::VectorXd ReadJoints(const Value& value, const Plan& plan, const std::string& what) {
    const scene::Robot* robot = scene_.FindRobot(plan.robot);
    const size_t n = robot != nullptr && !robot->q.empty() ? robot->q.size() : value.items().size();
    return ReadVector(value, static_cast<int>(n), what, diagnostics_).value_or(Eigen::VectorXd());
  }

  void ReadMotion(ObjectReader& reader, PlanStep& step, const Plan& plan) {
    StepMotion motion;
    motion.duration = reader.Number("duration_s", 0);
    motion.clearance = reader.Number("clearance_m", 0);
    const Value* path = reader.Optional("path");
    if (path == nullptr) return;
    if (!path->is_array() || path->items().size() < 2) {
      diagnostics_.Add(path->where(), "'path' of step is not a path",
                       "a list of at least two configurations, or no 'path'");
      return;
    }
    for (const Value& q : path->items()) motion.path.push_back(ReadJoints(q, plan, "'path' of step"));
    step.motion = std::move(motion);
  }

  void ReadPoseOf(ObjectReader& reader, PlanStep& step) {
    step.X_TC.p = reader.Vector("position", Eigen::VectorXd::Zero(3));
    if (const Value* quaternion = reader.Required("quaternion_wxyz", "four numbers")) {
      const auto q = ReadVector(*quaternion, 4, "'quaternion_wxyz' of step", diagnostics_);
      if (q && q->norm() < 1e-9) {
        diagnostics_.Add(quaternion->where(), "'quaternion_wxyz' of step has length zero",
                         "four numbers that are not all zero");
      } else if (q) {
        step.X_TC = math::Pose(Eigen::Quaterniond((*q)[0], (*q)[1], (*q)[2], (*q)[3]), step.X_TC.p);
      }
    }
  }

  std::string ReadFrame(ObjectReader& reader, const std::string& key) {
    const Value* value = reader.Required(key, "a frame: an object or region, hand or world");
    if (value == nullptr) return "";
    const std::string name = ReadText(*value, "'" + key + "' of step", diagnostics_);
    CheckFrame(name, value->where(), "as " + key + " of step");
    return name;
  }

  void CheckFrame(const std::string& name, const Location& where, const std::string& role) {
    if (name == "hand" || name == scene::kWorld || scene_.FindObject(name) || scene_.FindRegion(name)) return;
    std::vector<std::string> known = {"hand", scene::kWorld};
    for (const scene::Object& object : scene_.objects) known.push_back(object.name);
    for (const scene::Region& region : scene_.regions) known.push_back(region.name);
    diagnostics_.Add(where, "unknown frame '" + name + "' " + role, SuggestFrom(name, known));
  }

  const scene::Scene& scene_;
  const std::vector<ActionSchema>& schemas_;
  Diagnostics& diagnostics_;
};

}  // namespace

Value Fingerprint(const scene::Scene& scene, const std::vector<ActionSchema>& actions) {
  Value robots = Value::Object(), objects = Value::Object(), regions = Value::Object(),
        schemas = Value::Object();
  for (const scene::Robot& robot : scene.robots) robots.Set(robot.name, robot.model);
  for (const scene::Object& object : scene.objects) {
    objects.Set(object.name,
                Value::Object().Set("movable", object.movable()).Set("shape", WriteShape(object.shape)));
  }
  for (const scene::Region& region : scene.regions) regions.Set(region.name, WriteForm(region.form));
  for (const ActionSchema& action : actions) {
    schemas.Set(action.name, std::to_string(action.parameters.size()) + " parameters, " + Digest(action));
  }
  return Value::Object()
      .Set("robots", robots)
      .Set("objects", objects)
      .Set("regions", regions)
      .Set("actions", schemas);
}

Value WriteStep(const PlanStep& step, bool with_execution) {
  Value value = Value::Object();
  value.Set("action", step.action).Set("action_index", step.action_index);
  value.Set("control", step.control).Set(step.target_is_region ? "region" : "target", step.target);
  if (!step.target_is_region)
    value.Set("position", WritePosition(step.X_TC.p)).Set("quaternion_wxyz", WriteQuaternion(step.X_TC));
  if (!step.face.empty()) value.Set("face", step.face);
  if (step.q.size() > 0) value.Set("q", Value(step.q));
  if (step.max_force) value.Set("max_force", *step.max_force);
  if (step.motion) {
    value.Set("duration_s", step.motion->duration).Set("clearance_m", step.motion->clearance);
    if (with_execution) {
      Value path = Value::Array();
      for (const Eigen::VectorXd& q : step.motion->path) path.Append(Value(q));
      value.Set("path", path);
    }
  }
  if (with_execution) {
    Value verbs = Value::Array();
    for (const Verb& verb : step.execute) verbs.Append(WriteVerb(verb));
    value.Set("execute", verbs).Set("mode", ToString(step.mode));
    if (!step.held.empty()) value.Set("held", step.held);
    if (step.mode == StepMode::kPush) value.Set("tool", step.tool);
  }
  return value;
}

Value WritePlan(const Plan& plan, const PlanOrigin& origin, const scene::Scene& scene,
                const std::vector<ActionSchema>& actions) {
  Value names = Value::Array(), steps = Value::Array();
  for (const std::string& action : plan.actions) names.Append(action);
  for (const PlanStep& step : plan.steps) steps.Append(WriteStep(step, true));
  Value value = Value::Object();
  value.Set("format", kPlanFormat).Set("tether", origin.tether).Set("seed", origin.seed);
  value.Set("scenario", plan.scenario).Set("scenario_file", origin.scenario_file).Set("robot", plan.robot);
  value.Set("actions", names).Set("cost", plan.cost).Set("steps", steps);
  value.Set("made_for", Fingerprint(scene, actions));
  return value;
}

PlanOrigin ReadPlanOrigin(const Value& document) {
  PlanOrigin origin;
  if (const Value* tether = document.Find("tether")) origin.tether = tether->AsText();
  if (const Value* seed = document.Find("seed")) origin.seed = seed->natural().value_or(0);
  if (const Value* file = document.Find("scenario_file")) origin.scenario_file = file->AsText();
  return origin;
}

Plan ParsePlan(const Value& document, const scene::Scene& scene, const std::vector<ActionSchema>& actions,
               Diagnostics& diagnostics) {
  ObjectReader reader(document, "the plan", diagnostics);
  if (!document.is_object()) return {};
  if (const Value* format = reader.Required("format", std::string("format: ") + kPlanFormat)) {
    if (format->AsText() != kPlanFormat) {
      diagnostics.Add(format->where(), "format is '" + format->AsText() + "'",
                      std::string("accepted: ") + kPlanFormat);
      return {};
    }
  }
  // First: between scenes that differ, every name in the plan would be reported as unknown.
  if (const Value* made_for = reader.Required("made_for", "a plan as tether writes it")) {
    Diagnostics differences;
    CompareFingerprints(*made_for, Fingerprint(scene, actions), differences);
    if (!differences.empty()) {
      for (const Diagnostic& difference : differences.list()) {
        diagnostics.Add(difference.where, difference.message, difference.accepted);
      }
      return {};
    }
  }
  reader.Optional("tether");
  reader.Optional("seed");
  reader.Optional("scenario_file");
  Plan plan = PlanParser(scene, actions, diagnostics).Parse(reader);
  plan.scenario = reader.Text("scenario", "");
  reader.Finish();
  return plan;
}

Plan ReadPlan(const std::string& path, const scene::Scene& scene, const std::vector<ActionSchema>& actions) {
  const Value document = ReadYaml(path);
  Diagnostics diagnostics;
  Plan plan = ParsePlan(document, scene, actions, diagnostics);
  diagnostics.ThrowIfAny();
  return plan;
}

}  // namespace tether::planning
