#pragma once

#include <memory>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "tether/geometry/shape.h"
#include "tether/math/pose.h"
#include "tether/robot/gravity.h"

namespace tether::robot {

struct ArmSolids;
struct Chain;

/// A gripper, described in the hand frame: origin at the grasp point midway between the pads, z the approach
/// direction (out of the palm), y the closing axis. Its fingers slide (a parallel gripper, whose opening is
/// the sum of their positions) or turn on hinges (whose opening goes linearly from `closed` to `open`).
struct Gripper {
  double max_opening = 0;      ///< Greatest distance between the pads, m.
  double max_width = 0;        ///< The widest object that it grasps firmly, m.
  double pad_half_width = 0;   ///< Half the pad's extent along x, m.
  double pad_half_height = 0;  ///< Half the pad's extent along z, m.
  double palm_depth = 0;       ///< From the grasp point back to the palm's face, m.
  double max_force = 0;        ///< N at each pad.
  double pad_friction = 0.8;   ///< Coulomb coefficient: the greatest of the fingers' geoms in the MJCF file.
  /// Per finger that turns on a hinge; empty for fingers that slide.
  std::vector<double> open, closed;    ///< rad, at `max_opening` and at an opening of zero
  std::vector<double> closing_torque;  ///< Nm, at `max_force`

  bool hinged() const { return !open.empty(); }
  /// A finger's joint position (m or rad) at this opening (m) of `fingers` fingers.
  double FingerPosition(size_t finger, size_t fingers, double opening) const;
  /// The share of the opening (m) that a finger at this position (m or rad) contributes; their sum is the
  /// opening.
  double OpeningShare(size_t finger, size_t fingers, double position) const;
};

/// An outer approximation of the arm's reach, without joint angles: the wrist point, fixed in the hand frame,
/// is between `min` and `max` from `centre`, fixed in the base frame.
struct Reach {
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();      ///< In the base frame, m.
  Eigen::Vector3d wrist_hand = Eigen::Vector3d::Zero();  ///< The wrist point in the hand frame, m.
  double min = 0;                                        ///< m
  double max = 0;                                        ///< m
};

/// A proved bound on the arm's reach, from the lengths of the links alone: a point fixed in the hand is never
/// further than `radius` from `centre`, fixed in the base frame.
struct OuterReach {
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();  ///< On the first joint's axis, m.
  Eigen::Vector3d p_HW = Eigen::Vector3d::Zero();    ///< On the last joint's axis, in the hand frame, m.
  double radius = 0;                                 ///< m
};

/// One arm with its gripper: an immutable model, shared freely between threads. Kinematics and dynamics come
/// from MuJoCo; what changes per configuration lives in State.
class Model {
 public:
  /// Loads a robot description (format `tether.robot/1`): the name of a shipped model ("panda"), or a path to
  /// a YAML file (anything with a folder or ending in .yaml). Throws InputError with what is wrong and which
  /// models there are. The format is documented at the top of models/robots/panda.yaml.
  static std::shared_ptr<const Model> Load(const std::string& name_or_path);

  ~Model();
  Model(const Model&) = delete;
  Model& operator=(const Model&) = delete;

  const std::string& name() const;
  int dof() const;  ///< n, arm joints without the fingers.
  const std::vector<std::string>& joint_names() const;
  const Eigen::VectorXd& lower() const;  ///< n, rad
  const Eigen::VectorXd& upper() const;  ///< n, rad
  /// n, rad: the range within the limits that planned configurations keep, such as an elbow bent to one side.
  const Eigen::VectorXd& planned_lower() const;
  const Eigen::VectorXd& planned_upper() const;
  const Eigen::VectorXd& max_velocity() const;      ///< n, rad/s
  const Eigen::VectorXd& max_torque() const;        ///< n, Nm
  const Eigen::VectorXd& max_torque_rate() const;   ///< n, Nm/s: what a controller's torques may change by.
  const Eigen::VectorXd& max_acceleration() const;  ///< n, rad/s²
  const Eigen::VectorXd& max_jerk() const;          ///< n, rad/s³
  const Eigen::VectorXd& home() const;  ///< n, rad: where a robot without `q` in its scenario starts.
  const Gripper& gripper() const;
  const Reach& reach() const;
  /// The hand as a solid for planning, in the hand frame, with the fingers `opening` apart (m): the palm,
  /// then the fingers. Smooth where it comes near things: sliding fingers are capsules along z (ERRATA A12);
  /// those on hinges have the shapes of the MJCF file. The number of parts does not depend on `opening`.
  geometry::Shape HandShape(double opening) const;

  /// The arm's joints and links without dynamics (kinematics.h), and their solids.
  const Chain& chain() const;
  const OuterReach& outer_reach() const;
  const ArmSolids& solids() const;

  /// The MuJoCo description that the simulation builds on: file text and path.
  const std::string& mjcf() const;
  const std::string& mjcf_path() const;
  /// The description's own names: hand site, arm joints in order, finger joints.
  const std::string& hand_site() const;
  const std::vector<std::string>& finger_joints() const;

 private:
  friend class State;
  struct Impl;
  explicit Model(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

/// The kinematics and dynamics of a model at one configuration; the mutable part, one per thread. Poses are
/// in the robot's base frame B. Set() allocates nothing.
class State {
 public:
  /// Set to `home`, at rest. `gravity_B` is the gravity acceleration in the base frame, m/s²: for a base that
  /// is mounted tilted, R_WBᵀ (0, 0, −kGravity).
  explicit State(std::shared_ptr<const Model> model,
                 const Eigen::Vector3d& gravity_B = Eigen::Vector3d(0, 0, -kGravity));
  ~State();
  State(State&&) noexcept;
  State& operator=(State&&) noexcept;

  /// Sets joint positions (rad) and velocities (rad/s), both of size n, and computes everything below.
  void Set(const Eigen::VectorXd& q, const Eigen::VectorXd& v);

  const Model& model() const;
  const Eigen::VectorXd& q() const;
  const Eigen::VectorXd& v() const;
  const math::Pose& X_BH() const;  ///< Pose of the hand (grasp point) in the base frame.
  /// 6 × n: (velocity of the hand's origin; angular velocity), both in the base frame, is J v.
  const Eigen::MatrixXd& J_BH() const;
  const Eigen::MatrixXd& M()
      const;  ///< n × n joint-space inertia, kg m²; with the fingers fixed to the hand, closed.
  const Eigen::VectorXd& bias() const;  ///< n, Nm: Coriolis, centrifugal and gravity torques.

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// The folder that holds shipped data (`models/`, `scenarios/`): beside the sources in a build tree, or as
/// installed. The environment variable TETHER_DATA_DIR overrides it.
std::string DataDirectory();

}  // namespace tether::robot
