#include "tether/execution/reference/goal_search.h"

#include <gtest/gtest.h>

#include "tether/control/objective.h"
#include "tether/robot/model.h"

namespace tether::execution {
namespace {

using control::Objective;
using Eigen::Vector3d;
using math::Pose;
using State = GoalSearch::State;

class GoalSearchTest : public ::testing::Test {
 protected:
  State Ask(Objective objective, const Pose& X_BGoal, const Pose& X_HF = {}) {
    search_.Start(control::MakeObjective(objective, X_BGoal), Pose(), X_HF, model_->home());
    while (search_.state() == State::kSearching) search_.Advance();
    return search_.state();
  }
  Pose HandAt(const Eigen::VectorXd& q) {
    robot::Kinematics kinematics(model_);
    kinematics.Set(q);
    return kinematics.X_BH();
  }

  std::shared_ptr<const robot::Model> model_ = robot::Model::Load("panda");
  GoalSearch search_{model_};
};

TEST_F(GoalSearchTest, WhatAConfigurationWithinTheLimitsReachesIsInReach) {
  Random random(7);
  for (int i = 0; i < 60; ++i) {
    Eigen::VectorXd q(7);
    for (int k = 0; k < 7; ++k) {
      const double room = 0.02 * (model_->upper()[k] - model_->lower()[k]);
      q[k] = random.Uniform(model_->lower()[k] + room, model_->upper()[k] - room);
    }
    const Pose X_HF(math::ExpSO3(Vector3d(0.3, -0.2, 0.1)), Vector3d(0.02, 0, 0.1));
    for (const Objective objective : {Objective::kPose, Objective::kPosition, Objective::kLine,
                                      Objective::kPlane, Objective::kOrientation, Objective::kDistance}) {
      EXPECT_EQ(Ask(objective, HandAt(q) * X_HF, X_HF), State::kReached)
          << i << " " << control::ToString(objective) << " " << search_.nearest_m();
    }
  }
}

// A place that the hand reaches, though not pointing down; and one that no part of a shell about the shoulder
// tells from it: 3 cm too far.
TEST_F(GoalSearchTest, WhatNoConfigurationReachesIsOutOfReach) {
  const Eigen::Matrix3d down = math::RotationFromRpy({M_PI, 0, 0});
  EXPECT_EQ(Ask(Objective::kPose, {down, {0.55, 0.1, 0.1}}), State::kReached);
  EXPECT_EQ(Ask(Objective::kPosition, {down, {0.86, 0, 0.02}}), State::kReached);
  EXPECT_EQ(Ask(Objective::kPose, {down, {0.86, 0, 0.02}}), State::kOutOfReach);
  EXPECT_EQ(Ask(Objective::kPosition, {down, {1.3, 0, 0.3}}), State::kOutOfReach);
  EXPECT_GT(search_.nearest_m(), 0.3);
  EXPECT_LT(search_.nearest_m(), 0.6);
}

}  // namespace
}  // namespace tether::execution
