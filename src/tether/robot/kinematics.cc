#include "tether/robot/kinematics.h"

#include <cassert>
#include <cmath>
#include <utility>

#include "tether/robot/model.h"

namespace tether::robot {

Kinematics::Kinematics(std::shared_ptr<const Model> model)
    : model_(std::move(model)),
      joints_(model_->chain().joints),
      q_(Eigen::VectorXd::Zero(dof())),
      X_BL_(joints_.size() + 1) {
  Set(model_->home());
}

void Kinematics::Set(const Eigen::Ref<const Eigen::VectorXd>& q) {
  assert(q.size() == dof());
  q_ = q;
  for (size_t i = 0; i < joints_.size(); ++i) {
    const Chain::Joint& joint = joints_[i];
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
  X_BH_ = X_BL_.back() * model_->chain().X_LH;
}

const math::Pose& Kinematics::X_BSolid(int solid) const {
  return solid == model_->solids().hand() ? X_BH_ : X_BL(LinkOf(solid));
}

int Kinematics::LinkOf(int solid) const {
  const ArmSolids& solids = model_->solids();
  return solid == solids.hand() ? dof() : solids.links[static_cast<size_t>(solid)].link;
}

void Kinematics::HandJacobian(Eigen::Ref<Eigen::MatrixXd> J) const {
  assert(J.rows() == 6 && J.cols() == dof());
  for (int i = 0; i < dof(); ++i) {
    const math::Pose& X_BJ = X_BL(i + 1);
    const Eigen::Vector3d axis = X_BJ.R.col(2);
    J.col(i).head<3>() = axis.cross(X_BH_.p - X_BJ.p);
    J.col(i).tail<3>() = axis;
  }
}

void Kinematics::HandBodyJacobian(Eigen::Ref<Eigen::MatrixXd> J) const {
  assert(J.rows() == 6 && J.cols() == dof());
  for (int i = 0; i < dof(); ++i) {
    const math::Pose& X_BJ = X_BL(i + 1);
    const Eigen::Vector3d axis = X_BJ.R.col(2);
    J.col(i).head<3>() = X_BH_.R.transpose() * axis.cross(X_BH_.p - X_BJ.p);
    J.col(i).tail<3>() = X_BH_.R.transpose() * axis;
  }
}

void Kinematics::PointJacobian(int link, const Eigen::Vector3d& p_BQ, Eigen::Ref<Eigen::MatrixXd> J) const {
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

void Kinematics::AlongNormal(int link, const Eigen::Vector3d& p_BQ, const Eigen::Vector3d& n_B,
                             Eigen::Ref<Eigen::RowVectorXd> row) const {
  assert(row.size() == dof() && link >= 0 && link <= dof());
  for (int i = 0; i < dof(); ++i) {
    const math::Pose& X_BJ = X_BL(i + 1);
    row[i] = i < link ? X_BJ.R.col(2).dot((p_BQ - X_BJ.p).cross(n_B)) : 0;
  }
}

}  // namespace tether::robot
