#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "tether/math/pose.h"
#include "tether/robot/interface.h"
#include "tether/robot/model.h"
#include "tether/scene/scene.h"

namespace tether::sim {

struct WorldOptions {
  double timestep = 0.001;  ///< Physics step, s.
};

/// A physics world built from a scene: rigid bodies, arms, grasping by friction (nothing is ever glued).
/// Deterministic: the same scene and the same commands give the same motion, bit for bit.
class World : public robot::Interface {
 public:
  /// `models` holds one model per robot of the scene, by robot name. Throws InputError for what cannot be simulated.
  World(const scene::Scene& scene, const std::map<std::string, std::shared_ptr<const robot::Model>>& models,
        const WorldOptions& options = {});
  ~World() override;

  double time() const;
  robot::Observations Observe() const override;
  void Apply(const robot::Commands& commands, double period) override;

  /// The true poses of all objects, fixed ones included.
  scene::WorldEstimate Truth() const;
  /// The true linear and angular velocity of an object in the world frame, (m/s, rad/s).
  math::Vector6d ObjectVelocity(const std::string& object) const;
  /// Sum of the normal contact forces between two bodies (object names, or robot names), N; 0 without contact.
  double ContactForce(const std::string& a, const std::string& b) const;

  /// Puts an object at a pose at once, at rest. For setting up; during a run use MoveObject.
  void PlaceObject(const std::string& object, const math::Pose& X_WO);
  /// A disturbance: drives an object from where it is to `X_WO_goal` over `duration` seconds (> 0) at finite speed, fixed
  /// objects included; things that rest on it ride along by friction. A movable object is free again afterwards.
  void MoveObject(const std::string& object, const math::Pose& X_WO_goal, double duration);

 private:
  friend class Renderer;
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tether::sim
