#include "tether/robot/damped_step.h"

#include <gtest/gtest.h>

#include "tether/common/random.h"
#include "tether/math/pose_error.h"

namespace tether::robot {
namespace {

// The law that defines it, with dense algebra: the damped normal equations, for the part within the row
// space.
TEST(DampedStepTest, SolvesTheDampedNormalEquations) {
  const auto model = Model::Load("panda");
  State state(model);
  Random random(3);
  const Eigen::VectorXd zero = Eigen::VectorXd::Zero(model->dof());
  for (int k = 0; k < 50; ++k) {
    Eigen::VectorXd q = model->home(), step = zero;
    for (int i = 0; i < q.size(); ++i) {
      q[i] += random.Uniform(-0.2, 0.2);
      step[i] = k % 2 == 0 ? 0 : random.Uniform(-0.01, 0.01);
    }
    state.Set(q, zero);
    math::Vector6d error;
    for (int i = 0; i < 6; ++i) error[i] = random.Uniform(-0.01, 0.01);
    const Eigen::MatrixXd J = state.J_BH();
    const Eigen::MatrixXd H =
        J.transpose() * J + 0.02 * 0.02 * Eigen::MatrixXd::Identity(model->dof(), model->dof());
    const Eigen::VectorXd wanted = step + H.ldlt().solve(J.transpose() * (error - J * step));
    const Eigen::VectorXd before = q;
    TakeDampedStep(*model, J, error, 10, &step, &q);
    EXPECT_LT((step - wanted).norm(), 1e-9);
    EXPECT_LT((q - before - step).norm(), 1e-12);
    // A short leash keeps the direction.
    Eigen::VectorXd cut = k % 2 == 0 ? zero : Eigen::VectorXd(zero), there = before;
    TakeDampedStep(*model, J, error, 1e-4, &cut, &there);
    EXPECT_NEAR(cut.cwiseAbs().maxCoeff(), 1e-4, 1e-12);
  }
}

TEST(DampedStepTest, LeadsToThePoseAndStaysWithinTheLimits) {
  const auto model = Model::Load("panda");
  State state(model);
  const Eigen::VectorXd zero = Eigen::VectorXd::Zero(model->dof());
  Eigen::VectorXd q = model->home(), step = zero;
  state.Set(q, zero);
  const math::Pose X_BH(state.X_BH().R, state.X_BH().p + Eigen::Vector3d(0.1, -0.15, 0.05));
  for (int i = 0; i < 60; ++i) {
    state.Set(q, zero);
    step.setZero();
    TakeDampedStep(*model, state.J_BH(), math::PoseError(state.X_BH(), X_BH), 0.3, &step, &q);
    EXPECT_LE((q - model->upper()).maxCoeff(), 0);
    EXPECT_LE((model->lower() - q).maxCoeff(), 0);
  }
  state.Set(q, zero);
  EXPECT_LT(math::PoseError(state.X_BH(), X_BH).norm(), 1e-6);
}

}  // namespace
}  // namespace tether::robot
