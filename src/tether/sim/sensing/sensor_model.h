#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <string>

#include <Eigen/Core>

#include "tether/common/random.h"
#include "tether/robot/interface.h"
#include "tether/robot/model.h"
#include "tether/robot/sensing.h"
#include "tether/scene/scene.h"

namespace tether::sim {

/// What sensors give of the truth: noise, bias, delay and a lower rate. The same seed gives the same
/// measurements. Poses are stamped with the time at which they were taken.
class SensorModel {
 public:
  SensorModel(const robot::Sensing& sensing, const scene::Scene& scene,
              const std::map<std::string, std::shared_ptr<const robot::Model>>& models, uint64_t seed);

  bool exact() const { return sensing_.exact_poses() && sensing_.exact_torques(); }
  /// One tick: sets what is seen of the truth.
  void Sense(const scene::WorldEstimate& truth, const robot::Observations& measured,
             scene::WorldEstimate* estimate, robot::Observations* observations);

 private:
  struct Arm {
    robot::State state;
    Eigen::VectorXd bias, mass_error, zero;
    std::deque<std::pair<double, Eigen::VectorXd>> waiting;  ///< By the time at which they are seen, s.
  };
  void SensePoses(const scene::WorldEstimate& truth, scene::WorldEstimate* estimate);
  void SenseTorques(Arm& arm, robot::Observation& seen);
  double SignOf(double size);

  robot::Sensing sensing_;
  Random pose_random_, torque_random_;
  std::map<std::string, Arm> arms_;
  std::deque<scene::WorldEstimate> waiting_;
  double next_pose_ = 0;
  bool started_ = false;
};

}  // namespace tether::sim
