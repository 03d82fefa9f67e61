#include "tether/evaluation/margins/vacate.h"

#include <algorithm>
#include <cmath>

namespace tether::evaluation {
namespace {

constexpr double kWindow = 0.5;    // s
constexpr double kSample = 0.005;  // s, between two programs
constexpr double kShare = 0.8;     // of the joints' greatest velocities
constexpr double kRate = 10;       // 1/s

control::ConstrainedVelocity Make(const execution::ControlScene& scene,
                                  const std::shared_ptr<const robot::Model>& model,
                                  const std::vector<control::ConstraintSpec>& constraints) {
  const control::ArmBodies bodies(model, scene.solids());
  execution::BuiltConstraints built = execution::BuildConstraints(constraints, scene, bodies);
  control::VelocityOptions options;
  options.field_gain = kRate;
  options.joint_gain = kRate;
  options.buffer = 0;
  options.velocity_share = kShare;
  options.ramp = 0;
  options.escape_speed = 1e-6;  // What is violated need not be left: it must not get worse.
  return {model, scene.X_WBase(), scene.solids(), built.clearances, {}, options};
}

}  // namespace

VacateMonitor::VacateMonitor(const scene::Scene& scene, const std::string& robot,
                             const std::shared_ptr<const robot::Model>& model,
                             const std::vector<control::ConstraintSpec>& constraints, double period)
    : scene_(scene, robot),
      controller_(Make(scene_, model, constraints)),
      objects_(scene.objects.size()),
      every_(std::max(1, static_cast<int>(std::lround(kSample / period)))),
      ticks_(static_cast<int>(std::lround(kWindow / period))),
      since_(ticks_) {}

void VacateMonitor::Allow(const execution::PlanRunner& runner) {
  if (runner.held() != held_) {
    held_ = runner.held();
    if (held_.empty()) {
      controller_.Release();
    } else {
      controller_.Hold(scene_.Find(held_).value());
    }
  }
  if (runner.allowed() == allowed_) return;
  allowed_ = runner.allowed();
  std::vector<std::pair<int, int>> pairs;
  execution::FindBodies(allowed_, controller_.bodies(), &pairs);
  controller_.Allow(pairs);
}

void VacateMonitor::Observe(const sim::World& world, const scene::WorldEstimate& truth,
                            const robot::Observation& seen, const execution::PlanRunner& runner) {
  ++since_;
  if (tick_++ % every_ != 0) return;
  Allow(runner);
  for (size_t i = 0; i < objects_.size(); ++i) {
    const std::string& name = scene_.solids()[i].name;
    objects_[i] = {truth.X_WO.at(name), world.ObjectVelocity(name)};
  }
  controller_.Compute({seen.q, seen.gripper_opening, objects_}, nullptr);
  // What is torn out of the hand does not go where the hand goes, whatever the joints do.
  const bool torn = !held_.empty() && world.IsDriven(held_);
  if (torn || controller_.flags().relaxed || controller_.flags().fault) since_ = 0;
}

}  // namespace tether::evaluation
