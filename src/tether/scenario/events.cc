#include "tether/scenario/events.h"

#include <algorithm>

#include "tether/common/document/reader.h"
#include "tether/scenario/fault_reader.h"
#include "tether/scenario/scene_reader.h"

namespace tether::scenario {
namespace {

std::string Trim(const std::string& text) {
  const size_t begin = text.find_first_not_of(" \t");
  if (begin == std::string::npos) return "";
  return text.substr(begin, text.find_last_not_of(" \t") - begin + 1);
}

std::string JoinAction(const std::vector<std::string>& words) {
  std::string text = words[0] + "(";
  for (size_t i = 1; i < words.size(); ++i) text += (i > 1 ? "," : "") + words[i];
  return text + ")";
}

class EventParser {
 public:
  EventParser(const EventNames& names, Diagnostics& diagnostics) : names_(names), diagnostics_(diagnostics) {}

  Event Parse(const Value& value) {
    Event event;
    ObjectReader reader(value, "event", diagnostics_);
    if (const Value* when = reader.Required("when", "{starts: pick(box)} or {time: 2.0}"))
      ReadWhen(*when, event);
    const Value* push = reader.Optional("push");
    const Value* fault = reader.Optional("fault");
    if (push != nullptr || fault != nullptr) {
      if (push != nullptr) ReadPush(*push, event);
      if (fault != nullptr) event.fault = FaultParser(names_, diagnostics_).Parse(*fault);
      if (push != nullptr && fault != nullptr)
        diagnostics_.Add(fault->where(), "event has both 'push' and 'fault'", "one of them");
      if (const Value* move = reader.Optional("move"))
        diagnostics_.Add(move->where(),
                         std::string("event has both '") + (push ? "push" : "fault") + "' and 'move'",
                         "one of them");
    } else if (const Value* move = reader.Required("move", "{object: box, by: [0, 0.1, 0], over: 1.0}")) {
      ReadMove(*move, event);
    }
    reader.Finish();
    return event;
  }

 private:
  void ReadWhen(const Value& value, Event& event) {
    const Value when = JoinSplitAction(value);
    ObjectReader reader(when, "'when' of event", diagnostics_);
    const Value* starts = reader.Optional("starts");
    const Value* time = reader.Optional("time");
    if (when.is_object() && (starts == nullptr) == (time == nullptr)) {
      diagnostics_.Add(when.where(), "'when' of event needs one moment",
                       "{starts: pick(box)} or {time: 2.0}");
    } else if (starts != nullptr) {
      ReadStarts(*starts, event);
    } else if (time != nullptr) {
      event.time = ReadNumber(*time, "'time' of event", diagnostics_);
      if (event.time < 0) diagnostics_.Add(time->where(), "'time' of event is negative", "a time in s");
    }
    reader.Finish();
  }

  /// YAML splits {starts: place(box,shelf)} at the comma, into 'starts: place(box' and a key 'shelf)' without
  /// a value. The meaning is clear, so the two are joined again.
  static Value JoinSplitAction(const Value& value) {
    const Value* starts = value.Find("starts");
    if (starts == nullptr || !starts->is_scalar()) return value;
    std::string text = starts->AsText();
    if (text.find('(') == std::string::npos) return value;
    Value joined = Value::Object();
    joined.set_where(value.where());
    for (const Value::Member& member : value.members()) {
      if (text.ends_with(")") || !member.value.is_null()) {
        joined.Set(member.key, member.value, member.where);
      } else {
        text += "," + member.key;
      }
    }
    Value whole(text);
    whole.set_where(starts->where());
    return joined.Set("starts", whole);
  }

  void ReadStarts(const Value& value, Event& event) {
    const std::string text = ReadText(value, "'starts' of event", diagnostics_);
    const std::vector<std::string> words = SplitAction(text);
    if (words.empty()) {
      diagnostics_.Add(value.where(), "'starts' of event is '" + text + "'", "an action such as pick(box)");
      return;
    }
    event.starts = JoinAction(words);
    if (names_.actions == nullptr) return;
    std::vector<std::string> known;
    const planning::ActionSchema* action = nullptr;
    for (const planning::ActionSchema& schema : *names_.actions) {
      known.push_back(schema.name);
      if (schema.name == words[0]) action = &schema;
    }
    if (action == nullptr) {
      diagnostics_.Add(value.where(), "unknown action '" + words[0] + "' in event",
                       SuggestFrom(words[0], known));
    } else if (action->parameters.size() + 1 != words.size()) {
      diagnostics_.Add(
          value.where(),
          "action '" + text + "' in event has " + std::to_string(words.size() - 1) + " arguments",
          "it takes " + std::to_string(action->parameters.size()));
    }
    for (size_t i = 1; i < words.size(); ++i) CheckFrame(words[i], value.where());
  }

  void ReadPush(const Value& value, Event& event) {
    ObjectReader reader(value, "'push' of event", diagnostics_);
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
      const size_t size = joints > 0 ? static_cast<size_t>(joints) : torques->items().size();
      if (const auto read = ReadVector(*torques, static_cast<int>(size), "'torques' of event", diagnostics_))
        event.torques = *read;
    }
    if (const Value* over = reader.Required("over", "a duration in s"))
      event.over = ReadPositive(*over, "'over' of event", diagnostics_);
    reader.Finish();
  }

