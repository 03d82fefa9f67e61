#include "tether/control/load_estimator.h"

#include <gtest/gtest.h>

#include "tether/common/random.h"
#include "tether/robot/gravity.h"

namespace tether::control {
namespace {

using Eigen::Vector3d;
using Eigen::VectorXd;

class LoadEstimatorTest : public ::testing::Test {
 protected:
  LoadEstimatorTest() {
    for (int i = 0; i < 7; ++i) {
      bias_[i] = random_.Index(2) == 0 ? 0.5 : -0.5;
      share_[i] = random_.Index(2) == 0 ? 0.1 : -0.1;
    }
  }
  /// The arm swings about its home; what its sensors say of nothing but their errors and a payload.
  void Tick(double mass, const Vector3d& centre, bool touches = false) {
    const double t = 0.001 * tick_++;
    VectorXd q = model_->home();
    for (int i = 0; i < 7; ++i) q[i] += 0.3 * std::sin((0.7 + 0.1 * i) * t);
    state_.Set(q, VectorXd::Zero(7));
    VectorXd external = bias_ + share_.cwiseProduct(state_.bias());
    math::Vector6d F;
    F.head<3>() = mass * Vector3d(0, 0, -robot::kGravity);
    F.tail<3>() = (state_.X_BH().R * centre).cross(Vector3d(F.head<3>()));
    external += state_.J_BH().transpose() * F;
    for (double& torque : external) torque += 0.3 * random_.Normal();
    estimator_.Update(state_, external, touches);
    truth_ = bias_ + share_.cwiseProduct(state_.bias());
  }

  std::shared_ptr<const robot::Model> model_ = robot::Model::Load("panda");
  robot::State state_{model_};
  LoadEstimator estimator_{7, Vector3d(0, 0, -robot::kGravity), {}};
  Random random_{5};
  VectorXd bias_ = VectorXd::Zero(7), share_ = bias_, truth_;
  int tick_ = 0;
};

TEST_F(LoadEstimatorTest, SensorErrorsAreToldFromWhatTheArmWeighs) {
  double largest = 0;
  for (int i = 0; i < 6000; ++i) {
    Tick(0, Vector3d::Zero());
    if (i > 200) largest = std::max(largest, (estimator_.sensor_error() - truth_).cwiseAbs().maxCoeff());
  }
  EXPECT_TRUE(estimator_.settled());
  EXPECT_LT(largest, 0.35);
  EXPECT_LT((estimator_.sensor_error() - truth_).cwiseAbs().maxCoeff(), 0.12);
  EXPECT_EQ(estimator_.weight_error(), 0);
}

TEST_F(LoadEstimatorTest, APayloadIsToldWithinTwoTenthsOfASecond) {
  for (int i = 0; i < 3000; ++i) Tick(0, Vector3d::Zero());
  for (const double mass : {0.1, 1.5}) {
    estimator_.Carry(true);
    EXPECT_GT(estimator_.weight_error(), 15);
    const Vector3d centre(0.03, -0.02, 0.04);
    for (int i = 0; i < 200; ++i) Tick(mass, centre);
    EXPECT_NEAR(estimator_.mass(), mass, 0.05);
    EXPECT_LT(estimator_.weight_error(), 2);
    const math::Vector6d F = estimator_.Holding(state_.X_BH());
    EXPECT_NEAR(F[2], mass * robot::kGravity, 0.5);
    const Vector3d moment = -(state_.X_BH().R * centre).cross(Vector3d(0, 0, -mass * robot::kGravity));
    EXPECT_LT((F.tail<3>() - moment).norm(), 0.15);
    estimator_.Carry(false);
    EXPECT_EQ(estimator_.Holding(state_.X_BH()).norm(), 0);
  }
}

TEST_F(LoadEstimatorTest, WhatMayBeAContactIsNotLearned) {
  for (int i = 0; i < 3000; ++i) Tick(0, Vector3d::Zero());
  for (int i = 0; i < 2000; ++i) Tick(1, Vector3d::Zero(), true);
  EXPECT_LT((estimator_.sensor_error() - truth_).cwiseAbs().maxCoeff(), 0.2);
  estimator_.Carry(true);
  for (int i = 0; i < 2000; ++i) Tick(1, Vector3d::Zero(), true);
  EXPECT_EQ(estimator_.mass(), 0);
}

}  // namespace
}  // namespace tether::control
