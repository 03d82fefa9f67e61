// What happens in an event: the readers of its kinds.
#include <algorithm>
#include <cmath>

#include "tether/ltl/formula/cosafe.h"
#include "tether/ltl/formula/parser.h"
#include "tether/ltl/formula/words.h"
#include "tether/scenario/events/event_reader.h"
#include "tether/scenario/events/fault_reader.h"
#include "tether/scenario/scene_reader.h"

namespace tether::scenario {

Eigen::Vector3d EventReader::ReadVector3(const Value& value, const std::string& what) {
  return ReadVector(value, 3, what, diagnostics_).value_or(Eigen::VectorXd::Zero(3));
}

void EventReader::ReadObject(ObjectReader& reader, const std::string& what, bool movable, Event& event) {
  const Value* object = reader.Required("object", "the object that is " + what);
  if (object == nullptr) return;
  event.object = ReadText(*object, "'object' of event", diagnostics_);
  if (names_.scene == nullptr || event.object.empty()) return;
  const scene::Object* found = names_.scene->FindObject(event.object);
  if (found == nullptr) {
    std::vector<std::string> known;
    for (const scene::Object& one : names_.scene->objects) known.push_back(one.name);
    diagnostics_.Add(object->where(), "unknown object '" + event.object + "' in event",
                     SuggestFrom(event.object, known));
  } else if (movable && !found->movable()) {
    diagnostics_.Add(object->where(), "object '" + event.object + "' in event is fixed",
                     "an object with a mass");
  }
}

void EventReader::ReadOver(ObjectReader& reader, const std::string& meaning, Event& event) {
  if (const Value* over = reader.Required("over", meaning))
    event.over = ReadPositive(*over, "'over' of event", diagnostics_);
}

void EventReader::ReadDestination(const Value& value, Event& event) {
  const PoseSpec pose = ReadPose(value, "event", true, diagnostics_);
  event.has_goal = true;
  event.parent = pose.parent;
  event.X_ParentGoal = pose.X_ParentFrame;
  if (pose.parent != scene::kWorld) CheckFrame(pose.parent, pose.parent_where);
}

void EventReader::ReadMove(const Value& value, Event& event) {
  ObjectReader reader(value, "'move' of event", diagnostics_);
  ReadObject(reader, "moved", false, event);
  const Value* by = reader.Optional("by");
  const Value* yaw = reader.Optional("yaw");
  const Value* to = reader.Optional("to");
  if (value.is_object() && (to != nullptr) == (by != nullptr || yaw != nullptr)) {
    diagnostics_.Add(value.where(), "'move' of event needs one destination",
                     "by: [x, y, z] in m in the world (and yaw: in rad), or to: a pose");
  }
  if (by != nullptr) event.X_by.p = ReadVector3(*by, "'by' of event");
  if (yaw != nullptr)
    event.X_by.R = math::RotationFromRpy({0, 0, ReadNumber(*yaw, "'yaw' of event", diagnostics_)});
  if (to != nullptr) ReadDestination(*to, event);
  ReadOver(reader, "a duration in s: objects move at finite speed", event);
  event.steady = reader.Bool("steady", false);
  reader.Finish();
}

void EventReader::ReadRotate(const Value& value, Event& event) {
  ObjectReader reader(value, "'rotate' of event", diagnostics_);
  ReadObject(reader, "turned", false, event);
  if (const Value* by = reader.Required("by", "an angle about the vertical in rad, or [roll, pitch, yaw]")) {
    const Eigen::Vector3d rpy = by->is_array()
                                    ? ReadVector3(*by, "'by' of event")
                                    : Eigen::Vector3d(0, 0, ReadNumber(*by, "'by' of event", diagnostics_));
    event.X_by.R = math::RotationFromRpy(rpy);
  }
  ReadOver(reader, "a duration in s: objects turn at finite speed", event);
  event.steady = reader.Bool("steady", false);
  reader.Finish();
}

void EventReader::ReadPush(const Value& value, Event& event) {
  ObjectReader reader(value, "the push of event", diagnostics_);
  Eigen::Index joints = 0;
  if (const Value* robot = reader.Required("robot", "the robot whose arm is pushed")) {
    event.robot = ReadText(*robot, "'robot' of event", diagnostics_);
    std::vector<std::string> known;
    for (const scene::Robot& one :
         names_.scene == nullptr ? std::vector<scene::Robot>{} : names_.scene->robots) {
      known.push_back(one.name);
      if (one.name == event.robot) joints = static_cast<Eigen::Index>(one.q.size());
    }
    if (names_.scene != nullptr && std::find(known.begin(), known.end(), event.robot) == known.end())
      diagnostics_.Add(robot->where(), "unknown robot '" + event.robot + "' in event",
                       SuggestFrom(event.robot, known));
  }
  if (const Value* torques = reader.Required("torques", "joint torques in Nm, one per joint")) {
    const Eigen::Index size = joints > 0 ? joints : static_cast<Eigen::Index>(torques->items().size());
    if (const auto read = ReadVector(*torques, static_cast<int>(size), "'torques' of event", diagnostics_))
      event.torques = *read;
  }
  ReadOver(reader, "a duration in s", event);
  reader.Finish();
}

void EventReader::ReadRemoval(const Value& value, Event& event) {
  ObjectReader reader(value, "'remove' of event", diagnostics_);
  ReadObject(reader, "removed", true, event);
  reader.Finish();
  event.other = Removal{};
}

void EventReader::ReadReturn(const Value& value, Event& event) {
  ObjectReader reader(value, "'add' of event", diagnostics_);
  ReadObject(reader, "put back", true, event);
  if (const Value* pose = reader.Optional("pose")) ReadDestination(*pose, event);
  reader.Finish();
  event.other = Return{};
}

void EventReader::ReadPull(const Value& value, Event& event) {
  ObjectReader reader(value, "'pull' of event", diagnostics_);
  if (value.Find("object") != nullptr) ReadObject(reader, "pulled", true, event);
  if (const Value* by = reader.Required("by", "[x, y, z] in m in the world"))
    event.X_by.p = ReadVector3(*by, "'by' of event");
  Pull pull;
  if (const Value* force = reader.Optional("force"))
    pull.force = ReadPositive(*force, "'force' of event", diagnostics_);
  event.over = 0.5;
  if (const Value* over = reader.Optional("over"))
    event.over = ReadPositive(*over, "'over' of event", diagnostics_);
  reader.Finish();
  event.other = pull;
}

void EventReader::ReadKnock(const Value& value, Event& event) {
  ObjectReader reader(value, "'knock' of event", diagnostics_);
  ReadObject(reader, "knocked", true, event);
  Knock knock;
  if (const Value* impulse = reader.Required("impulse", "[x, y, z] in N s in the world"))
    knock.impulse = ReadVector3(*impulse, "'impulse' of event");
  if (const Value* at = reader.Optional("at")) knock.at = ReadVector3(*at, "'at' of event");
  reader.Finish();
  event.other = knock;
}

void EventReader::ReadAlteration(const Value& value, Event& event) {
  ObjectReader reader(value, "'set' of event", diagnostics_);
  ReadObject(reader, "another in truth", true, event);
  Alteration set;
  if (const Value* mass = reader.Optional("mass"))
    set.mass = ReadPositive(*mass, "'mass' of event", diagnostics_);
  if (const Value* friction = reader.Optional("friction")) {
    set.friction = ReadNumber(*friction, "'friction' of event", diagnostics_);
    if (*set.friction < 0)
      diagnostics_.Add(friction->where(), "'friction' of event is negative", "a coefficient, zero or more");
  }
  if (const Value* grow = reader.Optional("size")) {
    set.grow = ReadNumber(*grow, "'size' of event", diagnostics_);
    if (std::abs(*set.grow) > 1)
      diagnostics_.Add(grow->where(), "'size' of event is " + grow->AsText(),
                       "by how much each length is greater, in m");
  }
  reader.Finish();
  if (value.is_object() && !set.mass && !set.friction && !set.grow)
    diagnostics_.Add(value.where(), "'set' of event sets nothing", "'mass', 'friction' or 'size'");
  event.other = set;
}

void EventReader::ReadFault(const Value& value, Event& event) {
  event.other = FaultParser(names_, diagnostics_).Parse(value);
}

void EventReader::ReadGoal(const Value& value, Event& event) {
  NewGoal goal;
  const Value* pddl = nullptr;
  const Value* ltl = nullptr;
  std::string semantics = "cosafe";
  if (value.is_object()) {
    ObjectReader reader(value, "'goal' of event", diagnostics_);
    pddl = reader.Optional("pddl");
    ltl = reader.Optional("ltl");
    if (const Value* word = reader.Optional("semantics"))
      semantics = ReadText(*word, "'semantics' of event", diagnostics_);
    reader.Finish();
    if ((pddl == nullptr) == (ltl == nullptr)) {
      diagnostics_.Add(value.where(), "'goal' of event needs one formula", "pddl: (…) or ltl: …");
      return;
    }
  } else {
    (value.is_scalar() && value.AsText().starts_with("(") ? pddl : ltl) = &value;
  }
  const Value& formula = pddl != nullptr ? *pddl : *ltl;
  const std::string text = ReadText(formula, "'goal' of event", diagnostics_);
  try {
    if (pddl != nullptr) {
      goal.pddl = text;
      if (names_.problem != nullptr) symbolic::WithGoal(*names_.problem, text, formula.where());
    } else {
      const ltl::Semantics how = ltl::ReadSemantics(semantics);
      goal.temporal = task::TemporalGoal{ltl::ReadEnds(ltl::ParseFormula(text, formula.where()), how), how,
                                         formula.where()};
      ltl::RequireSemantics(goal.temporal->formula, how, formula.where());
    }
  } catch (const InputError& error) {
    diagnostics_.Add(error);
  }
  event.other = std::move(goal);
}

}  // namespace tether::scenario
