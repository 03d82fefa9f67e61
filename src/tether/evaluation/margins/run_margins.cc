#include "tether/evaluation/margins/run_margins.h"

#include <algorithm>

#include "tether/execution/servo/torque_servo.h"

namespace tether::evaluation {
namespace {

// Distances above this are not measured, m; of torque runs, which have a tick each millisecond, less.
constexpr double kRange = 1.0, kNear = 0.2;
// A push counts for so long after it, s.
constexpr double kAfterPush = 0.1;
// What moves into the arm faster than this is not the arm's doing, m/s.
constexpr double kFast = 0.1;

bool UsesTorques(const scenario::Scenario& scenario) {
  return scenario.execution.controller != scenario::Controller::kConstrainedVelocity;
}

std::vector<control::ConstraintSpec> Measured(const scenario::Scenario& scenario, const scene::Scene& scene) {
  if (!UsesTorques(scenario)) return scenario.control_constraints;
  return execution::TorqueConstraints(scenario.control_constraints, scene);
}

}  // namespace

RunMargins::RunMargins(const scenario::Scenario& scenario, const scene::Scene& scene,
                       const execution::PlanRunner& runner, double period)
    : scene_(scene),
      robot_(runner.plan().robot),
      uses_torques_(UsesTorques(scenario)),
      monitor_(scene, scenario.models, robot_, Measured(scenario, scene), uses_torques_ ? kNear : kRange),
      torques_(scenario.models.at(robot_), scenario.execution.max_force, period, uses_torques_),
      vacate_(scene, robot_, scenario.models.at(robot_), Measured(scenario, scene), period) {}

void RunMargins::FindUnintended(const sim::World& world, const execution::PlanRunner& runner) {
  const std::string& held = runner.held();
  const ObjectId held_object = scene_.FindObjectId(held);
  const execution::TouchList& allowed = runner.allowed();
  unintended_.clear();
  const auto add = [&](const std::string& a, const std::string& b) {
    const sim::World::Touch touch = world.Touching(a, b);
    unintended_.push_back({a, b, touch.force, touch.speed > kFast});
  };
  for (const ObjectId id : IdRange<ObjectId>(scene_.objects.size())) {
    const std::string& name = scene_.object(id).name;
    if (name == held) continue;
    if (!allowed.Allows(execution::kTouchingHand, id)) add(robot_, name);
    if (!held.empty() && !allowed.Allows(held_object, id)) add(held, name);
  }
}

void RunMargins::Observe(const sim::World& world, const scene::WorldEstimate& truth,
                         const robot::Observations& observations, const robot::Commands& commands,
                         const execution::PlanRunner& runner) {
  vacate_.Observe(world, truth, observations.at(robot_), runner);
  monitor_.Observe(truth, observations, runner, world.IsPushed(robot_, kAfterPush), vacate_.could_vacate());
  FindUnintended(world, runner);
  torques_.Observe(truth.time, commands.at(robot_).torque, unintended_);
}

const std::vector<Margin>& RunMargins::margins() {
  const std::vector<Margin>& own = monitor_.margins();
  const size_t torques = uses_torques_ ? torques_.margins().size() : 0;
  all_.resize(torques +
              own.size());  // Copied in place: twenty times a second, with the memory of the last time.
  std::copy_n(torques_.margins().begin(), torques, all_.begin());
  std::copy(own.begin(), own.end(), all_.begin() + static_cast<std::ptrdiff_t>(torques));
  return all_;
}

void RunMargins::ForgetLast() {
  monitor_.ForgetLast();
  torques_.ForgetLast();
}

}  // namespace tether::evaluation
