#pragma once

#include <map>
#include <memory>
#include <set>
#include <string>

#include "tether/math/pose.h"
#include "tether/robot/model.h"
#include "tether/scene/scene.h"

namespace tether::sim {

/// What goes into a scene's MJCF text besides the scene itself.
struct Composition {
  double timestep = 0.001;                                            ///< s
  std::map<std::string, std::shared_ptr<const robot::Model>> models;  ///< By robot name.
  std::map<std::string, math::Pose> X_WO;                             ///< By object name, all of them.
  /// Fixed objects that move on rails: bodies with the inertia of a mountain, whose position and velocity are
  /// set.
  std::set<std::string> driven;
  /// Room for so many contacts; memory grows with the square of it. With none it is compiled fast.
  int contact_room = 0;
};

/// The body and the joint (if it has one) of an object, and the body of a robot's base, in the composed MJCF.
/// Names inside a robot's own MJCF get the prefix "<robot name>/".
std::string ObjectBodyName(const std::string& object);
std::string RobotPrefix(const std::string& robot);

/// Whether a part of it is a convex hull.
bool HasHull(const scene::Object& object);

/// The scene as one MJCF text. Throws InputError for a robot's MJCF that can't be built into a scene.
std::string ComposeMjcf(const scene::Scene& scene, const Composition& composition);

}  // namespace tether::sim
