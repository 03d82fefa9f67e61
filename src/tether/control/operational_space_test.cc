#include "tether/control/operational_space.h"

#include <cmath>
#include <cstdlib>
#include <limits>
#include <numbers>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <Eigen/Cholesky>

#include "tether/common/error.h"
#include "tether/common/random.h"

namespace tether::control {
namespace {

using math::Pose;
using math::Vector6d;

// The arm alone, integrated semi-implicitly from its own equations of motion.
class Arm {
 public:
  Arm()
      : model_(robot::Model::Load("panda")),
        state_(model_),
        q_(model_->home()),
        v_(Eigen::VectorXd::Zero(7)) {
    state_.Set(q_, v_);
  }

  void Put(const Eigen::VectorXd& q) {
    q_ = q;
    v_.setZero();
    state_.Set(q_, v_);
  }
  void Step(const Eigen::VectorXd& torque, double dt = 0.001) {
    v_ += dt * state_.M().llt().solve(torque - state_.bias());
    q_ += dt * v_;
    state_.Set(q_, v_);
  }
  double LimitRoom() const {
    return std::min((q_ - model_->lower()).minCoeff(), (model_->upper() - q_).minCoeff());
  }
  double SpeedShare() const { return v_.cwiseAbs().cwiseQuotient(model_->max_velocity()).maxCoeff(); }

