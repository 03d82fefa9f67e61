#include "tether/execution/reference/reach_search.h"

#include <gtest/gtest.h>

namespace tether::execution {
namespace {

using State = ReachSearch::State;

class ReachSearchTest : public ::testing::Test {
 protected:
  State Ask(const math::Pose& X_BH, const Eigen::VectorXd& from) {
    search_.Start(X_BH, from, {});
    ticks_ = 0;
    while (search_.state() == State::kSearching) {
      search_.Advance();
      ++ticks_;
    }
    return search_.state();
  }
  math::Pose HandAt(const Eigen::VectorXd& q) {
    robot::State state(model_);
    state.Set(q, Eigen::VectorXd::Zero(q.size()));
    return state.X_BH();
  }

  std::shared_ptr<const robot::Model> model_ = robot::Model::Load("panda");
  ReachSearch search_{model_};
  int ticks_ = 0;
};

TEST_F(ReachSearchTest, EveryPoseOfAConfigurationWithinTheLimitsIsInReach) {
  Random random(7);
  for (int i = 0; i < 200; ++i) {
    Eigen::VectorXd q(7);
    for (int k = 0; k < 7; ++k) {
      const double room = 0.02 * (model_->upper()[k] - model_->lower()[k]);
      q[k] = random.Uniform(model_->lower()[k] + room, model_->upper()[k] - room);
    }
    EXPECT_EQ(Ask(HandAt(q), model_->home()), State::kReached) << i << ": " << q.transpose();
  }
}

// The shell about the shoulder has room for these: it is the angle of the hand that they lack, or 3 cm.
TEST_F(ReachSearchTest, WhatNoConfigurationReachesIsOutOfReach) {
  const Eigen::Matrix3d down = math::RotationFromRpy({M_PI, 0, 0});
  EXPECT_EQ(Ask({down, {0.55, 0.1, 0.1}}, model_->home()), State::kReached);
  EXPECT_LT(ticks_, 200);
  EXPECT_EQ(Ask({down, {0.86, 0, 0.02}}, model_->home()), State::kOutOfReach);
  EXPECT_GT(search_.nearest_m() + search_.nearest_rad(), 0.02);
  EXPECT_EQ(Ask({math::RotationFromRpy({0, 0, 0}), {0.75, 0, 0.0}}, model_->home()), State::kOutOfReach);
  EXPECT_LE(ticks_, ReachSearch::kStarts * (ReachSearch::kIterations + 1) + 1);
}

}  // namespace
}  // namespace tether::execution
