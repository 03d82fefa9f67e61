#pragma once

#include <memory>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "tether/robot/kinematics.h"
#include "tether/robot/model.h"

struct mjModel_;

namespace tether {
class Diagnostics;
class Value;
}  // namespace tether

namespace tether::robot {

/// The hand's solid for planning, in the hand frame. See models/robots/panda.yaml.
struct HandSolid {
  geometry::Part palm;
  double finger_radius = 0;
  double finger_outward = 0;
  double finger_from = 0;
  double finger_to = 0;
};

struct Model::Impl {
  struct DeleteModel {
    void operator()(mjModel_* model) const;
  };

  // model.cc: the parts of Load(). Mistakes go to `diagnostics`; `root` is the description.
  /// Reads everything but the MJCF file, whose path is returned as it is written.
  std::string ReadDescription(const Value& root, Diagnostics& diagnostics);
  /// Compiles the MJCF file at `mjcf_path`. Throws InputError if MuJoCo refuses it.
  void LoadMjcf(const Value& root, Diagnostics& diagnostics);
  /// The ids of the arm's joints in the MJCF file, those that are found; sets addresses and limits.
  std::vector<int> FindJoints(const Value& root, Diagnostics& diagnostics);
  /// The ids of the gripper's joints in the MJCF file.
  std::vector<int> FindFingers(const Value& root, Diagnostics& diagnostics) const;

  std::string name;
  std::vector<std::string> joints;
  std::vector<std::string> finger_joints;
  std::string hand_site;
  Eigen::VectorXd lower, upper, planned_lower, planned_upper, max_velocity, max_torque, home;
  Eigen::VectorXd max_torque_rate, max_acceleration, max_jerk;
  Gripper gripper;
  Reach reach;
  HandSolid solid;
  Chain chain;
  ArmSolids solids;
  OuterReach outer_reach;
  std::string mjcf;
  std::string mjcf_path;

  std::unique_ptr<mjModel_, DeleteModel> mujoco;
  int site_id = -1;
  std::vector<int> qpos_address;  ///< Per arm joint.
  std::vector<int> dof_address;   ///< Per arm joint.
};

}  // namespace tether::robot
