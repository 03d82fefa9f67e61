#include "tether/execution/sequencer/executive.h"

#include <utility>

#include "tether/common/error.h"
#include "tether/execution/sequencer/limit_checks.h"
#include "tether/execution/servo/reference_servo.h"

namespace tether::execution {

void ExecutiveOptions::Validate() const {
  Diagnostics diagnostics;
  SequencerOptions::Check(&diagnostics);
  ReferenceServoOptions::Check(&diagnostics);
  diagnostics.ThrowIfAny();
}

Executive::Executive(const scene::Scene& scene,
                     const std::map<std::string, std::shared_ptr<const robot::Model>>& models,
                     planning::Plan plan, const ExecutiveOptions& options)
    : Sequencer(
          std::make_unique<Situation>(scene, Resolve(scene, std::move(plan)), models),
          [&](Situation& situation) {
            options.Validate();
            RequireHoldable(scene, situation.robot, *situation.model);
            if (options.constrained) {
              RequireForces(scene, situation.plan, options.servo.max_force, options.servo.max_force_where,
                            options.contact.threshold);
            }
            return std::make_unique<ReferenceServo>(situation, models, options, options);
          },
          [scene](planning::Plan next) { return Resolve(scene, std::move(next)); }, options) {}

}  // namespace tether::execution
