#include "tether/control/torque/link_motion.h"

namespace tether::control {

void LinkMotion::Set(const robot::Kinematics& kinematics, const Eigen::VectorXd& v) {
  using Eigen::Vector3d;
  links_[0] = {Vector3d::Zero(), Vector3d::Zero(), Vector3d::Zero(), Vector3d::Zero(), Vector3d::Zero()};
  for (int i = 0; i < kinematics.dof(); ++i) {
    const Link& parent = links_[static_cast<size_t>(i)];
    Link& link = links_[static_cast<size_t>(i + 1)];
    const math::Pose& X_BL = kinematics.X_BL(i + 1);
    const Vector3d turn = X_BL.R.col(2) * v[i];
    const Vector3d r = X_BL.p - parent.p;
    link.p = X_BL.p;
    link.v = parent.v + parent.w.cross(r);
    link.a = parent.a + parent.alpha.cross(r) + parent.w.cross(parent.w.cross(r));
    link.w = parent.w + turn;
    link.alpha = parent.alpha + parent.w.cross(turn);
  }
}

}  // namespace tether::control
