#include "tether/execution/sequencer/velocity_executive.h"

#include <utility>

#include "tether/common/error.h"
#include "tether/execution/servo/velocity_servo.h"

namespace tether::execution {
namespace {

// A plan that names no robot of the scene is for the first one.
planning::Plan ForRobot(const scene::Scene& scene, planning::Plan plan) {
  if (!plan.robot.empty() && scene.FindRobot(plan.robot) != nullptr) return plan;
  if (scene.robots.empty())
    throw InputError("the scene has no robot", "a robot under 'robots' of the scenario");
  plan.robot = scene.robots.front().name;
  return plan;
}

}  // namespace

VelocityExecutiveOptions::VelocityExecutiveOptions() {
  // Velocities go to a servo with a loop of its own; torques close it here, at 1 kHz.
  period = 0.005;
  // Torques feed the velocity of what they follow forward, where noise becomes force; a velocity servo
  // follows exact poses as they are, and a filter would only be late.
  filters_poses = false;
}

void VelocityExecutiveOptions::Validate() const {
  Diagnostics diagnostics;
  SequencerOptions::Check(&diagnostics);
  VelocityServoOptions::Check(&diagnostics);
  diagnostics.ThrowIfAny();
}

VelocityExecutive::VelocityExecutive(const scene::Scene& scene,
                                     const std::map<std::string, std::shared_ptr<const robot::Model>>& models,
                                     const std::vector<planning::ActionSchema>& actions, planning::Plan plan,
                                     const VelocityExecutiveOptions& options)
    : Sequencer(
          [&] {
            options.Validate();
            plan = ForRobot(scene, std::move(plan));
            const robot::Model& model = *models.at(plan.robot);
            return std::make_unique<Situation>(scene, ResolveActions(scene, model, actions, std::move(plan)),
                                               models);
          }(),
          [&](Situation& situation) {
            return std::make_unique<VelocityServo>(situation, models, options, options);
          },
          [scene, models, actions](planning::Plan next) {
            const robot::Model& model = *models.at(next.robot);
            return ResolveActions(scene, model, actions, std::move(next));
          },
          options) {}

const control::ConstrainedVelocity& VelocityExecutive::controller() const {
  return static_cast<const VelocityServo&>(servo()).controller();
}

}  // namespace tether::execution
