#include "tether/scenario/scene_reader.h"

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <set>

#include "tether/common/bounds.h"
#include "tether/geometry/hull/hull_reader.h"
#include "tether/geometry/hull/polytope.h"

namespace tether::scenario {
namespace {

const std::vector<std::string>& ShapeKinds() {
  static const std::vector<std::string> kinds = {"box", "sphere", "capsule", "cylinder", "hull", "mesh"};
  return kinds;
}

/// Finite sizes above zero, `count` of them; ones after a mistake.
Eigen::VectorXd ReadSizes(const Value& value, int count, const std::string& what, Diagnostics& diagnostics) {
  const auto sizes = ReadVector(value, count, what, diagnostics);
  if (!sizes) return Eigen::VectorXd::Ones(count);
  for (int i = 0; i < count; ++i) {
    if ((*sizes)[i] >= kSmallestLength) continue;
    diagnostics.Add(value.items()[i].where(), what + " has the size " + value.items()[i].AsText(),
                    (*sizes)[i] > 0 ? "full side lengths from 0.1 mm, m" : "full side lengths above zero, m");
    return Eigen::VectorXd::Ones(count);
  }
  return *sizes;
}

bool IsMeshOption(const std::string& key) { return key == "scale" || key == "fill"; }

/// `siblings` holds the options of a mesh, beside its key.
geometry::Primitive ReadPrimitive(const std::string& kind, const Value& value, const Value& siblings,
                                  const std::string& folder, const std::string& what,
                                  Diagnostics& diagnostics) {
  const std::string name = kind + " of " + what;
  if (kind == "hull") return geometry::ReadHull(value, name, diagnostics);
  if (kind == "mesh") {
    geometry::MeshOptions options;
    if (const Value* scale = siblings.Find("scale")) {
      options.scale = ReadPositive(*scale, "'scale' of " + what, diagnostics);
    }
    if (const Value* fill = siblings.Find("fill")) {
      options.fill = ReadBool(*fill, "'fill' of " + what, diagnostics);
    }
    return geometry::ReadMeshHull(value, options, folder, name, diagnostics);
  }
  if (kind == "box") return geometry::Box{ReadSizes(value, 3, name, diagnostics)};
  if (kind == "sphere" && value.is_scalar()) return geometry::Sphere{ReadLength(value, name, diagnostics)};
  ObjectReader reader(value, name, diagnostics);
  const auto size = [&](std::string_view key, std::string_view accepted) {
    const Value* member = reader.Required(key, accepted);
    return member ? ReadLength(*member, "'" + std::string(key) + "' of " + name, diagnostics) : 1.0;
  };
  const double radius = size("radius", "a radius above zero, m");
  const double length =
      kind == "sphere" ? 0 : size("length", "a length along the local z axis above zero, m");
  reader.Finish();
  if (kind == "sphere") return geometry::Sphere{radius};
  if (kind == "capsule") return geometry::Capsule{radius, length};
  return geometry::Cylinder{radius, length};
}

geometry::Part ReadPart(const Value& value, const std::string& what, const std::string& folder,
                        Diagnostics& diagnostics) {
  geometry::Part part{geometry::Sphere{1}, {}};
  if (!value.is_object()) {
    diagnostics.Add(value.where(), "shape of " + what + " is " + value.KindName(),
                    "a map with one of " + JoinAlternatives(ShapeKinds()) + ", or a list of such maps");
    return part;
  }
  int count = 0;
  for (const Value::Member& member : value.members()) {
    if (member.key == "name") {
      continue;  // of a part that is a frame of its own, see ReadNamedParts
    } else if (member.key == "pose") {
      part.X_SP = ReadPose(member.value, "part of " + what, false, diagnostics).X_ParentFrame;
    } else if (IsMeshOption(member.key) && value.Find("mesh") != nullptr) {
      continue;
    } else if (std::find(ShapeKinds().begin(), ShapeKinds().end(), member.key) == ShapeKinds().end()) {
      diagnostics.Add(member.where, "unknown shape '" + member.key + "' of " + what,
                      SuggestFrom(member.key, ShapeKinds()));
      ++count;
    } else {
      part.primitive = ReadPrimitive(member.key, member.value, value, folder, what, diagnostics);
      if (++count == 2) {
        diagnostics.Add(member.where, "a second shape '" + member.key + "' in one map of " + what,
                        "a list of maps for a compound");
      }
    }
  }
  if (count == 0) {
    diagnostics.Add(value.where(), "shape of " + what + " is missing",
                    "one of " + JoinAlternatives(ShapeKinds()));
  }
  if (const auto* hull = std::get_if<geometry::Hull>(&part.primitive)) {
    return geometry::CentredPart(*hull, part.X_SP);
  }
  return part;
}

bool IsName(const std::string& name) {
  return !name.empty() && std::all_of(name.begin(), name.end(), [](unsigned char c) {
    return std::isalnum(c) || c == '_' || c == '-';
  });
}

class SceneParser {
 public:
  SceneParser(std::string folder, Diagnostics& diagnostics)
      : folder_(std::move(folder)), diagnostics_(diagnostics) {}

