#include "tether/planning/skeleton/action_reader.h"

#include <algorithm>
#include <array>
#include <map>

#include "tether/common/bounds.h"
#include "tether/common/document/reader.h"

namespace tether::planning {
namespace {

constexpr std::array<const char*, 4> kInNames = {"control", "target", "hand", "world"};

bool Contains(const std::vector<std::string>& words, const std::string& word) {
  return std::find(words.begin(), words.end(), word) != words.end();
}

In ReadIn(ObjectReader& reader, In fallback) {
  const Value* value = reader.Optional("in");
  if (value == nullptr) return fallback;
  const std::string text = ReadText(*value, "'in' of " + reader.what(), reader.diagnostics());
  for (size_t i = 0; i < kInNames.size(); ++i) {
    if (text == kInNames[i]) return static_cast<In>(i);
  }
  reader.diagnostics().Add(value->where(), "'in' of " + reader.what() + " is '" + text + "'",
                           SuggestFrom(text, {kInNames.begin(), kInNames.end()}));
  return fallback;
}

double ReadPositiveMember(ObjectReader& reader, std::string_view key, double fallback) {
  const Value* value = reader.Optional(key);
  if (value == nullptr) return fallback;
  return ReadPositive(*value, "'" + std::string(key) + "' of " + reader.what(), reader.diagnostics(),
                      fallback);
}

ReachVerb ParseReach(const Value& value, Diagnostics& diagnostics) {
  ReachVerb verb;
  if (value.is_null()) return verb;
  ObjectReader reader(value, "verb 'reach'", diagnostics);
  verb.offset = reader.Vector("offset", Eigen::VectorXd(verb.offset));
  verb.in = ReadIn(reader, verb.in);
  verb.speed = ReadPositiveMember(reader, "speed", verb.speed);
  if (const Value* tolerance = reader.Optional("tolerance")) {
    const auto pair = ReadVector(*tolerance, 2, "'tolerance' of verb 'reach' (m, rad)", diagnostics);
    if (pair && (pair->array() <= 0).any()) {
      diagnostics.Add(tolerance->where(), "'tolerance' of verb 'reach' has an entry that is not above zero",
                      "a position tolerance in m and a rotation tolerance in rad");
    } else if (pair) {
      verb.position_tolerance = (*pair)[0];
      verb.rotation_tolerance = (*pair)[1];
    }
  }
  if (const Value* until = reader.Optional("until")) {
    const std::string text = ReadText(*until, "'until' of verb 'reach'", diagnostics);
    verb.until_contact = text == "contact";
    if (!verb.until_contact) {
      diagnostics.Add(until->where(), "'until' of verb 'reach' is '" + text + "'", "accepted: contact");
    }
  }
  verb.above = reader.Number("above", verb.above);
  if (verb.above < 0 || verb.above > kGreatestLength) {
    diagnostics.Add(
        value.Find("above")->where(),
        "'above' of verb 'reach' is " + (verb.above < 0 ? "negative" : value.Find("above")->AsText() + " m"),
        verb.above < 0 ? "a height in m, zero or more" : "a height of at most 10000 m");
    verb.above = 0;
  }
  verb.objective = reader.Text("objective", "");
  if (const Value* constraints = reader.Optional("constraints")) {
    ParseConstraints(*constraints, "'constraints' of verb 'reach'", {}, diagnostics);
    verb.constraints = *constraints;
  }
  reader.Finish();
  return verb;
}

ShiftVerb ParseShift(const Value& value, Diagnostics& diagnostics) {
  ShiftVerb verb;
  ObjectReader reader(value, "verb 'shift'", diagnostics);
  if (const Value* by = reader.Required("by", "a displacement, a list of 3 numbers in m")) {
    verb.by = ReadVector(*by, 3, "'by' of verb 'shift'", diagnostics).value_or(Eigen::VectorXd(verb.by));
  }
  verb.in = ReadIn(reader, verb.in);
  verb.speed = ReadPositiveMember(reader, "speed", verb.speed);
  reader.Finish();
  return verb;
}

GripperVerb ParseGripper(const Value& value, Diagnostics& diagnostics) {
  GripperVerb verb;
  ObjectReader reader(value, "verb 'gripper'", diagnostics);
  const Value* open = reader.Optional("open");
  verb.close_on = reader.Text("close_on", "");
  verb.force = ReadPositiveMember(reader, "force", verb.force);
  reader.Finish();
  if (!value.is_object()) return verb;
  const bool opens = open != nullptr && ReadBool(*open, "'open' of verb 'gripper'", diagnostics, true);
  if (opens == !verb.close_on.empty()) {
    diagnostics.Add(value.where(), "verb 'gripper' must either open or close",
                    "{open: true} or {close_on: object, force: N}");
  }
  return verb;
}

WaitVerb ParseWait(const Value& value, Diagnostics& diagnostics) {
  double seconds = 0;
  std::string region;
  if (value.is_object()) {
    ObjectReader reader(value, "verb 'wait'", diagnostics);
    region = reader.Text("region", "");
    if (!region.empty()) {
      reader.Optional("seconds");
    } else if (const Value* member = reader.Required("seconds", "a time in s")) {
      seconds = ReadNumber(*member, "'seconds' of verb 'wait'", diagnostics);
    }
    reader.Finish();
  } else {
    seconds = ReadNumber(value, "verb 'wait'", diagnostics);
  }
  if (seconds < 0)
    diagnostics.Add(value.where(), "verb 'wait' has a negative time", "a time in s, zero or more");
  return {std::max(0.0, seconds), region};
}

/// Reads the actions of one document, with the names that they may use.
class ActionParser {
 public:
  ActionParser(const ActionReadOptions& options, Diagnostics& diagnostics)
      : options_(options), diagnostics_(diagnostics) {}

