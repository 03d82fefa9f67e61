#include "tether/scenario/events/event_reader.h"

#include <algorithm>
#include <utility>

#include "tether/scenario/scene_reader.h"

namespace tether::scenario {
namespace {

constexpr const char* kMoments =
    "{starts: pick(box)}, {ends: pick(box)}, {step: 2}, {time: 2.0} or {random: [0, 10]}";

std::string JoinAction(const std::vector<std::string>& words) {
  std::string text = words[0] + "(";
  for (size_t i = 1; i < words.size(); ++i) text += (i > 1 ? "," : "") + words[i];
  return text + ")";
}

/// YAML splits {starts: place(box,shelf)} at the comma, into 'starts: place(box' and a key 'shelf)' without
/// a value. The meaning is clear, so the two are joined again.
Value JoinSplitAction(const Value& value, const std::string& key) {
  const Value* action = value.Find(key);
  if (action == nullptr || !action->is_scalar()) return value;
  std::string text = action->AsText();
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
  whole.set_where(action->where());
  return joined.Set(key, whole);
}

}  // namespace

Event EventReader::Read(const Value& value) {
  Event event;
  ObjectReader reader(value, "event", diagnostics_);
  if (const Value* when = reader.Required("when", kMoments)) ReadWhen(*when, event);
  const std::pair<const char*, void (EventReader::*)(const Value&, Event&)> kinds[] = {
      {"move", &EventReader::ReadMove},      {"rotate", &EventReader::ReadRotate},
      {"push", &EventReader::ReadPush},      {"push_arm", &EventReader::ReadPush},
      {"remove", &EventReader::ReadRemoval}, {"add", &EventReader::ReadReturn},
      {"pull", &EventReader::ReadPull},      {"knock", &EventReader::ReadKnock},
      {"set", &EventReader::ReadAlteration}, {"goal", &EventReader::ReadGoal},
      {"fault", &EventReader::ReadFault}};
  const char* first = nullptr;
  for (const auto& [key, read] : kinds) {
    const Value* what = reader.Optional(key);
    if (what == nullptr) continue;
    if (first != nullptr) {
      diagnostics_.Add(what->where(), std::string("event has both '") + first + "' and '" + key + "'",
                       "one of them");
      continue;
    }
    first = key;
    (this->*read)(*what, event);
  }
  if (first == nullptr && value.is_object())
    reader.Required("move", "{object: box, by: [0, 0.1, 0], over: 1.0}; or another of the disturbances");
  reader.Finish();
  return event;
}

void EventReader::ReadWhen(const Value& value, Event& event) {
  const Value when = JoinSplitAction(JoinSplitAction(value, "starts"), "ends");
  ObjectReader reader(when, "'when' of event", diagnostics_);
  const Value* starts = reader.Optional("starts");
  const Value* ends = reader.Optional("ends");
  const Value* step = reader.Optional("step");
  const Value* time = reader.Optional("time");
  const Value* random = reader.Optional("random");
  const Value* after = reader.Optional("after");
  const Value* const all[] = {starts, ends, step, time, random};
  if (when.is_object() && std::count(std::begin(all), std::end(all), nullptr) != 4) {
    diagnostics_.Add(when.where(), "'when' of event needs one moment", kMoments);
    reader.Finish();
    return;
  }
  if (starts != nullptr) event.starts = ReadAction(*starts, "'starts' of event");
  if (ends != nullptr) event.ends = ReadAction(*ends, "'ends' of event");
  if (step != nullptr) {
    const double number = ReadNumber(*step, "'step' of event", diagnostics_);
    if (number < 0 || number > 1e6 || number != static_cast<int>(number))
      diagnostics_.Add(step->where(), "'step' of event is " + step->AsText(),
                       "the number of a step of the plan, from 0");
    else
      event.step = static_cast<int>(number);
  }
  if (time != nullptr) {
    event.time = ReadNumber(*time, "'time' of event", diagnostics_);
    if (event.time < 0) diagnostics_.Add(time->where(), "'time' of event is negative", "a time in s");
  }
  if (random != nullptr) ReadRandom(*random, event);
  if (after != nullptr) {
    event.after = ReadNumber(*after, "'after' of event", diagnostics_);
    if (event.after < 0) diagnostics_.Add(after->where(), "'after' of event is negative", "a time in s");
    if (time != nullptr || random != nullptr)
      diagnostics_.Add(after->where(), "'after' beside a time", "'after' beside starts, ends or step");
  }
  reader.Finish();
}

void EventReader::ReadRandom(const Value& value, Event& event) {
  const auto range = ReadVector(value, 2, "'random' of event", diagnostics_);
  if (!range) return;
  event.time = (*range)[0];
  event.until = (*range)[1];
  if (event.time < 0 || event.until <= event.time)
    diagnostics_.Add(value.where(), "'random' of event is no range of time", "[from, to] in s, from 0");
}

std::string EventReader::ReadAction(const Value& value, const std::string& what) {
  const std::string text = ReadText(value, what, diagnostics_);
  const std::vector<std::string> words = SplitAction(text);
  if (words.empty()) {
    diagnostics_.Add(value.where(), what + " is '" + text + "'", "an action such as pick(box)");
    return "";
  }
  if (names_.actions == nullptr) return JoinAction(words);
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
    diagnostics_.Add(value.where(),
                     "action '" + text + "' in event has " + std::to_string(words.size() - 1) + " arguments",
                     "it takes " + std::to_string(action->parameters.size()));
  }
  for (size_t i = 1; i < words.size(); ++i) CheckFrame(words[i], value.where());
  return JoinAction(words);
}

void EventReader::CheckFrame(const std::string& name, const Location& where) {
  if (names_.scene == nullptr) return;
  const std::vector<std::string> known = FrameNames(*names_.scene);
  if (std::find(known.begin(), known.end(), name) != known.end()) return;
  diagnostics_.Add(where, "unknown name '" + name + "' in event", SuggestFrom(name, known));
}

}  // namespace tether::scenario
