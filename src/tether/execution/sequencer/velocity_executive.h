#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "tether/execution/sequencer/sequencer.h"
#include "tether/execution/servo/velocity_servo_options.h"
#include "tether/planning/skeleton/action.h"
#include "tether/robot/model.h"
#include "tether/scene/scene.h"

namespace tether::execution {

class VelocityServo;

struct VelocityExecutiveOptions : SequencerOptions, VelocityServoOptions {
  /// The sequencer's, as they are for velocities.
  VelocityExecutiveOptions();
  /// Throws InputError naming every field that is not finite or not positive.
  void Validate() const;
};

/// Executes a plan by velocities under constraints: the sequencer with a VelocityServo.
class VelocityExecutive final : public Sequencer {
 public:
  /// Binds the plan's actions to `actions`. Throws InputError with everything that can't be executed: unknown
  /// names, steps that can't be bound, regions that are out of reach or too small for what is brought there.
  VelocityExecutive(const scene::Scene& scene,
                    const std::map<std::string, std::shared_ptr<const robot::Model>>& models,
                    const std::vector<planning::ActionSchema>& actions, planning::Plan plan,
                    const VelocityExecutiveOptions& options);

  /// The controller as it was at the last tick.
  const control::ConstrainedVelocity& controller() const;
};

}  // namespace tether::execution