  ActionSchema Parse(const std::string& name, const Location& where, const Value& value) {
    ActionSchema schema;
    schema.name = name;
    schema.where = where;
    what_ = "action '" + name + "'";
    ObjectReader reader(value, what_, diagnostics_);
    schema.parameters = reader.TextList("parameters");
    if (const Value* parameters = value.Find("parameters")) {
      if (parameters->is_array()) CheckParameters(schema.parameters, *parameters);
    } else if (value.is_object()) {
      diagnostics_.Add(where, what_ + " lacks 'parameters'",
                       "a list of names, bound by position to the PDDL action's");
    }
    parameters_ = schema.parameters;
    if (const Value* steps = reader.Required("steps", "a list of key-pose steps")) {
      if (!steps->is_array() || steps->items().empty()) {
        diagnostics_.Add(steps->where(),
                         "'steps' of " + what_ + " is " + (steps->is_array() ? "empty" : steps->KindName()),
                         "a list of at least one key-pose step");
      }
      for (const Value& step : steps->items()) schema.steps.push_back(ParseStep(step));
    }
    reader.Finish();
    return schema;
  }

 private:
  void CheckParameters(const std::vector<std::string>& parameters, const Value& list) {
    for (size_t i = 0; i < parameters.size(); ++i) {
      const Location where = list.items()[i].where();
      if (parameters[i] == "hand" || parameters[i] == "world") {
        diagnostics_.Add(where, "parameter '" + parameters[i] + "' of " + what_ + " has a reserved name",
                         "any name but hand and world");
      }
      if (std::find(parameters.begin(), parameters.begin() + static_cast<std::ptrdiff_t>(i), parameters[i]) !=
          parameters.begin() + static_cast<std::ptrdiff_t>(i)) {
        diagnostics_.Add(where, "parameter '" + parameters[i] + "' of " + what_ + " is given twice",
                         "each once");
      }
    }
  }

  std::string ReadName(const Value& value, const std::string& role) {
    const std::string name = ReadText(value, role + " of " + what_, diagnostics_);
    CheckName(name, value.where(), role);
    return name;
  }

  void CheckName(const std::string& name, const Location& where, const std::string& role) {
    if (name.empty() || !options_.frames) return;
    std::vector<std::string> words = parameters_;
    words.insert(words.end(), {"hand", "world"});
    for (const std::string& frame : *options_.frames) {
      if (!Contains(words, frame)) words.push_back(frame);
    }
    if (Contains(words, name)) return;
    diagnostics_.Add(where, "unknown name '" + name + "' as " + role + " of " + what_,
                     SuggestFrom(name, words));
  }

  StepSchema ParseStep(const Value& value) {
    StepSchema step;
    step.where = value.where();
    ObjectReader reader(value, "step of " + what_, diagnostics_);
    if (const Value* control =
            reader.Required("control", "the frame to be controlled: a parameter or hand")) {
      step.control = ReadName(*control, "control");
    }
    if (const Value* target = reader.Required("target", "a frame, or {region: name}")) {
      step.target_is_region = target->is_object();
      if (step.target_is_region) {
        ObjectReader region(*target, "target of " + what_, diagnostics_);
        if (const Value* name = region.Required("region", "a region"))
          step.target = ReadName(*name, "target region");
        region.Finish();
      } else {
        step.target = ReadName(*target, "target");
      }
    }
    if (const Value* constraints = reader.Optional("constraints")) {
      step.constraints = ParseConstraints(*constraints, "'constraints' of " + what_,
                                          options_.constraint_kinds, diagnostics_);
    }
    if (const Value* allow = reader.Optional("allow")) ParseAllow(*allow, step);
    if (const Value* execute = reader.Optional("execute")) ParseExecute(*execute, step);
    if (const Value* force = reader.Optional("max_force"))
      step.max_force = ReadPositive(*force, "'max_force' of " + what_ + " (N)", diagnostics_);
    reader.Finish();
    return step;
  }

