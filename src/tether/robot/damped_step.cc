#include "tether/robot/damped_step.h"

#include <Eigen/Cholesky>

namespace tether::robot {
namespace {

// Near a singular configuration the step stays bounded by this, at the price of slower convergence: m/rad.
constexpr double kDamping = 0.02;

}  // namespace

void TakeDampedStep(const Model& model, const Eigen::MatrixXd& J, const math::Vector6d& error,
                    double max_step, Eigen::VectorXd* step, Eigen::VectorXd* q) {
  math::Matrix6d JJt;
  JJt.noalias() = J * J.transpose();
  JJt.diagonal().array() += kDamping * kDamping;
  math::Vector6d drift;
  drift.noalias() = J * *step;
  const math::Vector6d y = JJt.ldlt().solve(error - drift);
  step->noalias() += J.transpose() * y;
  const double largest = step->cwiseAbs().maxCoeff();
  if (largest > max_step) *step *= max_step / largest;
  *q = (*q + *step).cwiseMax(model.lower()).cwiseMin(model.upper());
}

}  // namespace tether::robot