  SceneReading Read(ObjectReader& scenario) {
    ForEach(scenario, "robots", [&](const auto& name, const auto& value) { ReadRobot(name, value); });
    ForEach(scenario, "objects", [&](const auto& name, const auto& value) { ReadObject(name, value); });
    ForEach(scenario, "regions", [&](const auto& name, const auto& value) { ReadRegion(name, value); });
    if (const Value* groups = scenario.Optional("groups")) ReadGroups(*groups);
    CheckParents();
    return std::move(reading_);
  }

 private:
  template <typename Function>
  void ForEach(ObjectReader& scenario, const std::string& key, Function read) {
    const Value* map = scenario.Optional(key);
    if (map == nullptr || map->is_null()) return;
    if (!map->is_object()) {
      diagnostics_.Add(map->where(), "'" + key + "' is " + map->KindName(), "a map from names to " + key);
      return;
    }
    for (const Value::Member& member : map->members()) {
      ClaimName(member.key, member.where);
      read(member.key, member.value);
    }
  }

  void ClaimName(const std::string& name, const Location& where) {
    if (name == "world" || name == "hand" || name == "moved") {
      diagnostics_.Add(
          where, "the name '" + name + "' is reserved",
          "any name but world (the root frame), hand (the acting robot's) and moved (what a step moves)");
    } else if (!IsName(name)) {
      diagnostics_.Add(where, "'" + name + "' is not a name", "letters, digits, '_' and '-'");
    } else if (const auto [first, fresh] = reading_.where.emplace(name, where); !fresh) {
      diagnostics_.Add(where,
                       "the name '" + name + "' is taken, at line " + std::to_string(first->second.line),
                       "one namespace for robots, objects, regions and groups");
    }
  }

  void ReadRobot(const std::string& name, const Value& value) {
    const std::string what = "robot '" + name + "'";
    scene::Robot robot;
    robot.name = name;
    ObjectReader reader(value, what, diagnostics_);
    std::shared_ptr<const robot::Model> model;
    if (const Value* model_name = reader.Required("model", "a shipped robot model, or a path")) {
      robot.model = ReadText(*model_name, "'model' of " + what, diagnostics_);
      model = LoadModel(robot.model, model_name->where());
    }
    if (model) {
      reading_.models[name] = model;
      robot.q.assign(model->home().begin(), model->home().end());
    }
    if (const Value* q = reader.Optional("q")) {
      const auto positions = ReadVector(*q, model ? model->dof() : -1, "'q' of " + what, diagnostics_);
      if (positions) robot.q.assign(positions->begin(), positions->end());
      if (positions && model) CheckLimits(*model, *positions, *q, what);
    }
    ReadPoseOf(reader, name, robot.parent, robot.X_ParentBase);
    reader.Finish();
    reading_.scene.robots.push_back(std::move(robot));
  }

  void CheckLimits(const robot::Model& model, const Eigen::VectorXd& q, const Value& list,
                   const std::string& what) {
    for (int i = 0; i < model.dof(); ++i) {
      if (q[i] >= model.lower()[i] && q[i] <= model.upper()[i]) continue;
      diagnostics_.Add(list.items()[i].where(),
                       "'q' of " + what + " has " + Value(q[i]).AsText() + " for " + model.joint_names()[i] +
                           ", beyond the joint's limits",
                       Value(model.lower()[i]).AsText() + " to " + Value(model.upper()[i]).AsText() + " rad");
    }
  }

