#include "tether/robot/kinematics.h"

#include <cassert>
#include <cmath>
#include <utility>

#include "tether/robot/model.h"

namespace tether::robot {

OuterReach FindOuterReach(const Chain& chain) {
  const size_t n = chain.joints.size();
  // Point i lies on axis i, along[i] from Li's origin: fixed both in Li and in Li-1.
  std::vector<double> along(n, 0.0);
  const auto piece = [&](size_t i) {  // from point i to point i + 1, in Li
    const math::Pose& X = chain.joints[i + 1].X_PJ;
    return Eigen::Vector3d(X.p + along[i + 1] * X.R.col(2) - along[i] * Eigen::Vector3d::UnitZ());
  };
  const auto length = [&] {
    double sum = 0;
    for (size_t i = 0; i + 1 < n; ++i) sum += piece(i).norm();
    return sum;
  };
  // The length is convex in the points; coordinate by coordinate, with steps that halve.
  double best = length();
  for (double step = 0.5; step > 1e-6;) {
    bool better = false;
    for (size_t i = 0; i < n; ++i) {
      for (const double move : {step, -step}) {
        along[i] += move;
        const double now = length();
        if (now < best - 1e-12) {
          best = now;
          better = true;
        } else {
          along[i] -= move;
        }
      }
    }
    if (!better) step /= 2;
  }
  OuterReach reach;
  if (n == 0) return reach;
  const math::Pose& first = chain.joints.front().X_PJ;
  reach.centre = first.p + along[0] * first.R.col(2);
  reach.p_HW = chain.X_LH.Inverse() * Eigen::Vector3d(0, 0, along[n - 1]);
  reach.radius = best;
  return reach;
}

void LinkPoses::Set(const Eigen::Ref<const Eigen::VectorXd>& q) {
  const std::vector<Chain::Joint>& joints = chain_->joints;
  assert(q.size() == dof() && dof() <= kMostJoints);
  for (size_t i = 0; i < joints.size(); ++i) {
    const Chain::Joint& joint = joints[i];
    const math::Pose& X_BP = X_BL_[i];
    math::Pose& X_BJ = X_BL_[i + 1];
    const double angle = q[static_cast<Eigen::Index>(i)] - joint.reference;
    const double c = std::cos(angle), s = std::sin(angle);
    X_BJ.p = X_BP.R * joint.X_PJ.p + X_BP.p;
    const Eigen::Matrix3d R = X_BP.R * joint.X_PJ.R;
    X_BJ.R.col(0) = c * R.col(0) + s * R.col(1);
    X_BJ.R.col(1) = c * R.col(1) - s * R.col(0);
    X_BJ.R.col(2) = R.col(2);
  }
  X_BH_ = X_BL_[joints.size()] * chain_->X_LH;
}

Kinematics::Kinematics(std::shared_ptr<const Model> model)
    : model_(std::move(model)), q_(model_->home()), poses_(model_->chain(), q_) {}

void Kinematics::Set(const Eigen::Ref<const Eigen::VectorXd>& q) {
  q_ = q;
  poses_.Set(q);
}

const math::Pose& Kinematics::X_BSolid(int solid) const {
  return solid == model_->solids().hand() ? X_BH() : X_BL(LinkOf(solid));
}

int Kinematics::LinkOf(int solid) const {
  const ArmSolids& solids = model_->solids();
  return solid == solids.hand() ? dof() : solids.links[solid].link;
}

void LinkPoses::HandJacobian(Eigen::Ref<Eigen::MatrixXd> J) const {
  assert(J.rows() == 6 && J.cols() == dof());
  for (int i = 0; i < dof(); ++i) {
    const math::Pose& X_BJ = X_BL(i + 1);
    const Eigen::Vector3d axis = X_BJ.R.col(2);
    J.col(i).head<3>() = axis.cross(X_BH_.p - X_BJ.p);
    J.col(i).tail<3>() = axis;
  }
}

void LinkPoses::HandBodyJacobian(Eigen::Ref<Eigen::MatrixXd> J) const {
  assert(J.rows() == 6 && J.cols() == dof());
  for (int i = 0; i < dof(); ++i) {
    const math::Pose& X_BJ = X_BL(i + 1);
    const Eigen::Vector3d axis = X_BJ.R.col(2);
    J.col(i).head<3>() = X_BH_.R.transpose() * axis.cross(X_BH_.p - X_BJ.p);
    J.col(i).tail<3>() = X_BH_.R.transpose() * axis;
  }
}

void LinkPoses::PointJacobian(int link, const Eigen::Vector3d& p_BQ, Eigen::Ref<Eigen::MatrixXd> J) const {
  assert(J.rows() == 3 && J.cols() == dof() && link >= 0 && link <= dof());
  for (int i = 0; i < dof(); ++i) {
    const math::Pose& X_BJ = X_BL(i + 1);
    if (i < link) {
      J.col(i) = X_BJ.R.col(2).cross(p_BQ - X_BJ.p);
    } else {
      J.col(i).setZero();
    }
  }
}

void LinkPoses::AlongNormal(int link, const Eigen::Vector3d& p_BQ, const Eigen::Vector3d& n_B,
                            RowRef row) const {
  assert(row.size() == dof() && link >= 0 && link <= dof());
  for (int i = 0; i < dof(); ++i) {
    const math::Pose& X_BJ = X_BL(i + 1);
    row[i] = i < link ? X_BJ.R.col(2).dot((p_BQ - X_BJ.p).cross(n_B)) : 0;
  }
}

}  // namespace tether::robot
