#include "tether/sim/sensing/sensor_model.h"

#include <utility>

#include "tether/robot/gravity.h"

namespace tether::sim {
namespace {

// Times nearer than this are the same, s.
constexpr double kSame = 1e-9;

}  // namespace

SensorModel::SensorModel(const robot::Sensing& sensing, const scene::Scene& scene,
                         const std::map<std::string, std::shared_ptr<const robot::Model>>& models,
                         uint64_t seed)
    : sensing_(sensing),
      pose_random_(Random(seed).Split("poses")),
      torque_random_(Random(seed).Split("torques")) {
  if (sensing_.exact_torques()) return;
  for (const scene::Robot& robot : scene.robots) {
    const auto& model = models.at(robot.name);
    const math::Pose X_WB = scene.InitialPose(robot.name);
    const Eigen::Vector3d gravity_B = X_WB.R.transpose() * Eigen::Vector3d(0, 0, -robot::kGravity);
    const Eigen::VectorXd zero = Eigen::VectorXd::Zero(model->dof());
    Arm arm{robot::State(model, gravity_B), zero, zero, zero, {}};
    for (int i = 0; i < model->dof(); ++i) {
      arm.bias[i] = SignOf(sensing_.torque_bias);
      arm.mass_error[i] = SignOf(sensing_.mass_error);
    }
    arms_.emplace(robot.name, std::move(arm));
  }
}

double SensorModel::SignOf(double size) { return torque_random_.Index(2) == 0 ? size : -size; }

void SensorModel::SensePoses(const scene::WorldEstimate& truth, scene::WorldEstimate* estimate) {
  if (truth.time >= next_pose_ - kSame) {
    if (sensing_.pose_rate > 0) next_pose_ += 1 / sensing_.pose_rate;
    scene::WorldEstimate taken = truth;
    const auto draw = [&](double size) {
      return Eigen::Vector3d(size * pose_random_.Normal(), size * pose_random_.Normal(),
                             size * pose_random_.Normal());
    };
    for (auto& [name, X] : taken.X_WO) {
      if (sensing_.pose_noise > 0) X.p += draw(sensing_.pose_noise);
      if (sensing_.angle_noise > 0) X.R = math::ExpSO3(draw(sensing_.angle_noise)) * X.R;
    }
    // The first measurement is whole: nothing is known before.
    if (sensing_.dropout > 0 && started_)
      std::erase_if(taken.X_WO, [&](const auto&) { return pose_random_.Uniform(0, 1) < sensing_.dropout; });
    started_ = true;
    waiting_.push_back(std::move(taken));
  }
  // The first one is seen at once: nothing is known before.
  while (waiting_.size() > 1 && waiting_[1].time + sensing_.pose_delay <= truth.time + kSame)
    waiting_.pop_front();
  *estimate = waiting_.front();
}

void SensorModel::SenseTorques(Arm& arm, robot::Observation& seen) {
  arm.state.Set(seen.q, arm.zero);
  seen.tau_external += arm.bias + arm.mass_error.cwiseProduct(arm.state.bias());
  for (double& torque : seen.tau_external) torque += sensing_.torque_noise * torque_random_.Normal();
  arm.waiting.emplace_back(seen.time + sensing_.torque_delay, seen.tau_external);
  while (arm.waiting.size() > 1 && arm.waiting[1].first <= seen.time + kSame) arm.waiting.pop_front();
  seen.tau_external = arm.waiting.front().second;
}

void SensorModel::Sense(const scene::WorldEstimate& truth, const robot::Observations& measured,
                        scene::WorldEstimate* estimate, robot::Observations* observations) {
  if (sensing_.exact_poses()) {
    *estimate = truth;
  } else {
    SensePoses(truth, estimate);
  }
  *observations = measured;
  for (auto& [name, arm] : arms_) SenseTorques(arm, observations->at(name));
}

}  // namespace tether::sim
