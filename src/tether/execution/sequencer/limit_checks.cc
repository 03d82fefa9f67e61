#include "tether/execution/sequencer/limit_checks.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <variant>

#include "tether/common/text.h"
#include "tether/robot/gravity.h"
#include "tether/scene/friction.h"

namespace tether::execution {
namespace {

// A push that has just the force of friction does not move.
constexpr double kMoves = 1.2;

}  // namespace

double NeededForce(const scene::Scene& scene, const planning::PlanStep& step, double contact_threshold) {
  double needed = 0;
  for (const planning::Verb& verb : step.execute) {
    const auto* reach = std::get_if<planning::ReachVerb>(&verb);
    if (reach != nullptr && reach->until_contact) needed = contact_threshold;
  }
  if (step.mode != planning::StepMode::kPush) return needed;
  const scene::Object* pushed = scene.FindObject(step.control);
  if (pushed == nullptr) return needed;
  const scene::Object* support = scene.FindObject(step.target);
  const double friction =
      support == nullptr ? pushed->friction : scene::PairFriction(pushed->friction, support->friction);
  return std::max(needed, kMoves * friction * pushed->mass.value_or(0) * robot::kGravity);
}

void RequireForces(const scene::Scene& scene, const planning::Plan& plan, double max_force,
                   const Location& where, double contact_threshold) {
  Diagnostics diagnostics;
  for (const planning::PlanStep& step : plan.steps) {
    const double needed = NeededForce(scene, step, contact_threshold);
    const double most = step.max_force.value_or(max_force);
    if (needed <= most) continue;
    const std::string whose = step.max_force ? "of the step" : "of 'execution'";
    const std::string what = step.mode == planning::StepMode::kPush
                                 ? "to slide '" + step.control + "' takes " + Fixed(needed, 1) + " N"
                                 : "a contact is felt from " + Fixed(needed, 1) + " N on";
    diagnostics.Add(
        step.max_force ? Location{} : where,
        "'max_force' " + whose + " is " + Fixed(most, 1) + " N, but in " + step.action + " " + what,
        "at least " + Fixed(std::ceil(10 * needed) / 10, 1) + " N");
  }
  diagnostics.ThrowIfAny();
}

void RequireHoldable(const scene::Scene& scene, const std::string& robot, const robot::Model& model) {
  const scene::Robot* given = scene.FindRobot(robot);
  if (given == nullptr) return;
  Eigen::VectorXd q = model.home();
  if (static_cast<Eigen::Index>(given->q.size()) == q.size())
    q = Eigen::Map<const Eigen::VectorXd>(given->q.data(), q.size());
  const math::Pose X_WB = scene.InitialPose(robot);
  // The model outlives the state.
  const std::shared_ptr<const robot::Model> shared(&model, [](const robot::Model*) {});
  robot::State state(shared, X_WB.R.transpose() * Eigen::Vector3d(0, 0, -robot::kGravity));
  state.Set(q, Eigen::VectorXd::Zero(q.size()));
  Diagnostics diagnostics;
  for (Eigen::Index i = 0; i < q.size(); ++i) {
    const double needed = std::abs(state.bias()[i]);
    if (needed <= model.max_torque()[i]) continue;
    diagnostics.Add({},
                    model.joint_names()[i] + " of '" + robot + "' needs " + Fixed(needed, 1) +
                        " Nm to hold its start pose, but its 'max_torque' is " +
                        Fixed(model.max_torque()[i], 1) + " Nm",
                    "another start pose, or a robot whose joints are strong enough for its weight");
  }
  diagnostics.ThrowIfAny();
}

}  // namespace tether::execution
