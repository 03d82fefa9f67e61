#pragma once

#include "tether/common/error.h"
#include "tether/planning/plan/plan.h"
#include "tether/robot/model.h"
#include "tether/scene/scene.h"

namespace tether::execution {

/// What the contacts that a step intends need of the force that the arm may press with, N: to slide what is
/// pushed (its weight times the friction with what it stands on, and a fifth more so that it moves), and
/// `contact_threshold` for a reach until contact. 0: nothing. Weights are fed forward and need none.
double NeededForce(const scene::Scene& scene, const planning::PlanStep& step, double contact_threshold);

/// Throws InputError with all steps whose contacts need more than `max_force` (N; said at `where`), or than
/// the step's own.
void RequireForces(const scene::Scene& scene, const planning::Plan& plan, double max_force,
                   const Location& where, double contact_threshold);

/// Throws InputError with all joints that need more torque to hold the robot's start pose than they have.
void RequireHoldable(const scene::Scene& scene, const std::string& robot, const robot::Model& model);

}  // namespace tether::execution
