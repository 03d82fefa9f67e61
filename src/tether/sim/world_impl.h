#pragma once

#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "tether/sim/world.h"

struct mjModel_;
struct mjData_;

namespace tether::sim {

struct DeleteMujoco {
  void operator()(mjModel_* model) const;
  void operator()(mjData_* data) const;
};

/// A motion that an object is made to follow: from `start` to `goal` between two times.
struct Drive {
  math::Pose start;
  math::Vector6d change =
      math::Vector6d::Zero();  ///< (translation in the world, rotation vector in the body)
  double begin = 0;
  double duration = 0;
  bool steady = false;

  double end() const { return begin + duration; }
  math::Pose At(double time) const;
};

struct World::Impl {
  enum class Mode { kStatic, kDriven, kFree };

  struct ObjectEntry {
    std::string name;
    Mode mode = Mode::kStatic;
    int body = -1;
    int qpos = -1;
    int dof = -1;
    math::Pose X_WO;  ///< Where it is, if it isn't free.
    int leader = -1;  ///< The object whose drive it follows, itself mostly; −1: none.
    math::Pose X_LO;  ///< In the leader's frame.
    bool removed = false;
    /// What acts on it besides contacts: a force at a point of it, or one that keeps it at a speed.
    struct Action {
      double end = -1e9;                                ///< s
      Eigen::Vector3d force = Eigen::Vector3d::Zero();  ///< N, in the world …
      Eigen::Vector3d at = Eigen::Vector3d::Zero();     ///< … m, in its frame.
      /// With `most` above zero, in place of `force`: it is drawn from here on at this speed, m, m/s.
      Eigen::Vector3d from = Eigen::Vector3d::Zero(), velocity = Eigen::Vector3d::Zero();
      double begin = 0;  ///< s
      double most = 0;   ///< N
    } action;
  };

  struct RobotEntry {
    std::string name;
    std::shared_ptr<const robot::Model> model;
    std::vector<int> joint, qpos, dof;  ///< Of the arm's joints.
    std::vector<int> finger_qpos, finger_dof;
    Eigen::VectorXd torque;
    Eigen::VectorXd velocity;       ///< rad/s, that the servo follows
    Eigen::VectorXd reference;      ///< rad, joint positions that the servo holds: the velocity's integral
    bool commanded = false;         ///< In the current period.
    bool follows_velocity = false;  ///< Its servo holds `reference`.
    robot::GripperCommand gripper;
    Eigen::VectorXd push;                    ///< Nm: what pushes the arm, at its full strength …
    Eigen::VectorXd pushed;                  ///< … and in the last step.
    double push_begin = 0, push_end = -1e9;  ///< s
  };

  scene::Scene scene;  ///< With what objects have become.
  const std::map<std::string, std::shared_ptr<const robot::Model>> models;
  const WorldOptions options;

  int contact_room;  ///< Contacts that there is room for; grows when they get more.
  std::unique_ptr<mjModel_, DeleteMujoco> model;
  std::unique_ptr<mjData_, DeleteMujoco> data;
  std::vector<ObjectEntry> objects;
  std::vector<RobotEntry> robots;
  std::vector<int>
      owner;  ///< Per body: index of the object, or of the robot plus the number of objects; −1: world.
  std::map<int, Drive> drives;                       ///< By object.
  std::vector<double> acceleration, inertia_torque;  ///< Of all joints, for the velocity servo.
  long steps = 0;
  double target_time = 0;

  Impl(const scene::Scene& scene_in,
       const std::map<std::string, std::shared_ptr<const robot::Model>>& models_in,
       const WorldOptions& options_in);

  double time() const { return static_cast<double>(steps) * options.timestep; }
  /// Builds model and data from the scene with the objects where they are now, and keeps the state of all
  /// joints.
  void Compile();
  void FindIds();
  /// Index of an object; throws InputError with the nearest match.
  int ObjectIndex(const std::string& name) const;
  int OwnerIndex(const std::string& name) const;
  math::Pose ObjectPose(const ObjectEntry& object) const;
  void SetFreePose(const ObjectEntry& object, const math::Pose& X_WO);
  void SetFreeVelocity(const ObjectEntry& object, const math::Pose& X_WO, const math::Vector6d& V_WO);
  /// The fixed objects mounted on a fixed one, itself first.
  std::vector<int> Mounted(int object) const;

  void Step();
  void FollowDrives();
  void ApplyForces();
  void ActOnObjects();
  /// Index of an object that can be moved; throws InputError.
  int MovableIndex(const std::string& name) const;
  void ApplyPush(RobotEntry& robot);
  /// Torques of a robot's own velocity servo, which carries the arm's weight.
  void ServoVelocity(RobotEntry& robot);
  void CheckStable() const;
  /// Contacts or constraints were left out of the last step because there was no room for them.
  bool LacksRoom() const;
};

}  // namespace tether::sim