  std::shared_ptr<const robot::Model> LoadModel(const std::string& name, const Location& where) {
    if (name.empty()) return nullptr;
    const bool is_path = name.find('/') != std::string::npos || name.ends_with(".yaml");
    const std::string resolved = is_path && !std::filesystem::path(name).is_absolute()
                                     ? (std::filesystem::path(folder_) / name).string()
                                     : name;
    try {
      return robot::Model::Load(resolved);
    } catch (const InputError& error) {
      for (const Diagnostic& diagnostic : error.diagnostics()) {
        const bool placed = diagnostic.where.line > 0;
        const std::string& file = diagnostic.where.file;
        diagnostics_.Add(placed ? diagnostic.where : where,
                         placed || file.empty() ? diagnostic.message : file + ": " + diagnostic.message,
                         diagnostic.accepted);
      }
      return nullptr;
    }
  }

  void ReadObject(const std::string& name, const Value& value) {
    const std::string what = "object '" + name + "'";
    scene::Object object;
    object.name = name;
    ObjectReader reader(value, what, diagnostics_);
    if (const Value* shape = reader.Required("shape", "such as {box: [0.1, 0.1, 0.1]}")) {
      object.shape = ReadShape(*shape, what, folder_, diagnostics_);
    }
    if (const Value* mass = reader.Optional("mass")) {
      object.mass = ReadPositive(*mass, "'mass' of " + what, diagnostics_);
      if (*object.mass < kSmallestMass) {
        diagnostics_.Add(mass->where(), "'mass' of " + what + " is " + mass->AsText() + " kg",
                         "a mass from 1 mg, or none for what is fixed");
        object.mass = 1;
      }
    }
    object.friction = reader.Number("friction", object.friction);
    if (object.friction < 0) {
      diagnostics_.Add(value.Find("friction")->where(), "'friction' of " + what + " is negative",
                       "zero or more");
      object.friction = 0;
    }
    if (const Value* rgba = reader.Optional("rgba")) {
      if (const auto colour = ReadVector(*rgba, 4, "'rgba' of " + what, diagnostics_)) {
        if ((colour->array() < 0).any() || (colour->array() > 1).any()) {
          diagnostics_.Add(rgba->where(), "'rgba' of " + what + " is out of range",
                           "four numbers from 0 to 1");
        } else {
          object.rgba = *colour;
        }
      }
    }
    ReadPoseOf(reader, name, object.parent, object.X_ParentObject);
    reader.Finish();
    std::vector<scene::Object> named;
    if (const Value* shape = value.Find("shape")) named = ReadNamedParts(*shape, object);
    reading_.scene.objects.push_back(std::move(object));
    for (scene::Object& part : named) reading_.scene.objects.push_back(std::move(part));
  }

  /// Takes the parts with a name out of the object: each is a fixed object of its own, attached to it.
  std::vector<scene::Object> ReadNamedParts(const Value& shape, scene::Object& object) {
    std::vector<scene::Object> named;
    std::vector<geometry::Part> unnamed;
    for (size_t i = 0; i < object.shape.parts.size(); ++i) {
      const geometry::Part& part = object.shape.parts[i];
      const Value* of = shape.is_array() && i < shape.items().size() ? &shape.items()[i] : &shape;
      const Value* name = of->is_object() ? of->Find("name") : nullptr;
      if (name == nullptr) {
        unnamed.push_back(part);
        continue;
      }
      const std::string what = "a part of object '" + object.name + "'";
      if (!shape.is_array()) {
        diagnostics_.Add(name->where(), "the only part of object '" + object.name + "' has a name",
                         "names for parts of a compound, which is a list");
      } else if (object.movable()) {
        diagnostics_.Add(name->where(), what + " has a name, but the object has a mass",
                         "names for parts of objects that are fixed");
      }
      scene::Object child = object;
      child.name = ReadText(*name, "'name' of " + what, diagnostics_);
      ClaimName(child.name, name->where());
      child.shape.parts = {{part.primitive, {}}};
      child.parent = object.name;
      child.X_ParentObject = part.X_SP;
      parents_.push_back({child.name, object.name, name->where()});
      named.push_back(std::move(child));
    }
    if (unnamed.empty() && shape.is_array()) {
      diagnostics_.Add(shape.where(), "every part of object '" + object.name + "' has a name",
                       "at least one part without, which is the object's own");
    } else if (shape.is_array()) {
      object.shape.parts = std::move(unnamed);
    }
    return named;
  }

