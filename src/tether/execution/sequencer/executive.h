#pragma once

#include <map>
#include <memory>
#include <string>

#include "tether/execution/sequencer/sequencer.h"
#include "tether/execution/servo/reference_servo_options.h"
#include "tether/planning/plan/plan.h"
#include "tether/robot/model.h"
#include "tether/scene/scene.h"

namespace tether::execution {

struct ExecutiveOptions : SequencerOptions, ReferenceServoOptions {
  /// Throws InputError naming every field that is not finite or not positive.
  void Validate() const;
};

/// Executes a plan by torques: the sequencer with a ReferenceServo.
class Executive final : public Sequencer {
 public:
  /// `models`: by robot name; robots other than the plan's hold their posture. Throws InputError with
  /// everything in the plan that can't be executed: unknown names, values that are not finite, a push without
  /// a pusher, an objective.
  Executive(const scene::Scene& scene,
            const std::map<std::string, std::shared_ptr<const robot::Model>>& models, planning::Plan plan,
            const ExecutiveOptions& options = {});
};

}  // namespace tether::execution
