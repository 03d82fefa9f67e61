#pragma once

#include <array>

#include <Eigen/Core>

#include "tether/control/torque/distance_acceleration.h"
#include "tether/robot/kinematics.h"

namespace tether::control {

/// How the links of an arm move, in its base frame: velocities, and what accelerations are where the joints
/// do not accelerate (J̇ q̇). A value that allocates nothing.
class LinkMotion {
 public:
  /// `kinematics` must be set to the configuration and outlive what is asked here; `v`: n, rad/s.
  void Set(const robot::Kinematics& kinematics, const Eigen::VectorXd& v);

  /// The point p of a link, 0 … n, base frame.
  PointMotion At(int link, const Eigen::Vector3d& p) const {
    const Link& l = links_[static_cast<size_t>(link)];
    return {l.v + l.w.cross(p - l.p), l.w};
  }
  /// J̇ q̇ of the point p of a link, m/s²: its material point's acceleration without q̈.
  Eigen::Vector3d PointBias(int link, const Eigen::Vector3d& p) const {
    const Link& l = links_[static_cast<size_t>(link)];
    const Eigen::Vector3d r = p - l.p;
    return l.a + l.alpha.cross(r) + l.w.cross(l.w.cross(r));
  }
  /// J̇ q̇ of a link's angular velocity, rad/s².
  const Eigen::Vector3d& AngularBias(int link) const { return links_[static_cast<size_t>(link)].alpha; }

 private:
  struct Link {
    Eigen::Vector3d p, v, w, a, alpha;
  };
  std::array<Link, robot::kMostJoints + 1> links_;
};

}  // namespace tether::control