  void ParseAllow(const Value& allow, StepSchema& step) {
    const std::string accepted = "a list of pairs of names, such as [[hand, a]]";
    if (!allow.is_array()) {
      diagnostics_.Add(allow.where(), "'allow' of " + what_ + " is " + allow.KindName(), accepted);
      return;
    }
    for (const Value& pair : allow.items()) {
      if (!pair.is_array() || pair.items().size() != 2) {
        diagnostics_.Add(pair.where(), "an entry of 'allow' of " + what_ + " is not a pair", accepted);
        continue;
      }
      step.allow.emplace_back(ReadName(pair.items()[0], "an allowed contact"),
                              ReadName(pair.items()[1], "an allowed contact"));
    }
  }

  void ParseExecute(const Value& execute, StepSchema& step) {
    if (!execute.is_array()) {
      diagnostics_.Add(execute.where(), "'execute' of " + what_ + " is " + execute.KindName(),
                       "a list of verbs");
      return;
    }
    for (const Value& item : execute.items()) {
      std::optional<Verb> verb = ParseVerb(item, diagnostics_);
      if (!verb) continue;
      if (const auto* gripper = std::get_if<GripperVerb>(&*verb); gripper && !gripper->close_on.empty()) {
        CheckName(gripper->close_on, item.members()[0].value.Find("close_on")->where(), "close_on");
      }
      if (const auto* wait = std::get_if<WaitVerb>(&*verb); wait && !wait->region.empty()) {
        CheckName(wait->region, item.members()[0].value.Find("region")->where(), "region");
      }
      step.execute.push_back(std::move(*verb));
    }
  }

