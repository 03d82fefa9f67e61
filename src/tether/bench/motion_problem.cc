#include "tether/bench/motion_problem.h"

#include <algorithm>
#include <filesystem>
#include <map>
#include <optional>
#include <utility>

#include "tether/common/document/reader.h"
#include "tether/common/document/value.h"

namespace tether::bench {
namespace {

namespace fs = std::filesystem;
using math::Pose;

const std::vector<Value>& Items(const Value* value) {
  static const std::vector<Value> none;
  return value != nullptr && value->is_array() ? value->items() : none;
}

std::string TextOf(const Value& map, std::string_view key) {
  const Value* value = map.Find(key);
  return value != nullptr ? value->AsText() : "";
}

/// A MoveIt message has more keys than we need; those that we need are read from maps by name, and must be
/// there.
const Value* Member(const Value& map, std::string_view key, const std::string& what,
                    std::string_view accepted, Diagnostics& diagnostics) {
  const Value* value = map.is_object() ? map.Find(key) : nullptr;
  if (value == nullptr) {
    diagnostics.Add(map.where(), what + " has no '" + std::string(key) + "'",
                    "'" + std::string(key) + "', " + std::string(accepted) + ", is needed");
  }
  return value;
}

/// position: [x, y, z], orientation: [x, y, z, w].
Pose ReadPose(const Value& map, const std::string& what, Diagnostics& diagnostics) {
  const Value* position = Member(map, "position", what, "a list of 3 numbers", diagnostics);
  const Value* orientation = Member(map, "orientation", what, "a list of 4 numbers x, y, z, w", diagnostics);
  if (position == nullptr || orientation == nullptr) return {};
  const auto p = ReadVector(*position, 3, "'position' of " + what, diagnostics);
  const auto q = ReadVector(*orientation, 4, "'orientation' of " + what, diagnostics);
  if (!p || !q) return {};
  if (q->norm() < 1e-6) {
    diagnostics.Add(orientation->where(), "'orientation' of " + what + " is zero",
                    "a quaternion x, y, z, w is accepted");
    return {};
  }
  return {Eigen::Quaterniond((*q)[3], (*q)[0], (*q)[1], (*q)[2]), *p};
}

/// A solid primitive of MoveIt; none if it is a shape that we do not have, or after a mistake.
std::optional<geometry::Primitive> ReadPrimitive(const Value& map, const std::string& what,
                                                 MotionProblem& problem, Diagnostics& diagnostics) {
  const Value* type = Member(map, "type", what, "box, cylinder or sphere", diagnostics);
  if (type == nullptr) return std::nullopt;
  const std::map<std::string, int> sizes = {{"box", 3}, {"cylinder", 2}, {"sphere", 1}};
  const auto size = sizes.find(type->AsText());
  if (size == sizes.end()) {
    problem.unknown.push_back(type->AsText() + " (" + what + ")");
    return std::nullopt;
  }
  const Value* dimensions = Member(map, "dimensions", what, "a list of lengths, m", diagnostics);
  if (dimensions == nullptr) return std::nullopt;
  const auto d = ReadVector(*dimensions, size->second, "'dimensions' of " + what, diagnostics);
  if (!d) return std::nullopt;
  if (d->minCoeff() <= 0) {
    diagnostics.Add(dimensions->where(), "'dimensions' of " + what + " has an entry that is not above zero",
                    "lengths above zero are accepted, m");
    return std::nullopt;
  }
  if (size->first == "box") return geometry::Box{*d};
  if (size->first == "sphere") return geometry::Sphere{(*d)[0]};
  return geometry::Cylinder{(*d)[1], (*d)[0]};
}

void ReadObject(const Value& object, MotionProblem& problem, Diagnostics& diagnostics) {
  const std::string name = TextOf(object, "id");
  const std::string what = "object '" + name + "'";
  for (const char* other : {"meshes", "planes"}) {
    if (!Items(object.Find(other)).empty()) problem.unknown.push_back(std::string(other) + " (" + what + ")");
  }
  Pose X_BO;
  if (const Value* pose = object.Find("pose"); pose != nullptr && pose->is_object())
    X_BO = ReadPose(*pose, "pose of " + what, diagnostics);
  const std::vector<Value>& primitives = Items(object.Find("primitives"));
  const std::vector<Value>& poses = Items(object.Find("primitive_poses"));
  if (primitives.size() != poses.size()) {
    diagnostics.Add(object.where(),
                    what + " has " + std::to_string(primitives.size()) + " primitives and " +
                        std::to_string(poses.size()) + " poses of them",
                    "one pose for each is accepted");
    return;
  }
  std::vector<geometry::Part> parts;
  for (size_t i = 0; i < primitives.size(); ++i) {
    const Pose X_OP = ReadPose(poses[i], "pose of " + what, diagnostics);
    if (auto primitive = ReadPrimitive(primitives[i], what, problem, diagnostics))
      parts.push_back({std::move(*primitive), X_OP});
  }
  if (!parts.empty()) problem.obstacles.push_back({name, geometry::Shape(std::move(parts)), X_BO});
}

void ReadScene(const Value& root, MotionProblem& problem, Diagnostics& diagnostics) {
  const Value* world = Member(root, "world", "the scene", "a map", diagnostics);
  if (world == nullptr) return;
  for (const Value& object : Items(world->Find("collision_objects")))
    ReadObject(object, problem, diagnostics);
  if (const Value* octomap = world->Find("octomap"); octomap != nullptr && octomap->is_object())
    problem.unknown.emplace_back("octomap");
  const Value* state = root.Find("robot_state");
  for (const Value& held : Items(state != nullptr ? state->Find("attached_collision_objects") : nullptr)) {
    const Value* object = held.Find("object");
    problem.unknown.push_back("attached object '" + (object != nullptr ? TextOf(*object, "id") : "") + "'");
  }
}

void ReadStart(const Value& root, MotionProblem& problem, Diagnostics& diagnostics) {
  const Value* state = Member(root, "start_state", "the request", "a map", diagnostics);
  if (state == nullptr) return;
  const Value* joints = Member(*state, "joint_state", "start_state", "a map", diagnostics);
  if (joints == nullptr) return;
  const std::vector<Value>&names = Items(joints->Find("name")), &positions = Items(joints->Find("position"));
  if (names.size() != positions.size()) {
    diagnostics.Add(joints->where(),
                    "joint_state has " + std::to_string(names.size()) + " names and " +
                        std::to_string(positions.size()) + " positions",
                    "one position for each name is accepted");
    return;
  }
  for (size_t i = 0; i < names.size(); ++i) {
    const std::string name = names[i].AsText();
    problem.start.push_back({name, ReadNumber(positions[i], "position of '" + name + "'", diagnostics)});
  }
}

void ReadGoals(const Value& root, MotionProblem& problem, Diagnostics& diagnostics) {
  const Value* goals = Member(root, "goal_constraints", "the request", "a list", diagnostics);
  if (goals == nullptr) return;
  for (const Value& goal : Items(goals)) {
    std::vector<JointPosition> joints;
    for (const char* other : {"position_constraints", "orientation_constraints", "visibility_constraints"}) {
      if (!Items(goal.Find(other)).empty()) problem.unknown.push_back(std::string(other) + " of a goal");
    }
    for (const Value& joint : Items(goal.Find("joint_constraints"))) {
      const Value* name = Member(joint, "joint_name", "a joint constraint", "a name", diagnostics);
      const Value* position = Member(joint, "position", "a joint constraint", "a number", diagnostics);
      if (name == nullptr || position == nullptr) continue;
      joints.push_back(
          {name->AsText(), ReadNumber(*position, "position of '" + name->AsText() + "'", diagnostics)});
    }
    problem.goals.push_back(std::move(joints));
  }
  if (problem.goals.empty()) {
    diagnostics.Add(goals->where(), "goal_constraints is empty",
                    "at least one goal, with joint_constraints, is accepted");
  }
}

}  // namespace

std::vector<MotionProblemFiles> FindMotionProblems(const std::string& folder) {
  std::error_code failed;
  std::map<std::string, MotionProblemFiles> found;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder, failed)) {
    if (entry.path().extension() != ".yaml") continue;
    const std::string stem = entry.path().stem().string();
    for (const std::string_view kind : {"scene", "request"}) {
      if (!stem.starts_with(kind)) continue;
      const fs::path below = fs::relative(entry.path().parent_path(), folder);
      const std::string name = (below / stem.substr(kind.size())).lexically_normal().generic_string();
      MotionProblemFiles& files = found[name];
      files.name = name;
      (kind == "scene" ? files.scene : files.request) = entry.path().string();
    }
  }
  if (found.empty()) {
    throw InputError(
        failed ? "'" + folder + "' cannot be read: " + failed.message()
               : "there are no motion problems in '" + folder + "'",
        "a folder with files sceneNAME.yaml and requestNAME.yaml of MotionBenchMaker is accepted");
  }
  std::vector<MotionProblemFiles> all;
  for (auto& [name, files] : found) all.push_back(std::move(files));
  return all;
}

MotionProblem ReadMotionProblem(const MotionProblemFiles& files) {
  if (files.scene.empty() || files.request.empty()) {
    throw InputError("problem '" + files.name + "' has no " + (files.scene.empty() ? "scene" : "request"),
                     "scene" + fs::path(files.name).filename().string() + ".yaml and request" +
                         fs::path(files.name).filename().string() + ".yaml are accepted");
  }
  MotionProblem problem;
  problem.name = files.name;
  Diagnostics diagnostics;
  ReadScene(ReadYaml(files.scene), problem, diagnostics);
  const Value request = ReadYaml(files.request);
  ReadStart(request, problem, diagnostics);
  ReadGoals(request, problem, diagnostics);
  diagnostics.ThrowIfAny();
  return problem;
}

}  // namespace tether::bench