  void ReadRegion(const std::string& name, const Value& value) {
    const std::string what = "region '" + name + "'";
    scene::Region region;
    region.name = name;
    ObjectReader reader(value, what, diagnostics_);
    int forms = 0;
    if (const Value* disc = reader.Optional("disc")) {
      region.form = scene::Disc{ReadLength(*disc, "'disc' of " + what, diagnostics_)};
      ++forms;
    }
    if (const Value* rectangle = reader.Optional("rectangle")) {
      region.form = scene::Rectangle{ReadSizes(*rectangle, 2, "'rectangle' of " + what, diagnostics_)};
      ++forms;
    }
    for (const std::string& kind : ShapeKinds()) {
      if (const Value* solid = reader.Optional(kind)) {
        region.form = ReadPrimitive(kind, *solid, value, folder_, what, diagnostics_);
        ++forms;
        if (kind != "mesh") continue;
        reader.Optional("scale");
        reader.Optional("fill");
      }
    }
    if (value.is_object() && forms != 1) {
      diagnostics_.Add(value.where(), what + (forms == 0 ? " has no form" : " has more than one form"),
                       "one of disc, rectangle, " + JoinAlternatives(ShapeKinds()));
    }
    region.capacity = reader.Integer("capacity", 0);
    region.dwell = reader.Number("dwell", 0);
    region.hub = reader.Bool("hub", false);
    if (region.capacity < 0) {
      diagnostics_.Add(value.Find("capacity")->where(), "'capacity' of " + what + " is negative",
                       "a number of objects; 0: no limit");
      region.capacity = 0;
    }
    if (region.dwell < 0) {
      diagnostics_.Add(value.Find("dwell")->where(), "'dwell' of " + what + " is negative", "a time in s");
      region.dwell = 0;
    }
    ReadPoseOf(reader, name, region.parent, region.X_ParentRegion);
    reader.Finish();
    reading_.scene.regions.push_back(std::move(region));
  }

  void ReadGroups(const Value& groups) {
    ObjectReader reader(groups, "'groups'", diagnostics_);
    for (const Value::Member& member : groups.members()) {
      ClaimName(member.key, member.where);
      const std::vector<std::string> names = reader.TextList(member.key);
      std::vector<std::string> known;
      for (const scene::Region& region : reading_.scene.regions) known.push_back(region.name);
      for (size_t i = 0; i < names.size(); ++i) {
        if (std::find(known.begin(), known.end(), names[i]) != known.end()) continue;
        diagnostics_.Add(member.value.items()[i].where(),
                         "unknown region '" + names[i] + "' in group '" + member.key + "'",
                         SuggestFrom(names[i], known));
      }
      reading_.scene.groups[member.key] = names;
    }
  }

  void ReadPoseOf(ObjectReader& reader, const std::string& name, std::string& parent, math::Pose& X) {
    const Value* value = reader.Optional("pose");
    if (value == nullptr) return;
    const PoseSpec pose = ReadPose(*value, reader.what(), true, diagnostics_);
    parent = pose.parent;
    X = pose.X_ParentFrame;
    parents_.push_back({name, pose.parent, pose.parent_where});
  }

  void CheckParents() {
    const std::vector<std::string> frames = FrameNames(reading_.scene);
    const std::set<std::string> known(frames.begin(), frames.end());
    std::map<std::string, std::string> parent_of;
    for (Parent& parent : parents_) {
      if (!known.contains(parent.parent)) {
        diagnostics_.Add(parent.where, "unknown parent '" + parent.parent + "' of '" + parent.child + "'",
                         SuggestFrom(parent.parent, frames));
        Detach(parent.child);
      } else {
        parent_of[parent.child] = parent.parent;
      }
    }
    std::set<std::string> in_cycle;
    for (const Parent& parent : parents_) {
      std::vector<std::string> chain = {parent.child};
      std::string text = parent.child;
      // A chain that is longer than there are parents has run into a cycle further up, which is reported from
      // there.
      while (!in_cycle.contains(parent.child) && parent_of.contains(chain.back()) &&
             chain.size() <= parents_.size()) {
        chain.push_back(parent_of[chain.back()]);
        text += " → " + chain.back();
        if (chain.back() != parent.child) continue;
        in_cycle.insert(chain.begin(), chain.end());
        diagnostics_.Add(parent.where, "a cycle among parents: " + text,
                         "each chain of parents ends at world");
      }
    }
    for (const std::string& name : in_cycle) Detach(name);
  }