  void ReadMove(const Value& value, Event& event) {
    ObjectReader reader(value, "'move' of event", diagnostics_);
    if (const Value* object = reader.Required("object", "the object to be moved")) {
      event.object = ReadText(*object, "'object' of event", diagnostics_);
      CheckObject(event.object, object->where());
    }
    const Value* by = reader.Optional("by");
    const Value* yaw = reader.Optional("yaw");
    const Value* to = reader.Optional("to");
    if (value.is_object() && (to != nullptr) == (by != nullptr || yaw != nullptr)) {
      diagnostics_.Add(value.where(), "'move' of event needs one destination",
                       "by: [x, y, z] in m in the world (and yaw: in rad), or to: a pose");
    }
    if (by != nullptr) {
      event.X_by.p = ReadVector(*by, 3, "'by' of event", diagnostics_).value_or(Eigen::VectorXd::Zero(3));
    }
    if (yaw != nullptr) {
      const double angle = ReadNumber(*yaw, "'yaw' of event", diagnostics_);
      event.X_by.R = math::RotationFromRpy({0, 0, angle});
    }
    if (to != nullptr) {
      const PoseSpec pose = ReadPose(*to, "event", true, diagnostics_);
      event.has_goal = true;
      event.parent = pose.parent;
      event.X_ParentGoal = pose.X_ParentFrame;
      if (pose.parent != scene::kWorld) CheckFrame(pose.parent, pose.parent_where);
    }
    if (const Value* over = reader.Required("over", "a duration in s: objects move at finite speed")) {
      event.over = ReadPositive(*over, "'over' of event", diagnostics_);
    }
    event.steady = reader.Bool("steady", false);
    reader.Finish();
  }

  void CheckObject(const std::string& name, const Location& where) {
    if (names_.scene == nullptr || name.empty() || names_.scene->FindObject(name) != nullptr) return;
    std::vector<std::string> known;
    for (const scene::Object& object : names_.scene->objects) known.push_back(object.name);
    diagnostics_.Add(where, "unknown object '" + name + "' in event", SuggestFrom(name, known));
  }

  void CheckFrame(const std::string& name, const Location& where) {
    if (names_.scene == nullptr) return;
    const std::vector<std::string> known = FrameNames(*names_.scene);
    if (std::find(known.begin(), known.end(), name) != known.end()) return;
    diagnostics_.Add(where, "unknown name '" + name + "' in event", SuggestFrom(name, known));
  }

  const EventNames& names_;
  Diagnostics& diagnostics_;
};

}  // namespace

std::string Event::Describe() const {
  if (fault) return DescribeFault(*fault);
  if (!robot.empty()) {
    std::string text;
    for (const double torque : torques) text += (text.empty() ? "(" : ", ") + Value(torque).AsText();
    return "push " + robot + " by " + text + ") Nm over " + Value(over).AsText() + " s";
  }
  const auto triple = [](const Eigen::Vector3d& v) {
    return "(" + Value(v.x()).AsText() + ", " + Value(v.y()).AsText() + ", " + Value(v.z()).AsText() + ")";
  };
  const std::string where =
      has_goal ? "to " + triple(X_ParentGoal.p) + " in " + parent : "by " + triple(X_by.p) + " m";
  return "move " + object + " " + where + " over " + Value(over).AsText() + " s" +
         (steady ? " at one speed" : "");
}

std::vector<std::string> SplitAction(const std::string& text) {
  const size_t open = text.find('(');
  const std::string trimmed = Trim(text);
  if (open == std::string::npos || !trimmed.ends_with(")")) return {};
  std::vector<std::string> words = {Trim(text.substr(0, open))};
  std::string rest = text.substr(open + 1, text.rfind(')') - open - 1);
  if (words[0].empty() || rest.find_first_of("()") != std::string::npos) return {};
  if (Trim(rest).empty()) return words;
  rest += ",";
  for (size_t begin = 0, comma = 0; (comma = rest.find(',', begin)) != std::string::npos; begin = comma + 1) {
    words.push_back(Trim(rest.substr(begin, comma - begin)));
    if (words.back().empty()) return {};
  }
  return words;
}

std::vector<Event> ParseEvents(const Value& value, const EventNames& names, Diagnostics& diagnostics) {
  std::vector<Event> events;
  const Value* list = &value;
  if (value.is_object()) {
    ObjectReader reader(value, "event file", diagnostics);
    const Value* format = reader.Optional("format");
    if (format != nullptr && format->AsText() != "tether.events/1") {
      diagnostics.Add(format->where(), "format is '" + format->AsText() + "'", "accepted: tether.events/1");
      return events;
    }
    list = reader.Required("events", "a list of events");
    reader.Finish();
  }
  if (list == nullptr || list->is_null()) return events;
  if (!list->is_array()) {
    diagnostics.Add(list->where(), "'events' is " + list->KindName(),
                    "a list of events, or the name of a file");
    return events;
  }
  EventParser parser(names, diagnostics);
  for (const Value& item : list->items()) events.push_back(parser.Parse(item));
  return events;
}

std::vector<Event> ReadEvents(const std::string& path, const EventNames& names) {
  const Value document = ReadYaml(path);
  Diagnostics diagnostics;
  if (document.is_null())
    diagnostics.Add(document.where(), "there is nothing in this file", "a list of events");
  std::vector<Event> events = ParseEvents(document, names, diagnostics);
  diagnostics.ThrowIfAny();
  return events;
}

}  // namespace tether::scenario
