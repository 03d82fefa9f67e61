#include "tether/control/constraint_spec.h"

#include <algorithm>
#include <cmath>

#include "tether/common/document/reader.h"

namespace tether::control {
namespace {

using Eigen::Vector3d;

bool Contains(const std::vector<std::string>& words, const std::string& word) {
  return std::find(words.begin(), words.end(), word) != words.end();
}

class SpecReader {
 public:
  SpecReader(const ConstraintNames& names, Diagnostics& diagnostics)
      : names_(names), diagnostics_(diagnostics) {}

  ConstraintSpec Read(const std::string& kind, const Location& where, const Value& value) {
    ConstraintSpec spec;
    spec.kind = kind;
    spec.where = where;
    what_ = "constraint '" + kind + "'";
    ObjectReader reader(value, what_, diagnostics_);
    if (reader.Optional("relax") != nullptr) {
      spec.relax = reader.Integer("relax", 1);
      if (*spec.relax < 1) {
        diagnostics_.Add(value.Find("relax")->where(),
                         "'relax' of " + what_ + " is " + std::to_string(*spec.relax), "1 or more");
        spec.relax = 1;
      }
    }
    if (kind == "clearance") ReadClearance(reader, spec);
    if (kind == "outside") ReadOutside(reader, spec);
    if (kind == "joint_limits") spec.margin = ReadLeast(reader, "margin", 0, "an angle in rad, zero or more");
    if (kind == "tilt") ReadTilt(reader, spec);
    if (kind == "cone") spec.margin = ReadLeast(reader, "margin", 0.003, "a distance in m, zero or more");
    if (kind == "upright") {
      spec.max = ReadAbove(reader, "max");
      spec.per_height = ReadLeast(reader, "per_height", 0, "a number of rad/m, zero or more");
    }
    reader.Finish();
    return spec;
  }

 private:
  void ReadClearance(ObjectReader& reader, ConstraintSpec& spec) {
    std::vector<std::string> of = {"links", "hand", "held"}, to = names_.objects;
    to.emplace_back("objects");
    spec.of = ReadNames(reader, "of", of);
    spec.to = ReadNames(reader, "to", to);
    if (const Value* distance = reader.Required("distance", "a distance in m")) {
      spec.distance = ReadNumber(*distance, "'distance' of " + what_, diagnostics_);
      if (spec.distance < 0) {
        diagnostics_.Add(distance->where(), "'distance' of " + what_ + " is negative",
                         "a distance in m, zero or more");
      }
    }
  }

  void ReadOutside(ObjectReader& reader, ConstraintSpec& spec) {
    spec.frame = ReadFrame(reader);
    spec.cylinder = ReadAbove(reader, "cylinder");
    if (const Value* around = reader.Required("around", "a frame")) {
      spec.around = ReadText(*around, "'around' of " + what_, diagnostics_);
      if (!Contains(names_.frames, spec.around)) {
        diagnostics_.Add(around->where(), what_ + " names '" + spec.around + "', which is not in the scene",
                         SuggestFrom(spec.around, names_.frames));
      }
    }
  }

  void ReadTilt(ObjectReader& reader, ConstraintSpec& spec) {
    spec.frame = ReadFrame(reader);
    if (const Value* axis = reader.Optional("axis")) spec.axis = ReadAxis(*axis, "axis");
    if (const Value* from = reader.Required("from", "a direction in the world: [x, y, z]")) {
      spec.from = ReadAxis(*from, "from");
    }
    spec.max = ReadAbove(reader, "max");
    if (spec.max >= M_PI) {
      diagnostics_.Add(reader.value().Find("max")->where(), "'max' of " + what_ + " allows any direction",
                       "an angle in rad below pi");
    }
  }

  std::vector<std::string> ReadNames(ObjectReader& reader, const char* key,
                                     const std::vector<std::string>& accepted) {
    const Value* list = reader.Required(key, "a list of names");
    if (list == nullptr) return {};
    std::vector<std::string> names;
    if (list->is_scalar()) {
      reader.Text(key, "");
      names = {list->AsText()};
    } else {
      names = reader.TextList(key);
    }
    for (size_t i = 0; i < names.size(); ++i) {
      if (Contains(accepted, names[i])) continue;
      const Location& where = list->is_array() ? list->items()[i].where() : list->where();
      diagnostics_.Add(where, what_ + " names '" + names[i] + "' in '" + key + "'",
                       SuggestFrom(names[i], accepted));
    }
    if (names.empty()) {
      diagnostics_.Add(list->where(), "'" + std::string(key) + "' of " + what_ + " is empty",
                       "at least one of " + JoinAlternatives(accepted));
    }
    return names;
  }

