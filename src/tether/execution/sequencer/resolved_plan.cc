#include "tether/execution/sequencer/resolved_plan.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>
#include <variant>

#include "tether/common/error.h"

namespace tether::execution {
namespace {

std::vector<std::string> FrameNames(const scene::Scene& scene, bool control) {
  std::vector<std::string> names;
  for (const auto& object : scene.objects) names.push_back(object.name);
  if (control) {
    names.emplace_back("hand");
    return names;
  }
  for (const auto& region : scene.regions) names.push_back(region.name);
  for (const auto& robot : scene.robots) names.push_back(robot.name);
  names.emplace_back(scene::kWorld);
  return names;
}

std::string UnknownName(const std::string& name, const std::vector<std::string>& known) {
  const std::string nearest = NearestMatch(name, known);
  return nearest.empty() ? JoinAlternatives(known) : "'" + nearest + "'?";
}

bool Finite(const math::Pose& X) { return X.R.allFinite() && X.p.allFinite(); }

// What is wrong with the numbers of a verb, or empty.
std::string CheckVerb(const planning::Verb& verb) {
  if (const auto* reach = std::get_if<planning::ReachVerb>(&verb)) {
    if (!reach->objective.empty()) {
      return "reach with objective '" + reach->objective + "' needs a controller that takes objectives";
    }
    const bool good = reach->offset.allFinite() && reach->speed > 0 && std::isfinite(reach->speed) &&
                      reach->position_tolerance > 0 && reach->rotation_tolerance > 0;
    return good ? "" : "reach: offset must be finite, speed and tolerances above 0";
  }
  if (const auto* shift = std::get_if<planning::ShiftVerb>(&verb)) {
    const bool good = shift->by.allFinite() && shift->speed > 0 && std::isfinite(shift->speed);
    return good ? "" : "shift: `by` must be finite, speed above 0";
  }
  if (const auto* gripper = std::get_if<planning::GripperVerb>(&verb)) {
    return gripper->close_on.empty() || gripper->force > 0 ? "" : "gripper: force must be above 0";
  }
  const auto& wait = std::get<planning::WaitVerb>(verb);
  return wait.seconds >= 0 && std::isfinite(wait.seconds) ? "" : "wait: seconds must be finite, not negative";
}

}  // namespace

std::optional<AttachedFrame> FindFrame(const scene::Scene& scene, const std::string& name) {
  math::Pose X_NameFrame;
  std::string frame = name;
  for (size_t depth = 0; depth <= scene.regions.size() + scene.robots.size(); ++depth) {
    if (frame == scene::kWorld) return AttachedFrame{kNone, X_NameFrame};
    if (const ObjectId object = scene.FindObjectId(frame); object != kNone)
      return AttachedFrame{object, X_NameFrame};
    if (const scene::Region* region = scene.FindRegion(frame)) {
      X_NameFrame = region->X_ParentRegion * X_NameFrame;
      frame = region->parent;
    } else if (const scene::Robot* robot = scene.FindRobot(frame)) {
      X_NameFrame = robot->X_ParentBase * X_NameFrame;
      frame = robot->parent;
    } else {
      return std::nullopt;
    }
  }
  return std::nullopt;
}

bool NeedsObjectives(const planning::Plan& plan) {
  return std::any_of(plan.steps.begin(), plan.steps.end(), [](const planning::PlanStep& step) {
    return step.target_is_region ||
           std::any_of(step.execute.begin(), step.execute.end(), [](const planning::Verb& verb) {
             const auto* reach = std::get_if<planning::ReachVerb>(&verb);
             return reach != nullptr && !reach->objective.empty();
           });
  });
}

ResolvedPlan Resolve(const scene::Scene& scene, planning::Plan plan) {
  Diagnostics diagnostics;
  ResolvedPlan resolved;
  for (size_t i = 0; i < plan.steps.size(); ++i) {
    planning::PlanStep& step = plan.steps[i];
    ResolvedStep r;
    const std::string where = "step " + std::to_string(i) + " (" + step.action + "): ";
    if (step.execute.empty()) step.execute.emplace_back(planning::ReachVerb{});
    if (!Finite(step.X_TC)) diagnostics.Add({}, where + "the pose is not finite");
    if (step.control != "hand") {
      r.control = scene.FindObjectId(step.control);
      if (r.control == kNone) {
        diagnostics.Add({}, where + "unknown control frame '" + step.control + "'",
                        UnknownName(step.control, FrameNames(scene, true)));
      }
    }
    if (const auto target = FindFrame(scene, step.target)) {
      r.target = *target;
    } else {
      diagnostics.Add({}, where + "unknown target frame '" + step.target + "'",
                      UnknownName(step.target, FrameNames(scene, false)));
    }
    const bool same_action = i > 0 && plan.steps[i - 1].action_index == step.action_index;
    r.action_start = same_action ? resolved.steps.back().action_start : static_cast<int>(i);
    r.grasp_step = step.grasp_step;
    r.tool = scene.FindObjectId(step.tool);
    r.push = step.mode == planning::StepMode::kPush;
    if (step.X_CTool) r.X_CTool = *step.X_CTool;
    if (r.push && !step.X_CTool) {
      diagnostics.Add(
          {},
          where + "'" + step.control + "' is not held, and no step before brings '" + step.tool + "' to it",
          "a step with control '" + step.tool + "' and target '" + step.control + "'");
    }
    bool reached = false;
    for (size_t k = 0; k < step.execute.size(); ++k) {
      const planning::Verb& verb = step.execute[k];
      if (const std::string wrong = CheckVerb(verb); !wrong.empty()) diagnostics.Add({}, where + wrong);
      if (std::holds_alternative<planning::ReachVerb>(verb) && !reached) {
        reached = true;
        r.first_reach = static_cast<int>(k);
      }
      r.close_on.push_back(kNone);
      const auto* gripper = std::get_if<planning::GripperVerb>(&verb);
      if (gripper == nullptr) continue;
      if (gripper->close_on.empty()) continue;
      r.close_on.back() = scene.FindObjectId(gripper->close_on);
      if (r.close_on.back() == kNone) {
        diagnostics.Add({},
                        where + "the gripper closes on '" + gripper->close_on + "', which is not an object",
                        UnknownName(gripper->close_on, FrameNames(scene, true)));
      }
    }
    resolved.steps.push_back(std::move(r));
  }
  diagnostics.ThrowIfAny();
  resolved.plan = std::move(plan);
  return resolved;
}

}  // namespace tether::execution