  /// Attaches a frame with a bad parent to the world, so that reading can go on.
  void Detach(const std::string& name) {
    for (scene::Object& object : reading_.scene.objects) {
      if (object.name == name) object.parent = scene::kWorld;
    }
    for (scene::Region& region : reading_.scene.regions) {
      if (region.name == name) region.parent = scene::kWorld;
    }
    for (scene::Robot& robot : reading_.scene.robots) {
      if (robot.name == name) robot.parent = scene::kWorld;
    }
  }

  struct Parent {
    std::string child;
    std::string parent;
    Location where;
  };

  std::string folder_;
  Diagnostics& diagnostics_;
  SceneReading reading_;
  std::vector<Parent> parents_;
};

}  // namespace

std::vector<std::string> FrameNames(const scene::Scene& scene) {
  std::vector<std::string> names = {scene::kWorld};
  for (const scene::Robot& robot : scene.robots) names.push_back(robot.name);
  for (const scene::Object& object : scene.objects) names.push_back(object.name);
  for (const scene::Region& region : scene.regions) names.push_back(region.name);
  return names;
}

PoseSpec ReadPose(const Value& value, const std::string& what, bool allow_parent, Diagnostics& diagnostics) {
  PoseSpec pose;
  ObjectReader reader(value, "pose of " + what, diagnostics);
  if (allow_parent) {
    if (const Value* parent = reader.Optional("parent")) {
      pose.parent = ReadText(*parent, "'parent' of " + reader.what(), diagnostics);
      pose.parent_where = parent->where();
    }
  }
  pose.X_ParentFrame.p = reader.Vector("position", Eigen::VectorXd::Zero(3));
  const Value* rpy = reader.Optional("rpy");
  const Value* quaternion = reader.Optional("quaternion_wxyz");
  if (rpy != nullptr && quaternion != nullptr) {
    diagnostics.Add(quaternion->where(), reader.what() + " has two orientations",
                    "rpy or quaternion_wxyz, not both");
  } else if (rpy != nullptr) {
    if (const auto angles = ReadVector(*rpy, 3, "'rpy' of " + reader.what(), diagnostics)) {
      pose.X_ParentFrame.R = math::RotationFromRpy(*angles);
    }
  } else if (quaternion != nullptr) {
    if (const auto q = ReadVector(*quaternion, 4, "'quaternion_wxyz' of " + reader.what(), diagnostics)) {
      if (q->norm() < 1e-9) {
        diagnostics.Add(quaternion->where(), "'quaternion_wxyz' of " + reader.what() + " has length zero",
                        "four numbers w, x, y, z that are not all zero");
      } else {
        pose.X_ParentFrame.R =
            Eigen::Quaterniond((*q)[0], (*q)[1], (*q)[2], (*q)[3]).normalized().toRotationMatrix();
      }
    }
  }
  reader.Finish();
  return pose;
}

geometry::Shape ReadShape(const Value& value, const std::string& what, const std::string& folder,
                          Diagnostics& diagnostics) {
  geometry::Shape shape;
  if (!value.is_array()) {
    shape.parts.push_back(ReadPart(value, what, folder, diagnostics));
    return shape;
  }
  if (value.items().empty()) {
    diagnostics.Add(value.where(), "shape of " + what + " is an empty list", "at least one part");
    shape.parts.push_back({geometry::Sphere{1}, {}});
  }
  for (const Value& part : value.items()) shape.parts.push_back(ReadPart(part, what, folder, diagnostics));
  return shape;
}

SceneReading ReadScene(ObjectReader& scenario, const std::string& folder) {
  return SceneParser(folder, scenario.diagnostics()).Read(scenario);
}

}  // namespace tether::scenario
