#pragma once

#include <map>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "tether/common/id.h"
#include "tether/geometry/shape.h"
#include "tether/math/pose.h"

namespace tether::scene {

/// The name of the root frame.
inline constexpr const char* kWorld = "world";

/// A solid body. Fixed unless it has a mass.
struct Object {
  std::string name;
  geometry::Shape shape;
  std::optional<double> mass;           ///< kg; none: the object is fixed
  double friction = 0.8;                ///< Coulomb coefficient of its surface
  std::string parent = kWorld;          ///< The frame that the initial pose is given in.
  math::Pose X_ParentObject;            ///< Initial pose in the parent's frame.
  std::optional<Eigen::Vector4d> rgba;  ///< For pictures.

  bool movable() const { return mass.has_value(); }
};

/// A region's form: a solid's primitive, or a flat patch in the frame's xy plane.
struct Disc {
  double radius;  ///< m
};
struct Rectangle {
  Eigen::Vector2d size;  ///< Full side lengths, m.
};
using RegionForm = std::variant<geometry::Primitive, Disc, Rectangle>;

/// A named part of space; never solid.
struct Region {
  std::string name;
  RegionForm form;
  std::string parent = kWorld;
  math::Pose X_ParentRegion;
  int capacity = 0;  ///< Objects that fit; 0: no limit.
  double dwell = 0;  ///< Time to wait after placing there, s.
  bool hub = false;  ///< Connects all regions; nothing is placed here.
};

/// A robot arm that stands in the scene.
struct Robot {
  std::string name;
  std::string model;      ///< Name of a shipped robot model, or a path.
  std::vector<double> q;  ///< Initial joint positions, rad.
  std::string parent = kWorld;
  math::Pose X_ParentBase;
};

/// The objects, regions and robots with their initial poses. Names are unique over objects, regions and
/// robots ("one namespace of frames"). Objects are in file order; a parent may come after its child.
class Scene {
 public:
  std::vector<Object> objects;
  std::vector<Region> regions;
  std::vector<Robot> robots;
  std::map<std::string, std::vector<std::string>> groups;  ///< Named sets of regions.

  const Object& object(ObjectId id) const { return objects[id.index()]; }
  /// The object of that name; not valid if there is none.
  ObjectId FindObjectId(const std::string& name) const;

  /// By name; null if there is none.
  const Object* FindObject(const std::string& name) const;
  const Region* FindRegion(const std::string& name) const;
  const Robot* FindRobot(const std::string& name) const;

  /// Initial pose in the world of an object, region or robot base; identity for "world". The name must exist
  /// and its parents must not form a cycle.
  math::Pose InitialPose(const std::string& name) const;
};

/// The estimated poses of the objects at a time: the input of controller, executive and planner. Filled by
/// the simulator's truth or by perception.
struct WorldEstimate {
  double time = 0;                         ///< s
  std::map<std::string, math::Pose> X_WO;  ///< Pose of each object in the world.
};

}  // namespace tether::scene
