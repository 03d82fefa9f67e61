#include "tether/sim/sensing/sensor_model.h"

#include <cmath>

#include <gtest/gtest.h>

namespace tether::sim {
namespace {

class SensorModelTest : public ::testing::Test {
 protected:
  SensorModelTest() {
    scene::Robot robot;
    robot.name = "panda";
    scene_.robots.push_back(robot);
    observations_["panda"].q = model_->home();
    observations_["panda"].v = observations_["panda"].tau_external = Eigen::VectorXd::Zero(7);
    truth_.X_WO["box"] = math::Pose(Eigen::Vector3d(0.4, 0, 0));
  }
  void Tick(SensorModel& sensors) {
    sensors.Sense(truth_, observations_, &estimate_, &seen_);
    truth_.time += 0.001;
    observations_["panda"].time = truth_.time;
  }

  std::shared_ptr<const robot::Model> model_ = robot::Model::Load("panda");
  std::map<std::string, std::shared_ptr<const robot::Model>> models_{{"panda", model_}};
  scene::Scene scene_;
  scene::WorldEstimate truth_, estimate_;
  robot::Observations observations_, seen_;
};

TEST_F(SensorModelTest, WithoutErrorsTheTruthIsSeen) {
  SensorModel sensors({}, scene_, models_, 1);
  EXPECT_TRUE(sensors.exact());
  observations_["panda"].tau_external[2] = 3;
  Tick(sensors);
  EXPECT_EQ(estimate_.X_WO["box"].p, truth_.X_WO["box"].p);
  EXPECT_EQ(seen_["panda"].tau_external, observations_["panda"].tau_external);
}

TEST_F(SensorModelTest, TorquesHaveNoiseBiasAShareOfTheWeightAndDelay) {
  robot::Sensing sensing;
  sensing.torque_noise = 0.3;
  sensing.torque_bias = 0.5;
  sensing.mass_error = 0.1;
  sensing.torque_delay = 0.005;
  SensorModel sensors(sensing, scene_, models_, 5);
  robot::State state(model_);
  state.Set(model_->home(), Eigen::VectorXd::Zero(7));
  Eigen::VectorXd mean = Eigen::VectorXd::Zero(7), squares = mean;
  constexpr int kTicks = 4000;
  for (int i = 0; i < kTicks; ++i) {
    Tick(sensors);
    mean += seen_["panda"].tau_external / kTicks;
    squares += seen_["panda"].tau_external.cwiseAbs2() / kTicks;
  }
  for (int i = 0; i < 7; ++i) {
    const double weight = 0.1 * std::abs(state.bias()[i]);
    const double off = std::abs(mean[i]);
    EXPECT_TRUE(std::abs(off - std::abs(0.5 - weight)) < 0.03 || std::abs(off - 0.5 - weight) < 0.03) << i;
    EXPECT_NEAR(std::sqrt(squares[i] - mean[i] * mean[i]), 0.3, 0.02);
  }
  observations_["panda"].tau_external[0] = 100;
  for (int i = 0; i < 5; ++i) {
    Tick(sensors);
    EXPECT_LT(seen_["panda"].tau_external[0], 20) << i;
  }
  Tick(sensors);
  EXPECT_GT(seen_["panda"].tau_external[0], 80);
}

TEST_F(SensorModelTest, PosesComeAtTheirRateLateAndWithTheirTime) {
  robot::Sensing sensing;
  sensing.pose_noise = 0.003;
  sensing.pose_rate = 50;
  sensing.pose_delay = 0.1;
  SensorModel sensors(sensing, scene_, models_, 5);
  std::map<double, Eigen::Vector3d> seen;
  for (int i = 0; i < 1001; ++i) {
    truth_.X_WO["box"].p.x() = truth_.time;
    Tick(sensors);
    seen.emplace(estimate_.time, estimate_.X_WO["box"].p);
    if (i > 130) {
      EXPECT_NEAR(truth_.time - 0.001 - estimate_.time, 0.11, 0.0105);
    }
  }
  EXPECT_NEAR(static_cast<double>(seen.size()), 46, 1);
  double square = 0;
  for (const auto& [time, p] : seen) square += (p - Eigen::Vector3d(time, 0, 0)).squaredNorm();
  EXPECT_NEAR(std::sqrt(square / 3 / static_cast<double>(seen.size())), 0.003, 0.0006);
}

}  // namespace
}  // namespace tether::sim
