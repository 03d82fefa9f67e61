#include "tether/control/torque/link_motion.h"

#include <gtest/gtest.h>

#include "tether/common/random.h"
#include "tether/control/torque/singularity.h"
#include "tether/robot/model.h"

namespace tether::control {
namespace {

using Eigen::Vector3d;
using Eigen::VectorXd;

TEST(LinkMotion, VelocitiesAndBiasesAreDerivatives) {
  for (const char* name : {"panda", "j2n6s300"}) {
    const auto model = robot::Model::Load(name);
    robot::Kinematics now(model), after(model), before(model);
    Random random(3);
    for (int trial = 0; trial < 20; ++trial) {
      VectorXd q(model->dof()), v(model->dof());
      for (int i = 0; i < model->dof(); ++i) {
        q[i] = random.Uniform(-1.5, 1.5);
        v[i] = random.Uniform(-2, 2);
      }
      const double h = 1e-5;
      now.Set(q);
      after.Set(q + h * v);
      before.Set(q - h * v);
      LinkMotion motion;
      motion.Set(now, v);
      for (int link = 0; link <= model->dof(); ++link) {
        const Vector3d p_LQ(0.1, -0.05, 0.2);
        const Vector3d p = now.X_BL(link) * p_LQ;
        const Vector3d p_after = after.X_BL(link) * p_LQ, p_before = before.X_BL(link) * p_LQ;
        EXPECT_LT((motion.At(link, p).v - (p_after - p_before) / (2 * h)).norm(), 1e-7);
        EXPECT_LT((motion.PointBias(link, p) - (p_after - 2 * p + p_before) / (h * h)).norm(), 1e-4);
        LinkMotion later, earlier;
        later.Set(after, v);
        earlier.Set(before, v);
        EXPECT_LT((motion.AngularBias(link) - (later.At(link, p).w - earlier.At(link, p).w) / (2 * h)).norm(),
                  1e-7);
      }
    }
  }
}

// The gradient is the derivative of the manipulability, whatever the arm.
TEST(Dexterity, TheGradientIsTheDerivativeOfTheManipulability) {
  for (const char* name : {"panda", "j2n6s300"}) {
    const auto model = robot::Model::Load(name);
    const int n = model->dof();
    robot::Kinematics kinematics(model);
    Eigen::MatrixXd J(6, n);
    const double length = 0.2;
    const auto log_manipulability = [&](const VectorXd& q) {
      kinematics.Set(q);
      kinematics.HandJacobian(J);
      Eigen::MatrixXd scaled = J;
      scaled.bottomRows(3) *= length;
      return 0.5 * std::log((scaled * scaled.transpose()).determinant());
    };
    Random random(8);
    for (int trial = 0; trial < 20; ++trial) {
      VectorXd q = model->home();
      for (int i = 0; i < n; ++i) q[i] += random.Uniform(-0.5, 0.5);
      VectorXd numeric(n);
      for (int i = 0; i < n; ++i) {
        const VectorXd step = 1e-5 * VectorXd::Unit(n, i);
        numeric[i] = (log_manipulability(q + step) - log_manipulability(q - step)) / 2e-5;
      }
      kinematics.Set(q);
      kinematics.HandJacobian(J);
      const Dexterity dexterity = FindDexterity(kinematics, J, length);
      EXPECT_LT((dexterity.gradient - numeric).norm(), 1e-4 * (1 + numeric.norm())) << name;
      EXPECT_GT(dexterity.least, 0);
    }
  }
}

}  // namespace
}  // namespace tether::control
