#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "tether/math/pose.h"
#include "tether/robot/interface.h"
#include "tether/robot/model.h"
#include "tether/scene/scene.h"

namespace tether::sim {

struct WorldOptions {
  double timestep = 0.001;  ///< Physics step, s.
};

/// The physics engine and its version: "MuJoCo 2.2.2".
std::string PhysicsVersion();

/// Two bodies that touch (object or robot names), and the sum of the normal forces between them.
struct Contact {
  std::string a, b;
  double force = 0;  ///< N
};

/// Throws InputError for a scene that can't be simulated, as World does, but without the memory and the time
/// that a World needs: only what may be refused is compiled, not the shipped robots and plain shapes. `X_WO`
/// holds the initial poses of all objects.
void RequireSimulable(const scene::Scene& scene,
                      const std::map<std::string, std::shared_ptr<const robot::Model>>& models,
                      const std::map<std::string, math::Pose>& X_WO);

/// A physics world built from a scene: rigid bodies, arms, grasping by friction (nothing is ever glued).
/// Deterministic: the same scene and the same commands give the same motion, bit for bit.
///
/// Bodies have uniform density. Where two surfaces meet, the lesser of their friction coefficients counts
/// (scene::PairFriction).
/// Fixed objects and robot bases may overlap one another. Stepping and the in-place queries allocate nothing.
class World : public robot::Interface {
 public:
  /// `models` holds one model per robot of the scene, by robot name. Throws InputError for what cannot be
  /// simulated.
  World(const scene::Scene& scene, const std::map<std::string, std::shared_ptr<const robot::Model>>& models,
        const WorldOptions& options = {});
  ~World() override;

  /// Simulated time since the start, s.
  double time() const;
  robot::Observations Observe() const override;
  /// The same in place: no allocation once `observations` has been filled by an earlier call.
  void Observe(robot::Observations* observations) const;
  /// Steps the physics by `period`, rounded so that steps and periods never drift apart. Torques are limited
  /// to what the motors can give, gripper forces likewise. A robot that isn't named keeps its gripper's last
  /// command and floats, compensating gravity. Throws InputError for a robot that isn't there, a command that
  /// is not finite or of the wrong size, and when the simulation has become unstable.
  void Apply(const robot::Commands& commands, double period) override;

  /// The true poses of all objects, fixed ones included.
  scene::WorldEstimate Truth() const;
  /// The same in place: no allocation once `estimate` has been filled by an earlier call.
  void Truth(scene::WorldEstimate* estimate) const;
  /// The true linear and angular velocity of an object in the world frame, (m/s, rad/s).
  math::Vector6d ObjectVelocity(const std::string& object) const;
  /// Sum of the normal contact forces between two bodies (object names, or robot names), N; 0 without
  /// contact.
  double ContactForce(const std::string& a, const std::string& b) const;
  /// All pairs with contact, of objects and robots, in the scene's order: forces as ContactForce() gives
  /// them.
  std::vector<Contact> Contacts() const;

  /// The same contact with how fast `b` moves into `a` where they touch: the fastest of their contact points,
  /// m/s; negative where `b` moves away, however `a` moves.
  struct Touch {
    double force = 0;  ///< N
    double speed = 0;  ///< m/s
  };
  Touch Touching(const std::string& a, const std::string& b) const;

  /// A disturbance: something pushes the arm with these joint torques (n, Nm) for `duration` s (> 0), which
  /// rise and fall over a sixth of it. It is felt in `tau_external`. A second call replaces the first. Throws
  /// InputError for a robot that isn't there, and for torques of the wrong size or not finite.
  void PushArm(const std::string& robot, const Eigen::VectorXd& torques, double duration);
  /// Whether the arm is being pushed, or was within the last `after` s.
  bool IsPushed(const std::string& robot, double after = 0) const;

  /// Puts an object at a pose at once, at rest. For setting up; during a run use MoveObject. Fixed objects
  /// that have a fixed object as their parent move with it, here and in MoveObject.
  void PlaceObject(const std::string& object, const math::Pose& X_WO);
  /// A disturbance: drives an object from where it is to `X_WO_goal` over `duration` seconds (> 0) at finite
  /// speed, fixed objects included; objects that rest on it are carried along by friction. Speed rises and
  /// falls smoothly and peaks at 15/8 of the mean, or is constant if `steady`. Fixed objects push with any
  /// force; a movable one only with its own momentum, so that an obstacle stops it, and is free again
  /// afterwards. A second call replaces the first. Throws InputError for an object that isn't there and a
  /// duration that is not positive.
  void MoveObject(const std::string& object, const math::Pose& X_WO_goal, double duration,
                  bool steady = false);
  /// Whether MoveObject() is driving the object, or the fixed one that it is mounted on.
  bool IsDriven(const std::string& object) const;

  // Disturbances of a movable object; all throw InputError for one that isn't there or is fixed, and for
  // values that are not finite.

  /// Takes an object out of the scene: until it is returned it touches nothing, and Truth() has it far above
  /// the scene.
  void RemoveObject(const std::string& object);
  /// Puts a removed object back, at rest.
  void ReturnObject(const std::string& object, const math::Pose& X_WO);
  bool IsRemoved(const std::string& object) const;
  /// A blow: an impulse (N s, in the world) within 10 ms on a point of the object (m, in its frame).
  void KnockObject(const std::string& object, const Eigen::Vector3d& impulse, const Eigen::Vector3d& at);
  /// Draws an object along `by` (m, in the world) at one speed for `duration` s (> 0), with at most `force` N
  /// (> 0), against whatever holds it.
  void PullObject(const std::string& object, const Eigen::Vector3d& by, double duration, double force);
  /// From now on the object is another in truth: `mass` (kg), `friction`, and so much larger or smaller in
  /// each of its lengths (m). What is not given stays.
  struct Change {
    std::optional<double> mass, friction, grow;
  };
  void ChangeObject(const std::string& object, const Change& change);

 private:
  friend class Renderer;
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tether::sim
