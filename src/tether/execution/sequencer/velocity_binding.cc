#include <algorithm>
#include <cmath>

#include "tether/common/error.h"
#include "tether/common/text.h"
#include "tether/control/objective.h"
#include "tether/execution/sequencer/velocity_executive_impl.h"
#include "tether/planning/skeleton/action_reader.h"
#include "tether/planning/skeleton/skeleton_binding.h"

namespace tether::execution {
namespace {

using Eigen::Vector3d;

std::string Centimetres(double metres) {
  char text[32];
  FormatInto(text, sizeof text, "%.0f cm", 100 * metres);
  return text;
}

/// The plan's key poses as far as it has them, in the order of steps.
class KeyPoses {
 public:
  explicit KeyPoses(const std::vector<planning::PlanStep>& steps) : steps_(steps) {}

  std::optional<math::Pose> Take(int action, const planning::StepSchema& schema) {
    for (size_t i = next_; i < steps_.size(); ++i) {
      const planning::PlanStep& step = steps_[i];
      if (step.action_index != action || step.control != schema.control || step.target != schema.target)
        continue;
      next_ = i + 1;
      // Without constraints nothing determined the pose.
      if (schema.target_is_region || schema.constraints.empty()) return std::nullopt;
      return step.X_TC;
    }
    return std::nullopt;
  }

 private:
  const std::vector<planning::PlanStep>& steps_;
  size_t next_ = 0;
};

}  // namespace

control::ConstraintNames VelocityExecutive::Impl::Names() const {
  control::ConstraintNames names;
  for (const scene::Object& object : scene.objects) {
    names.objects.push_back(object.name);
    names.frames.push_back(object.name);
    if (object.movable()) names.movable.push_back(object.name);
  }
  for (const scene::Region& region : scene.regions) names.frames.push_back(region.name);
  for (const scene::Robot& robot : scene.robots) names.frames.push_back(robot.name + "/base");
  names.frames.emplace_back(scene::kWorld);
  return names;
}

void VelocityExecutive::Impl::BindPlan(const std::vector<planning::ActionSchema>& actions) {
  Diagnostics diagnostics;
  const std::vector<planning::PlanStep> given = std::move(plan.steps);
  plan.steps.clear();
  KeyPoses key_poses(given);
  std::vector<std::string> known;
  for (const planning::ActionSchema& action : actions) known.push_back(action.name);
  const control::ConstraintNames names = Names();
  for (size_t i = 0; i < plan.actions.size(); ++i) {
    const planning::ActionCall call = planning::ParseActionCall(plan.actions[i]);
    const auto found = std::find_if(actions.begin(), actions.end(),
                                    [&](const auto& action) { return action.name == call.name; });
    if (found == actions.end()) {
      diagnostics.Add({}, "action '" + call.name + "' has no geometry", SuggestFrom(call.name, known));
      continue;
    }
    const int start = static_cast<int>(steps.size());
    for (planning::StepSchema& schema : planning::BindAction(*found, call.arguments)) {
      const std::string what = "a step of '" + plan.actions[i] + "'";
      if (schema.execute.empty()) schema.execute.emplace_back(planning::ReachVerb{});
      if (schema.control != "hand" && control_scene.ObjectIndex(schema.control) < 0) {
        diagnostics.Add(schema.where, what + " controls '" + schema.control + "'",
                        "hand or an object is accepted");
      }
      const bool region = scene.FindRegion(schema.target) != nullptr;
      if (schema.target_is_region != region ||
          (!region && schema.target != scene::kWorld && control_scene.ObjectIndex(schema.target) < 0)) {
        diagnostics.Add(
            schema.where, what + " has the target '" + schema.target + "'",
            schema.target_is_region ? "a region is accepted" : "an object or the world is accepted");
        continue;
      }
      for (const planning::Verb& one : schema.execute) {
        const auto* reach = std::get_if<planning::ReachVerb>(&one);
        if (reach == nullptr) continue;
        if (!reach->objective.empty() && !control::FindObjective(reach->objective)) {
          diagnostics.Add(schema.where, "unknown objective '" + reach->objective + "' in " + what,
                          SuggestFrom(reach->objective, control::ObjectiveNames()));
        }
        if (!reach->constraints.is_null()) {
          control::ReadConstraintSpecs(reach->constraints, control::ConstraintPlace::kRegionVerb, names,
                                       diagnostics);
        }
      }
      planning::PlanStep step;
      step.action = plan.actions[i];
      step.action_index = static_cast<int>(i);
      step.control = schema.control;
      step.target = schema.target;
      step.execute = schema.execute;
      BoundVelocityStep bound{schema, key_poses.Take(step.action_index, schema), start};
      if (bound.X_TC) step.X_TC = *bound.X_TC;
      steps.push_back(std::move(bound));
      plan.steps.push_back(std::move(step));
    }
  }
  if (diagnostics.empty()) CheckReach(diagnostics);
  diagnostics.ThrowIfAny();
}

void VelocityExecutive::Impl::CheckReach(Diagnostics& diagnostics) const {
  const robot::Reach& reach = model->reach();
  std::vector<std::string> seen;
  for (const BoundVelocityStep& step : steps) {
    const std::string& name = step.schema.target;
    if (!step.schema.target_is_region || std::find(seen.begin(), seen.end(), name) != seen.end()) continue;
    seen.push_back(name);
    const scene::Region& region = *scene.FindRegion(name);
    const bool solid = std::holds_alternative<geometry::Primitive>(region.form);
    // Straight down, at the height of a low object's grasp.
    const double height = solid ? 0 : model->gripper().palm_depth;
    const math::Pose X_WR = scene.InitialPose(name);
    const math::Pose X_WHand(math::RotationFromRpy({M_PI, 0, 0}), X_WR.p + height * Vector3d::UnitZ());
    const Vector3d p_WCentre = control_scene.X_WBase() * reach.centre;
    const double distance = (X_WHand * reach.wrist_hand - p_WCentre).norm();
    if (distance <= reach.max) continue;
    diagnostics.Add(step.schema.where,
                    "region '" + name + "' is out of reach: the wrist would be " + Centimetres(distance) +
                        " from the shoulder of '" + robot_name + "'",
                    "up to " + Centimetres(reach.max) + " is accepted");
  }
}

control::ConstrainedVelocity VelocityExecutive::Impl::MakeController() {
  const control::ArmBodies bodies(model, control_scene.solids());
  BuiltConstraints built = BuildConstraints(options.constraints, control_scene, bodies, model->dof());
  control::VelocityOptions controller_options = options.controller;
  controller_options.joint_margin = std::max(controller_options.joint_margin, built.joint_margin);
  controller_options.period = options.period;
  return {model,
          control_scene.X_WBase(),
          control_scene.solids(),
          std::move(built.clearances),
          std::move(built.fields),
          controller_options};
}

}  // namespace tether::execution
