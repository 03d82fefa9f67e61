#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "tether/control/constrained_velocity.h"
#include "tether/execution/contact/touch.h"
#include "tether/execution/sequencer/constraint_builder.h"
#include "tether/execution/sequencer/plan_runner.h"
#include "tether/robot/interface.h"
#include "tether/scene/scene.h"
#include "tether/sim/world.h"

namespace tether::evaluation {

/// Whether the arm could vacate what it came too near to: at every tick of the preceding 0.5 s, joint
/// velocities within 80 % of the limits keep all distances, judged from the truth by a linear program of its
/// own (rows ḋ ≥ −10 1/s · (d − d_safe), none shrinks below what is safe). It could not while a disturbance
/// drives what is in the hand: that goes its own way.
class VacateMonitor {
 public:
  VacateMonitor(const scene::Scene& scene, const std::string& robot,
                const std::shared_ptr<const robot::Model>& model,
                const std::vector<control::ConstraintSpec>& constraints, double period);

  /// One tick. The objects' velocities are the world's.
  void Observe(const sim::World& world, const scene::WorldEstimate& truth, const robot::Observation& seen,
               const execution::PlanRunner& runner);
  bool could_vacate() const { return since_ >= ticks_; }

 private:
  void Allow(const execution::PlanRunner& runner);

  execution::ControlScene scene_;
  control::ConstrainedVelocity controller_;
  std::vector<control::MovingPose> objects_;
  execution::TouchList allowed_;
  std::string held_;
  int every_, tick_ = 0;
  int ticks_;  ///< Of the window …
  int since_;  ///< … and since there were no such velocities.
};

}  // namespace tether::evaluation
