#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "tether/common/document/reader.h"
#include "tether/robot/model.h"
#include "tether/scene/scene.h"

namespace tether::scenario {

/// A pose as written: {parent, position, rpy | quaternion_wxyz}, each of them optional.
struct PoseSpec {
  std::string parent = scene::kWorld;
  Location parent_where;
  math::Pose X_ParentFrame;  ///< m
};

/// Reads a pose. `allow_parent` is false for the parts of a compound, whose poses are in the object's own
/// frame.
PoseSpec ReadPose(const Value& value, const std::string& what, bool allow_parent, Diagnostics& diagnostics);

/// Reads a shape: a map with one of box, sphere, capsule, cylinder, hull and mesh, or a list of those, each
/// with a pose: a compound. The frame of a hull's part is moved to its centre of mass. Relative paths of
/// meshes start from `folder`.
geometry::Shape ReadShape(const Value& value, const std::string& what, const std::string& folder,
                          Diagnostics& diagnostics);

/// The scene of a document and the robot models it names.
struct SceneReading {
  scene::Scene scene;
  std::map<std::string, std::shared_ptr<const robot::Model>>
      models;                             ///< By robot name; without those that failed.
  std::map<std::string, Location> where;  ///< Of each frame's name.
};

/// Reads the keys `robots`, `objects`, `regions` and `groups` of a scenario. Names share one namespace;
/// parents must exist and form no cycle. Relative paths of robot models start from `folder`.
SceneReading ReadScene(ObjectReader& scenario, const std::string& folder);

/// Names of all frames that something can be relative to: "world", then robots, objects, regions in file
/// order.
std::vector<std::string> FrameNames(const scene::Scene& scene);

}  // namespace tether::scenario