  const ActionReadOptions& options_;
  Diagnostics& diagnostics_;
  std::string what_;
  std::vector<std::string> parameters_;
};

std::string Replace(const std::map<std::string, std::string>& binding, const std::string& name) {
  const auto found = binding.find(name);
  return found == binding.end() ? name : found->second;
}

Value Replace(const std::map<std::string, std::string>& binding, const Value& value) {
  Value result = value;
  if (value.is_object()) {
    result = Value::Object();
    for (const Value::Member& member : value.members()) {
      result.Set(member.key, Replace(binding, member.value), member.where);
    }
  } else if (value.is_array()) {
    result = Value::Array();
    for (const Value& item : value.items()) result.Append(Replace(binding, item));
  } else if (value.is_scalar() && binding.contains(value.AsText())) {
    result = Value(binding.at(value.AsText()));
  }
  result.set_where(value.where());
  return result;
}

}  // namespace

std::optional<Verb> ParseVerb(const Value& value, Diagnostics& diagnostics) {
  const std::vector<std::string> verbs = {"reach", "shift", "gripper", "wait"};
  const bool bare = value.kind() == Value::Kind::kString;
  if (!bare && (!value.is_object() || value.members().size() != 1)) {
    diagnostics.Add(value.where(), "a verb is " + value.KindName(),
                    "a map with one key: " + JoinAlternatives(verbs));
    return std::nullopt;
  }
  const Value nothing;
  const std::string name = bare ? value.AsText() : value.members()[0].key;
  const Value& arguments = bare ? nothing : value.members()[0].value;
  if (name == "reach") return ParseReach(arguments, diagnostics);
  if (name == "shift") return ParseShift(arguments, diagnostics);
  if (name == "gripper") return ParseGripper(arguments, diagnostics);
  if (name == "wait") return ParseWait(arguments, diagnostics);
  diagnostics.Add(bare ? value.where() : value.members()[0].where, "unknown verb '" + name + "'",
                  SuggestFrom(name, verbs));
  return std::nullopt;
}

Value WriteVerb(const Verb& verb) {
  const auto in_name = [](In in) { return kInNames[static_cast<size_t>(in)]; };
  Value arguments = Value::Object();
  std::string name;
  if (const auto* reach = std::get_if<ReachVerb>(&verb)) {
    name = "reach";
    const Eigen::VectorXd tolerance = Eigen::Vector2d(reach->position_tolerance, reach->rotation_tolerance);
    arguments.Set("offset", Eigen::VectorXd(reach->offset)).Set("in", in_name(reach->in));
    arguments.Set("speed", reach->speed).Set("tolerance", tolerance);
    if (reach->until_contact) arguments.Set("until", "contact");
    if (reach->above != 0) arguments.Set("above", reach->above);
    if (!reach->objective.empty()) arguments.Set("objective", reach->objective);
    if (!reach->constraints.is_null()) arguments.Set("constraints", reach->constraints);
  } else if (const auto* shift = std::get_if<ShiftVerb>(&verb)) {
    name = "shift";
    arguments.Set("by", Eigen::VectorXd(shift->by)).Set("in", in_name(shift->in)).Set("speed", shift->speed);
  } else if (const auto* gripper = std::get_if<GripperVerb>(&verb)) {
    name = "gripper";
    if (gripper->close_on.empty()) arguments.Set("open", true);
    if (!gripper->close_on.empty()) arguments.Set("close_on", gripper->close_on);
    arguments.Set("force", gripper->force);
  } else {
    name = "wait";
    const auto& wait = std::get<WaitVerb>(verb);
    wait.region.empty() ? arguments.Set("seconds", wait.seconds) : arguments.Set("region", wait.region);
  }
  return Value::Object().Set(name, arguments);
}

std::vector<ConstraintSpec> ParseConstraints(const Value& list, const std::string& what,
                                             const std::vector<std::string>& kinds,
                                             Diagnostics& diagnostics) {
  std::vector<ConstraintSpec> specs;
  const std::string accepted = "a list of constraints, each written '- kind: {parameters}'";
  if (!list.is_array()) {
    diagnostics.Add(list.where(), what + " is " + list.KindName(), accepted);
    return specs;
  }
  for (const Value& item : list.items()) {
    if (!item.is_object() || item.members().size() != 1) {
      diagnostics.Add(item.where(),
                      "an entry of " + what + " is " +
                          (item.is_object() ? "a map with " + std::to_string(item.members().size()) + " keys"
                                            : item.KindName()),
                      accepted);
      continue;
    }
    const Value::Member& member = item.members()[0];
    if (!kinds.empty() && !Contains(kinds, member.key)) {
      diagnostics.Add(member.where, "unknown constraint '" + member.key + "' in " + what,
                      SuggestFrom(member.key, kinds));
    }
    if (!member.value.is_object() && !member.value.is_null()) {
      diagnostics.Add(member.value.where(),
                      "parameters of constraint '" + member.key + "' are " + member.value.KindName(),
                      "a map of parameters");
    }
    specs.push_back({member.key, member.value, member.where});
  }
  return specs;
}

std::vector<ActionSchema> ParseActions(const Value& document, const ActionReadOptions& options,
                                       Diagnostics& diagnostics) {
  std::vector<ActionSchema> actions;
  if (!document.is_object()) {
    diagnostics.Add(document.where(), "an action library is " + document.KindName(),
                    std::string("a map with 'format: ") + kActionsFormat + "' and one key per action");
    return actions;
  }
  const Value* format = document.Find("format");
  if (format == nullptr || format->AsText() != kActionsFormat) {
    diagnostics.Add(format ? format->where() : document.where(),
                    format ? "format is '" + format->AsText() + "'" : "this action library lacks 'format'",
                    std::string("accepted: ") + kActionsFormat);
    if (format != nullptr) return actions;  // its keys would only be judged by the wrong rules
  }
  ActionParser parser(options, diagnostics);
  for (const Value::Member& member : document.members()) {
    if (member.key != "format") actions.push_back(parser.Parse(member.key, member.where, member.value));
  }
  return actions;
}

std::vector<ActionSchema> ReadActions(const std::string& path, const ActionReadOptions& options) {
  const Value document = ReadYaml(path);
  Diagnostics diagnostics;
  std::vector<ActionSchema> actions = ParseActions(document, options, diagnostics);
  diagnostics.ThrowIfAny();
  return actions;
}

std::vector<StepSchema> BindAction(const ActionSchema& schema, const std::vector<std::string>& arguments) {
  if (arguments.size() != schema.parameters.size()) {
    throw InputError({{schema.where,
                       "action '" + schema.name + "' has " + std::to_string(schema.parameters.size()) +
                           " parameters, but " + std::to_string(arguments.size()) + " arguments are given",
                       "one argument per parameter"}});
  }
  std::map<std::string, std::string> binding;
  for (size_t i = 0; i < arguments.size(); ++i) binding[schema.parameters[i]] = arguments[i];
  std::vector<StepSchema> steps = schema.steps;
  for (StepSchema& step : steps) {
    step.control = Replace(binding, step.control);
    step.target = Replace(binding, step.target);
    for (ConstraintSpec& constraint : step.constraints)
      constraint.parameters = Replace(binding, constraint.parameters);
    for (auto& [first, second] : step.allow) {
      first = Replace(binding, first);
      second = Replace(binding, second);
    }
    for (Verb& verb : step.execute) {
      if (auto* gripper = std::get_if<GripperVerb>(&verb))
        gripper->close_on = Replace(binding, gripper->close_on);
      if (auto* reach = std::get_if<ReachVerb>(&verb))
        reach->constraints = Replace(binding, reach->constraints);
      if (auto* wait = std::get_if<WaitVerb>(&verb)) wait->region = Replace(binding, wait->region);
    }
  }
  return steps;
}

}  // namespace tether::planning
