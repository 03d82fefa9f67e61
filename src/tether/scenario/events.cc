#include "tether/scenario/events.h"

#include <algorithm>

#include "tether/common/document/reader.h"
#include "tether/scenario/events/event_reader.h"
#include "tether/scenario/events/fault_reader.h"

namespace tether::scenario {
namespace {

std::string Trim(const std::string& text) {
  const size_t begin = text.find_first_not_of(" \t");
  if (begin == std::string::npos) return "";
  return text.substr(begin, text.find_last_not_of(" \t") - begin + 1);
}

std::string Triple(const Eigen::Vector3d& v) {
  return "(" + Value(v.x()).AsText() + ", " + Value(v.y()).AsText() + ", " + Value(v.z()).AsText() + ")";
}

struct DescribeOther {
  const Event& event;

  std::string operator()(std::monostate) const {
    const std::string where = event.has_goal ? "to " + Triple(event.X_ParentGoal.p) + " in " + event.parent
                                             : "by " + Triple(event.X_by.p) + " m";
    return "move " + event.object + " " + where + " over " + Value(event.over).AsText() + " s" +
           (event.steady ? " at one speed" : "");
  }
  std::string operator()(const Removal&) const { return "remove " + event.object; }
  std::string operator()(const Return&) const { return "add " + event.object; }
  std::string operator()(const Pull& pull) const {
    return "pull " + (event.object.empty() ? "what is held" : event.object) + " by " + Triple(event.X_by.p) +
           " m over " + Value(event.over).AsText() + " s with up to " + Value(pull.force).AsText() + " N";
  }
  std::string operator()(const Knock& knock) const {
    return "knock " + event.object + " with " + Triple(knock.impulse) + " N s";
  }
  std::string operator()(const Alteration& set) const {
    std::string text = "set " + event.object + ":";
    if (set.mass) text += " mass " + Value(*set.mass).AsText() + " kg";
    if (set.friction) text += " friction " + Value(*set.friction).AsText();
    if (set.grow) text += " size " + Value(*set.grow).AsText() + " m more";
    return text;
  }
  std::string operator()(const robot::Fault& fault) const { return DescribeFault(fault); }
  std::string operator()(const NewGoal& goal) const {
    return "the goal is now " + (goal.temporal ? goal.temporal->formula.ToString() : goal.pddl);
  }
};

/// Events at times that can't all be meant. `where`: of each event.
void CheckContradictions(const std::vector<Event>& events, const std::vector<Location>& where,
                         Diagnostics& diagnostics) {
  const auto is = [](const Event& event, auto kind) {
    return std::holds_alternative<decltype(kind)>(event.other);
  };
  for (size_t i = 0; i < events.size(); ++i) {
    const Event& event = events[i];
    const auto any = [&](const auto& test) { return std::any_of(events.begin(), events.end(), test); };
    if (is(event, Return{}) &&
        !any([&](const Event& other) { return is(other, Removal{}) && other.object == event.object; })) {
      diagnostics.Add(where[i], "event adds '" + event.object + "', which no event removes",
                      "a 'remove' of it before");
    }
    for (size_t k = 0; k < i; ++k) {
      const Event& other = events[k];
      const bool same = !is(event, robot::Fault{}) && !is(other, robot::Fault{}) &&
                        event.object == other.object && event.robot == other.robot &&
                        is(event, NewGoal{}) == is(other, NewGoal{});
      if (!same || is(event, Alteration{}) != is(other, Alteration{}) || event.starts != other.starts ||
          event.ends != other.ends || event.step != other.step || event.after != other.after ||
          event.time != other.time || event.until != other.until)
        continue;
      diagnostics.Add(where[i],
                      "'" + event.Describe() + "' contradicts '" + other.Describe() + "' of the same moment",
                      "other moments or other objects");
    }
  }
}

}  // namespace

std::string Event::Describe() const {
  if (!robot.empty()) {
    std::string text;
    for (const double torque : torques) text += (text.empty() ? "(" : ", ") + Value(torque).AsText();
    return "push " + robot + " by " + text + ") Nm over " + Value(over).AsText() + " s";
  }
  return std::visit(DescribeOther{*this}, other);
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
  EventReader reader(names, diagnostics);
  std::vector<Location> where;
  for (const Value& item : list->items()) {
    events.push_back(reader.Read(item));
    where.push_back(item.where());
  }
  CheckContradictions(events, where, diagnostics);
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