  std::shared_ptr<const robot::Model> model_;
  robot::State state_;
  Eigen::VectorXd q_, v_;
};

Vector6d HandVelocity(const Arm& arm) { return arm.state_.J_BH() * arm.v_; }

TEST(OperationalSpace, ConvergesToAPose) {
  Random random(1);
  for (int trial = 0; trial < 5; ++trial) {
    Arm arm;
    OperationalSpaceController controller(arm.model_, {}, arm.model_->home());
    HandTarget target;
    target.X_BH = arm.state_.X_BH();
    target.X_BH.p +=
        Eigen::Vector3d(random.Uniform(-0.1, 0.2), random.Uniform(-0.2, 0.2), random.Uniform(-0.2, 0.2));
    target.X_BH.R = math::ExpSO3(Eigen::Vector3d(random.Uniform(-0.2, 0.2), random.Uniform(-0.2, 0.2),
                                                 random.Uniform(-1, 1))) *
                    target.X_BH.R;
    for (int i = 0; i < 3000; ++i) {
      arm.Step(controller.Compute(arm.state_, target));
      ASSERT_FALSE(controller.flags().fault);
      ASSERT_LE(arm.SpeedShare(), 1.05);
    }
    EXPECT_LT((arm.state_.X_BH().p - target.X_BH.p).norm(), 5e-4);
    EXPECT_LT(math::AngleBetween(arm.state_.X_BH().R, target.X_BH.R), 2e-3);
    EXPECT_LT(HandVelocity(arm).norm(), 1e-3);
  }
}

// Without feed-forward the hand would lag by v k_v / k_p = 1 cm.
TEST(OperationalSpace, TracksAMovingTargetWithoutLag) {
  Arm arm;
  OperationalSpaceController controller(arm.model_, {}, arm.model_->home());
  HandTarget target;
  target.X_BH = arm.state_.X_BH();
  target.V_BH << 0.05, 0.08, -0.03, 0, 0, 0.2;
  double worst = 0;
  double worst_angle = 0;
  for (int i = 0; i < 2500; ++i) {
    if (i > 800) {
      worst = std::max(worst, (arm.state_.X_BH().p - target.X_BH.p).norm());
      worst_angle = std::max(worst_angle, math::AngleBetween(arm.state_.X_BH().R, target.X_BH.R));
    }
    arm.Step(controller.Compute(arm.state_, target));
    target.X_BH.p += 0.001 * target.V_BH.head<3>();
    target.X_BH.R = math::ExpSO3(0.001 * target.V_BH.tail<3>()) * target.X_BH.R;
  }
  EXPECT_LT(worst, 1e-3);
  EXPECT_LT(worst_angle, 5e-3);
}

// Dynamic consistency: the null space moves the joints, not the hand.
TEST(OperationalSpace, PostureDoesNotMoveTheHand) {
  Arm arm;
  Eigen::VectorXd posture = arm.model_->home();
  posture[0] += 0.5;
  posture[2] -= 0.5;
  OperationalSpaceController with(arm.model_, {}, posture);
  OperationalSpaceController without(arm.model_, {}, arm.model_->home());
  HandTarget target;
  target.X_BH = arm.state_.X_BH();
  const Eigen::VectorXd difference = with.Compute(arm.state_, target) - without.Compute(arm.state_, target);
  EXPECT_GT(difference.norm(), 0.1);
  const Vector6d acceleration = arm.state_.J_BH() * arm.state_.M().llt().solve(difference);
  EXPECT_LT(acceleration.norm(), 1e-6);
}

TEST(OperationalSpace, ExertsTheForceAsked) {
  Arm arm;
  OperationalSpaceController controller(arm.model_, {}, arm.model_->home());
  HandTarget target;
  target.X_BH = arm.state_.X_BH();
  const Eigen::VectorXd before = controller.Compute(arm.state_, target);
  target.F_BH << 1, -2, 3, 0.1, 0.2, -0.3;
  const Eigen::VectorXd after = controller.Compute(arm.state_, target);
  EXPECT_LT((after - before - arm.state_.J_BH().transpose() * target.F_BH).norm(), 1e-9);
}

// Targets far outside the reach, in every direction: joints stay inside limits, torques and velocities too.
TEST(OperationalSpace, KeepsLimitsAndSurvivesSingularities) {
  Random random(2);
  for (int trial = 0; trial < 20; ++trial) {
    Arm arm;
    OperationalSpaceController controller(arm.model_, {}, arm.model_->home());
    HandTarget target;
    const Eigen::Vector3d direction(random.Normal(), random.Normal(), random.Normal());
    target.X_BH.p = Eigen::Vector3d(0, 0, 0.333) + 1.5 * direction.normalized();
    target.X_BH.R = math::ExpSO3(Eigen::Vector3d(random.Normal(), random.Normal(), random.Normal()));
    bool singular = false;
    for (int i = 0; i < 4000; ++i) {
      const Eigen::VectorXd& torque = controller.Compute(arm.state_, target);
      ASSERT_TRUE(torque.allFinite());
      ASSERT_LE(torque.cwiseAbs().cwiseQuotient(arm.model_->max_torque()).maxCoeff(), 1 + 1e-12);
      singular = singular || controller.flags().singular;
      arm.Step(torque);
      ASSERT_GT(arm.LimitRoom(), -0.02) << "trial " << trial << " step " << i;
      ASSERT_LE(arm.SpeedShare(), 1.1) << "trial " << trial << " step " << i;
    }
    EXPECT_LT(arm.v_.norm(), 0.5) << "trial " << trial;
  }
}

TEST(OperationalSpace, StretchedArmIsSafe) {
  Arm arm;
  Eigen::VectorXd q = arm.model_->home();
  q << 0, 0.3, 0, -0.08, 0, 1.0, 0;
  arm.Put(q);
  OperationalSpaceController controller(arm.model_, {}, arm.model_->home());
  HandTarget target;
  target.X_BH = arm.state_.X_BH();
  target.X_BH.p *= 1.3;
  for (int i = 0; i < 2000; ++i) {
    arm.Step(controller.Compute(arm.state_, target));
    ASSERT_LE(arm.SpeedShare(), 1.1);
  }
  // And it comes back.
  arm.Put(q);
  target.X_BH.p = Eigen::Vector3d(0.45, 0.1, 0.4);
  target.X_BH.R = math::RotationFromRpy({std::numbers::pi, 0, 0});
  for (int i = 0; i < 5000; ++i) arm.Step(controller.Compute(arm.state_, target));
  EXPECT_LT((arm.state_.X_BH().p - target.X_BH.p).norm(), 2e-3);
}

// A long pull at a tilt ran into a joint limit by drift in the null space.
TEST(OperationalSpace, NullSpaceKeepsAwayFromLimits) {
  Arm arm;
  Eigen::VectorXd posture = arm.model_->home();
  posture[3] = arm.model_->lower()[3];
  posture[2] = arm.model_->upper()[2];
  OperationalSpaceController controller(arm.model_, {}, posture);
  HandTarget target;
  target.X_BH = arm.state_.X_BH();
  target.X_BH.p += Eigen::Vector3d(0.2, 0, 0);
  double least = std::numeric_limits<double>::infinity();
  for (int i = 0; i < 8000; ++i) {
    arm.Step(controller.Compute(arm.state_, target));
    least = std::min(least, arm.LimitRoom());
  }
  EXPECT_GT(least, 0.1);
  EXPECT_LT((arm.state_.X_BH().p - target.X_BH.p).norm(), 2e-3);
}

TEST(OperationalSpace, DampsMotionTowardAnObstacle) {
  Arm arm;
  OperationalSpaceController controller(arm.model_, {}, arm.model_->home());
  HandTarget target;
  target.X_BH = arm.state_.X_BH();
  arm.v_[0] = 0.3;
  arm.state_.Set(arm.q_, arm.v_);
  const Eigen::Vector3d along = HandVelocity(arm).head<3>().normalized();
  const Eigen::VectorXd plain = controller.Compute(arm.state_, target);
  target.toward_obstacle = -along;
  EXPECT_EQ(controller.Compute(arm.state_, target), plain) << "moving away is free";
  target.toward_obstacle = along;
  const Eigen::VectorXd braked = controller.Compute(arm.state_, target) - plain;
  const Vector6d acceleration = arm.state_.J_BH() * arm.state_.M().llt().solve(braked);
  const double speed = HandVelocity(arm).head<3>().norm();
  EXPECT_NEAR(acceleration.head<3>().dot(along), -OperationalSpaceGains().obstacle_damping * speed, 1e-6);
}

TEST(OperationalSpace, NotFiniteMeansBrakeAndCarryGravity) {
  Arm arm;
  OperationalSpaceController controller(arm.model_, {}, arm.model_->home());
  HandTarget target;
  target.X_BH = arm.state_.X_BH();
  controller.Compute(arm.state_, target);
  const Eigen::VectorXd gravity = arm.state_.bias();

  target.X_BH.p.x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_LT((controller.Compute(arm.state_, target) - gravity).norm(), 1e-12);
  EXPECT_TRUE(controller.flags().fault);

  target.X_BH = arm.state_.X_BH();
  Eigen::VectorXd q = arm.q_;
  q[2] = std::numeric_limits<double>::quiet_NaN();
  arm.state_.Set(q, arm.v_);
  EXPECT_LT((controller.Compute(arm.state_, target) - gravity).norm(), 1e-12);
  EXPECT_TRUE(controller.flags().fault);

  Eigen::VectorXd v = Eigen::VectorXd::Zero(7);
  v[1] = 1;
  arm.state_.Set(arm.q_, v);
  target.V_BH[0] = std::numeric_limits<double>::infinity();
  EXPECT_LT(controller.Compute(arm.state_, target)[1], arm.state_.bias()[1]);

  target.V_BH.setZero();
  controller.Compute(arm.state_, target);
  EXPECT_FALSE(controller.flags().fault);
}

TEST(OperationalSpaceGains, NamesEveryWrongField) {
  OperationalSpaceGains gains;
  gains.Validate();
  gains.position = 0;
  gains.posture_damping = -1;
  gains.limit_margin = std::numeric_limits<double>::infinity();
  try {
    gains.Validate();
    FAIL() << "accepted";
  } catch (const InputError& error) {
    EXPECT_EQ(error.diagnostics().size(), 3u);
    EXPECT_THAT(error.what(), testing::HasSubstr("'position' of the operational-space controller is 0"));
    EXPECT_THAT(error.what(),
                testing::HasSubstr("'posture_damping' of the operational-space controller is -1"));
    EXPECT_THAT(error.what(), testing::HasSubstr("a finite number above zero"));
  }
}

}  // namespace
}  // namespace tether::control
