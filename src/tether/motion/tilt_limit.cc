#include "tether/motion/tilt_limit.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include <Eigen/Cholesky>

#include "tether/common/limits.h"
#include "tether/common/text.h"
#include "tether/robot/model.h"

namespace tether::motion {
namespace {

using Eigen::Vector3d;
using Eigen::VectorXd;

// A configuration is moved until the angle is this share of the limit, by no more than so many steps.
constexpr double kWellWithin = 0.5;
constexpr int kSteps = 12;
constexpr double kDamping = 1e-4;

}  // namespace

TiltManifold::TiltManifold(std::shared_ptr<const robot::Model> model, const TiltLimit& limit)
    : limit_(limit), kinematics_(std::move(model)), J_(6, kinematics_.model().dof()) {}

double TiltManifold::Angle(const VectorXd& q) {
  kinematics_.Set(q);
  const Vector3d axis_B = kinematics_.X_BH().R * limit_.axis_H;
  return std::atan2(axis_B.cross(limit_.direction_B).norm(), axis_B.dot(limit_.direction_B));
}

bool TiltManifold::Project(VectorXd* q) {
  for (int step = 0; step < kSteps; ++step) {
    const double angle = Angle(*q);
    const double excess = angle - kWellWithin * limit_.max;
    if (excess <= 1e-6) return true;
    const Vector3d axis_B = kinematics_.X_BH().R * limit_.axis_H;
    Vector3d about = axis_B.cross(limit_.direction_B);
    if (about.norm() < 1e-9) about = axis_B.unitOrthogonal();
    const Vector3d turn = about.normalized() * std::min(excess, 1.0);
    kinematics_.HandJacobian(J_);
    const Eigen::MatrixXd J = J_.bottomRows(3);
    Eigen::Matrix3d JJt = J * J.transpose();
    JJt.diagonal().array() += kDamping;
    *q += J.transpose() * JJt.ldlt().solve(turn);
  }
  return Holds(*q);
}

bool TiltChecker::IsFree(const VectorXd& a, const VectorXd& b) {
  const int steps = std::max(1, static_cast<int>(std::ceil((b - a).cwiseAbs().maxCoeff() / resolution_)));
  for (int i = steps; i > 0; --i) {
    PollLimits();
    ++checks_;
    if (!manifold_.Holds(a + (b - a) * (static_cast<double>(i) / steps))) return false;
  }
  return inner_.IsFree(a, b);
}

std::string TiltChecker::Why(const VectorXd& q) const {
  const double angle = manifold_.Angle(q);
  if (angle <= manifold_.limit().max) return inner_.Why(q);
  return "what is held is tilted by " + Fixed(angle * 180 / std::numbers::pi, 1) + " degrees";
}

}  // namespace tether::motion
