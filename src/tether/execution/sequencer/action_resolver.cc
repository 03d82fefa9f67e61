#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "tether/common/error.h"
#include "tether/common/text.h"
#include "tether/control/objective.h"
#include "tether/execution/sequencer/resolved_plan.h"
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

control::ConstraintNames NamesOf(const scene::Scene& scene) {
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

/// Binds one plan's actions; what is wrong is gathered.
class ActionResolver {
 public:
  ActionResolver(const scene::Scene& scene, const robot::Model& model,
                 const std::vector<planning::ActionSchema>& actions, planning::Plan plan)
      : scene_(scene),
        model_(model),
        actions_(actions),
        names_(NamesOf(scene)),
        given_(std::move(plan.steps)),
        key_poses_(given_) {
    resolved_.plan = std::move(plan);
    resolved_.plan.steps.clear();
  }

  ResolvedPlan Resolve() {
    const std::shared_ptr<const planning::Skeleton> skeleton = Bind();
    for (const planning::BoundStep& step : skeleton->steps) ResolveStep(*skeleton->frames, step);
    planning::SetModes(&resolved_.plan);
    for (const int i : resolved_.steps.ids()) {
      planning::PlanStep& step = resolved_.plan.steps[ToIndex(i)];
      if (resolved_.steps[i].schema.target_is_region) step.mode = planning::StepMode::kRegion;
      resolved_.steps[i].grasp_step = step.grasp_step;
    }
    if (diagnostics_.empty()) CheckReach();
    diagnostics_.ThrowIfAny();
    return std::move(resolved_);
  }

 private:
  /// The plan's own skeleton, if it is of these actions and frames; else they are bound here.
  std::shared_ptr<const planning::Skeleton> Bind() const {
    const std::vector<std::string>& actions = resolved_.plan.actions;
    const auto frames = std::make_shared<const scene::Frames>(scene_);
    const auto& given = resolved_.plan.skeleton;
    if (given && given->actions == actions && given->frames->HasSameNames(*frames)) return given;
    return std::make_shared<planning::Skeleton>(
        planning::SkeletonBinder(scene_, frames, actions_, {}).Bind(actions));
  }

  void ResolveStep(const scene::Frames& frames, const planning::BoundStep& bound) {
    const int index = bound.action_index;
    planning::StepSchema schema = bound.schema;
    const std::string what = "a step of '" + bound.action + "'";
    if (index != action_index_) {
      action_index_ = index;
      start_ = resolved_.steps.next_id();
    }
    if (schema.execute.empty()) schema.execute.emplace_back(planning::ReachVerb{});
    ResolvedStep step;
    step.action_start = start_;
    step.control = frames.ObjectOf(bound.control);
    step.tool = step.control;
    if (bound.control != frames.hand() && step.control == kNone) {
      diagnostics_.Add(schema.where, what + " controls '" + schema.control + "'",
                       "hand or an object is accepted");
    }
    const bool region = frames.RegionOf(bound.target) >= 0;
    if (schema.target_is_region != region ||
        (!region && bound.target != scene::Frames::world() && frames.ObjectOf(bound.target) == kNone)) {
      diagnostics_.Add(
          schema.where, what + " has the target '" + schema.target + "'",
          schema.target_is_region ? "a region is accepted" : "an object or the world is accepted");
      return;
    }
    step.target = *FindFrame(scene_, schema.target);
    if (region) step.region = frames.RegionOf(bound.target);
    const auto end_of = [&frames](FrameId frame) {
      return AllowedEnd{frame == frames.hand(), frames.ObjectOf(frame), frames.RegionOf(frame)};
    };
    for (const auto& [first, second] : bound.allow) step.allow.emplace_back(end_of(first), end_of(second));
    // What is brought to a region touches what carries it.
    if (region && step.control != kNone) step.allow.emplace_back(end_of(bound.control), end_of(bound.target));
    for (const planning::Verb& verb : schema.execute) ResolveVerb(verb, what, schema.where, &step);
    planning::PlanStep planned;
    planned.action = bound.action;
    planned.action_index = index;
    planned.control = schema.control;
    planned.target = schema.target;
    planned.execute = schema.execute;
    step.X_TC = key_poses_.Take(index, schema);
    if (step.X_TC) planned.X_TC = *step.X_TC;
    step.schema = std::move(schema);
    resolved_.steps.push_back(std::move(step));
    resolved_.plan.steps.push_back(std::move(planned));
  }

  void ResolveVerb(const planning::Verb& verb, const std::string& what, const Location& where,
                   ResolvedStep* step) {
    step->close_on.push_back(kNone);
    step->specs.emplace_back();
    if (const auto* gripper = std::get_if<planning::GripperVerb>(&verb)) {
      if (!gripper->close_on.empty()) step->close_on.back() = scene_.FindObjectId(gripper->close_on);
      return;
    }
    const auto* reach = std::get_if<planning::ReachVerb>(&verb);
    if (reach == nullptr) return;
    if (!reach->objective.empty() && !control::FindObjective(reach->objective)) {
      diagnostics_.Add(where, "unknown objective '" + reach->objective + "' in " + what,
                       SuggestFrom(reach->objective, control::ObjectiveNames()));
    }
    if (reach->constraints.is_null()) return;
    step->specs.back() = control::ReadConstraintSpecs(
        reach->constraints, control::ConstraintPlace::kRegionVerb, names_, diagnostics_);
  }

  void CheckReach() {
    const robot::Reach& reach = model_.reach();
    const std::string& robot = resolved_.plan.robot;
    std::vector<std::string> seen;
    for (const ResolvedStep& step : resolved_.steps) {
      const std::string& name = step.schema.target;
      if (!step.schema.target_is_region || std::find(seen.begin(), seen.end(), name) != seen.end()) continue;
      seen.push_back(name);
      const scene::Region& region = *scene_.FindRegion(name);
      const bool solid = std::holds_alternative<geometry::Primitive>(region.form);
      // Straight down, at the height of a low object's grasp.
      const double height = solid ? 0 : model_.gripper().palm_depth;
      const math::Pose X_WR = scene_.InitialPose(name);
      const math::Pose X_WHand(math::RotationFromRpy({M_PI, 0, 0}), X_WR.p + height * Vector3d::UnitZ());
      const Vector3d p_WCentre = scene_.InitialPose(robot) * reach.centre;
      const double distance = (X_WHand * reach.wrist_hand - p_WCentre).norm();
      if (distance <= reach.max) continue;
      diagnostics_.Add(step.schema.where,
                       "region '" + name + "' is out of reach: the wrist would be " + Centimetres(distance) +
                           " from the shoulder of '" + robot + "'",
                       "up to " + Centimetres(reach.max) + " is accepted");
    }
  }

  const scene::Scene& scene_;
  const robot::Model& model_;
  const std::vector<planning::ActionSchema>& actions_;
  const control::ConstraintNames names_;
  const std::vector<planning::PlanStep> given_;
  KeyPoses key_poses_;
  int action_index_ = -1, start_ = 0;  // Of the action whose steps come, and its first one.
  ResolvedPlan resolved_;
  Diagnostics diagnostics_;
};

}  // namespace

ResolvedPlan ResolveActions(const scene::Scene& scene, const robot::Model& model,
                            const std::vector<planning::ActionSchema>& actions, planning::Plan plan) {
  return ActionResolver(scene, model, actions, std::move(plan)).Resolve();
}

}  // namespace tether::execution
