#include "tether/scenario/events/fault_reader.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "tether/common/document/reader.h"
#include "tether/scenario/scenario_reading.h"

namespace tether::scenario {
namespace {

using Kind = robot::Fault::Kind;

const std::vector<std::pair<std::string, Kind>>& Kinds() {
  static const std::vector<std::pair<std::string, Kind>> kinds = {{"silence", Kind::kSilence},
                                                                  {"not_finite", Kind::kNotFinite},
                                                                  {"clock", Kind::kClock},
                                                                  {"encoder", Kind::kEncoder},
                                                                  {"gripper", Kind::kGripper}};
  return kinds;
}

const std::string& NameOf(Kind kind) {
  const auto found =
      std::find_if(Kinds().begin(), Kinds().end(), [&](const auto& one) { return one.second == kind; });
  return found->first;
}

// Whose fault it may be.
struct Whose {
  bool robot = true, object = false, poses = false;
  const char* accepted = "'robot': the robot whose sensors they are";
};

Whose WhoseCanBe(Kind kind) {
  switch (kind) {
    case Kind::kSilence:
      return {true, true, true, "one of 'robot', 'object' and 'poses: true'"};
    case Kind::kNotFinite:
      return {true, true, false, "one of 'robot' and 'object'"};
    case Kind::kClock:
      return {true, false, true, "one of 'robot' and 'poses: true'"};
    case Kind::kEncoder:
    case Kind::kGripper:
      return {true, false, false, "'robot'"};
  }
  return {};
}

}  // namespace

robot::Fault FaultParser::Parse(const Value& value) {
  robot::Fault fault;
  ObjectReader reader(value, "'fault' of event", diagnostics_);
  if (value.is_object() && value.Find("kind") == nullptr)
    reader.Required("kind", "silence, not_finite, clock, encoder or gripper");
  fault.kind = ReadChoice<Kind>(reader, "kind", Kinds(), fault.kind);
  const Value* robot = reader.Optional("robot");
  const Value* object = reader.Optional("object");
  const bool poses = reader.Bool("poses", false);
  const Whose whose = WhoseCanBe(fault.kind);
  const int given = (robot != nullptr) + (object != nullptr) + poses;
  if (value.is_object() &&
      (given != 1 || (robot && !whose.robot) || (object && !whose.object) || (poses && !whose.poses))) {
    diagnostics_.Add(value.where(),
                     "'fault' of event, of kind '" + NameOf(fault.kind) + "', needs to say of what",
                     whose.accepted);
  }
  if (robot != nullptr) ReadRobot(*robot, fault);
  if (object != nullptr) ReadObject(*object, fault);
  const bool clock = fault.kind == Kind::kClock, encoder = fault.kind == Kind::kEncoder;
  if (clock || encoder) {
    const std::string accepted = clock ? "a time in s, not zero" : "an angle in rad, not zero";
    if (const Value* by = reader.Required("by", accepted)) {
      fault.by = ReadNumber(*by, "'by' of event", diagnostics_);
      if (fault.by == 0) diagnostics_.Add(by->where(), "'by' of event is 0", accepted);
    }
  }
  if (encoder) {
    if (const Value* joint = reader.Required("joint", "the number of a joint, counted from 1"))
      fault.joint = ReadJoint(*joint, fault);
  }
  if (const Value* over = reader.Optional("over"))
    fault.over = ReadPositive(*over, "'over' of event", diagnostics_);
  reader.Finish();
  return fault;
}

void FaultParser::ReadRobot(const Value& value, robot::Fault& fault) {
  fault.robot = ReadText(value, "'robot' of event", diagnostics_);
  if (names_.scene == nullptr || names_.scene->FindRobot(fault.robot) != nullptr) return;
  std::vector<std::string> known;
  for (const scene::Robot& one : names_.scene->robots) known.push_back(one.name);
  diagnostics_.Add(value.where(), "unknown robot '" + fault.robot + "' in event",
                   SuggestFrom(fault.robot, known));
}

void FaultParser::ReadObject(const Value& value, robot::Fault& fault) {
  fault.object = ReadText(value, "'object' of event", diagnostics_);
  if (names_.scene == nullptr || names_.scene->FindObject(fault.object) != nullptr) return;
  std::vector<std::string> known;
  for (const scene::Object& one : names_.scene->objects) known.push_back(one.name);
  diagnostics_.Add(value.where(), "unknown object '" + fault.object + "' in event",
                   SuggestFrom(fault.object, known));
}

int FaultParser::ReadJoint(const Value& value, const robot::Fault& fault) {
  const scene::Robot* robot = names_.scene == nullptr ? nullptr : names_.scene->FindRobot(fault.robot);
  const double joint = ReadNumber(value, "'joint' of event", diagnostics_);
  const double most = robot == nullptr ? 1000 : static_cast<double>(robot->q.size());
  if (joint >= 1 && joint <= most && joint == std::floor(joint)) return static_cast<int>(joint) - 1;
  diagnostics_.Add(value.where(), "'joint' of event is " + value.AsText(),
                   "a whole number from 1 to " + Value(most).AsText());
  return 0;
}

std::string DescribeFault(const robot::Fault& fault) {
  std::string text = "fault of " + (!fault.robot.empty()    ? fault.robot
                                    : !fault.object.empty() ? "the pose of " + fault.object
                                                            : "the poses of objects");
  text += ": " + NameOf(fault.kind);
  if (fault.kind == Kind::kEncoder) text += " of joint " + std::to_string(fault.joint + 1);
  if (fault.by != 0)
    text += " off by " + Value(fault.by).AsText() + (fault.kind == Kind::kClock ? " s" : " rad");
  return text + (std::isfinite(fault.over) ? " for " + Value(fault.over).AsText() + " s" : "");
}

}  // namespace tether::scenario