  std::string ReadFrame(ObjectReader& reader) {
    std::vector<std::string> accepted = {"hand", "held"};
    accepted.insert(accepted.end(), names_.movable.begin(), names_.movable.end());
    const Value* frame = reader.Required("frame", JoinAlternatives(accepted));
    if (frame == nullptr) return "hand";
    const std::string name = ReadText(*frame, "'frame' of " + what_, diagnostics_);
    if (Contains(accepted, name)) return name;
    diagnostics_.Add(frame->where(), what_ + " is on the frame '" + name + "', which the arm does not carry",
                     SuggestFrom(name, accepted));
    return "hand";
  }

  Vector3d ReadAxis(const Value& value, const char* key) {
    const std::string what = std::string("'") + key + "' of " + what_;
    if (value.is_scalar()) {
      const std::string text = value.AsText();
      for (int i = 0; i < 3; ++i) {
        const std::string name(1, static_cast<char>('x' + i));
        if (text == name) return Vector3d::Unit(i);
        if (text == "-" + name) return -Vector3d::Unit(i);
      }
      diagnostics_.Add(value.where(), what + " is '" + text + "'", "x, y, z, -x, -y, -z or [x, y, z]");
      return Vector3d::UnitZ();
    }
    const auto read = ReadVector(value, 3, what, diagnostics_);
    if (!read) return Vector3d::UnitZ();
    if (read->norm() > 1e-9) return read->normalized();
    diagnostics_.Add(value.where(), what + " has no direction", "a vector that is not zero");
    return Vector3d::UnitZ();
  }

  double ReadAbove(ObjectReader& reader, const char* key) {
    const Value* value = reader.Required(key, "a finite number above zero");
    return value != nullptr ? ReadPositive(*value, std::string("'") + key + "' of " + what_, diagnostics_)
                            : 1;
  }

  double ReadLeast(ObjectReader& reader, const char* key, double fallback, const std::string& accepted) {
    const double number = reader.Number(key, fallback);
    if (number >= 0) return number;
    diagnostics_.Add(reader.value().Find(key)->where(),
                     std::string("'") + key + "' of " + what_ + " is negative", accepted);
    return fallback;
  }

  const ConstraintNames& names_;
  Diagnostics& diagnostics_;
  std::string what_;
};

std::string Join(const std::vector<std::string>& names) {
  std::string text;
  for (size_t i = 0; i < names.size(); ++i)
    text += (i == 0 ? "" : i + 1 < names.size() ? ", " : " and ") + names[i];
  return text;
}

}  // namespace

std::vector<std::string> ConstraintSpecKinds(ConstraintPlace place) {
  if (place == ConstraintPlace::kScenario) return {"clearance", "joint_limits", "outside", "tilt"};
  return {"cone", "outside", "tilt", "upright"};
}

std::vector<ConstraintSpec> ReadConstraintSpecs(const Value& list, ConstraintPlace place,
                                                const ConstraintNames& names, Diagnostics& diagnostics) {
  std::vector<ConstraintSpec> specs;
  const std::string accepted = "a list of constraints, each written '- kind: {parameters}'";
  if (!list.is_array()) {
    diagnostics.Add(list.where(), "'constraints' is " + list.KindName(), accepted);
    return specs;
  }
  const std::vector<std::string> kinds = ConstraintSpecKinds(place);
  SpecReader reader(names, diagnostics);
  for (const Value& item : list.items()) {
    if (!item.is_object() || item.members().size() != 1) {
      diagnostics.Add(item.where(), "an entry of 'constraints' is " + item.KindName(), accepted);
      continue;
    }
    const Value::Member& member = item.members()[0];
    if (!Contains(kinds, member.key)) {
      diagnostics.Add(member.where, "unknown constraint '" + member.key + "' of the velocity controller",
                      SuggestFrom(member.key, kinds));
      continue;
    }
    Value parameters = member.value;
    if (parameters.is_null()) {
      parameters = Value::Object();
      parameters.set_where(member.where);
    }
    specs.push_back(reader.Read(member.key, member.where, parameters));
  }
  return specs;
}

std::string Describe(const ConstraintSpec& spec) {
  if (spec.kind == "clearance") return "clearance of " + Join(spec.of) + " to " + Join(spec.to);
  if (spec.kind == "outside") return "outside: " + spec.frame + " around " + spec.around;
  if (spec.kind == "tilt" || spec.kind == "upright")
    return spec.kind + " of " + (spec.frame.empty() ? "held" : spec.frame);
  return spec.kind;
}

}  // namespace tether::control
