#include "tether/planning/check/region_check.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>
#include <variant>

#include "tether/common/text.h"
#include "tether/constraints/grasps/top_grasp.h"
#include "tether/geometry/distance/bounds.h"
#include "tether/geometry/polygon/polygon.h"
#include "tether/geometry/polygon/support.h"
#include "tether/planning/modes/grip_load.h"
#include "tether/planning/skeleton/skeleton_binding.h"
#include "tether/scene/region.h"

namespace tether::planning {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

// Directions in which a footprint is sampled: it comes out a little too small, never too large.
constexpr int kDirections = 64;

std::string Millimetres(double metres) {
  char text[32];
  FormatInto(text, sizeof text, "%.0f mm", 1e3 * metres);
  return text;
}

/// The projection of an object in this attitude on a region's plane.
geometry::Polygon Footprint(const scene::Object& object, const Eigen::Matrix3d& R_RO) {
  std::vector<Vector2d> points;
  for (int i = 0; i < kDirections; ++i) {
    const double angle = 2 * std::numbers::pi * i / kDirections;
    const Vector3d d_R(std::cos(angle), std::sin(angle), 0);
    points.push_back((R_RO * geometry::SupportPoint(object.shape, R_RO.transpose() * d_R)).head<2>());
  }
  return geometry::ConvexHull(std::move(points));
}

/// Why an action fails, and whether that is a proof.
struct Objection {
  std::string reason;  // empty: nothing
  bool proved = false;
};

/// Why no pose of the controlled frame in the region serves.
Objection WhyNot(const Problem& problem, const StepSchema& step) {
  const scene::Region& region = *problem.scene.FindRegion(step.target);
  const scene::Object* object = problem.scene.FindObject(step.control);
  const geometry::Polygon outline = scene::OutlinePolygon(region.form);
  if (object != nullptr && !region.hub) {
    geometry::Polygon roomy;
    for (const Vector2d& corner : outline)
      roomy.push_back(corner + scene::RegionFit::kOutlineTolerance * std::sqrt(2) * corner.normalized());
    // As it stands: nothing turns it over, since hands grasp from above and put things down in the same
    // attitude.
    const Eigen::Matrix3d R_RO =
        math::Between(problem.scene.InitialPose(region.name), problem.scene.InitialPose(object->name)).R;
    if (!geometry::FitsInside(Footprint(*object, R_RO), roomy))
      return {"the footprint of '" + object->name + "' does not fit into '" + region.name + "'", true};
  }
  if (problem.robot.model == nullptr) return {};
  // A bound, whatever the height: from the column over the region's outline to the shoulder.
  const robot::OuterReach& reach = problem.robot.model->outer_reach();
  const Vector3d p_RS =
      scene::RegionPose(problem.scene, {}, region).Inverse() * (problem.robot.X_WBase * reach.centre);
  double extent = 0;
  for (const Vector2d& corner : outline) extent = std::max(extent, corner.norm());
  double length = reach.radius + reach.p_HW.norm();
  if (object != nullptr) length += 2 * geometry::BoundingRadius(object->shape);
  const double missing = p_RS.head<2>().norm() - extent - length;
  if (missing <= 0) return {};
  return {"'" + region.name + "' is out of reach of '" + problem.robot.name + "' by " + Millimetres(missing),
          true};
}

/// Why the hand can't grasp the target of a step without a key pose, by the executive's own test.
Objection WhyNotGrasped(const Problem& problem, const StepSchema& step) {
  const scene::Object* object = problem.scene.FindObject(step.target);
  if (problem.robot.model == nullptr || step.control != constraints::kHand || object == nullptr) return {};
  constraints::GraspFlaws flaws;
  if (constraints::FindTopGrasp(*problem.robot.model, object->shape, problem.scene.InitialPose(object->name),
                                problem.robot.X_WHand.R, LoadOf(*object, step), &flaws))
    return {};
  const std::string reason =
      "'" + object->name + "' can't be grasped from above: " + flaws.Describe(object->name);
  return {flaws.proved() ? reason : "not modelled: " + reason, flaws.proved()};
}

/// Why the arm will probably not do: it is too short for a hand that points straight down at the region.
std::string WhyHardly(const Problem& problem, const StepSchema& step) {
  if (problem.robot.model == nullptr) return "";
  const scene::Region& region = *problem.scene.FindRegion(step.target);
  const robot::Reach& reach = problem.robot.model->reach();
  const bool solid = std::holds_alternative<geometry::Primitive>(region.form);
  const double height = solid ? 0 : problem.robot.model->gripper().palm_depth;
  const Vector3d p_WR = scene::RegionPose(problem.scene, {}, region).p;
  const math::Pose X_WHand(math::RotationFromRpy({std::numbers::pi, 0, 0}),
                           p_WR + height * Vector3d::UnitZ());
  const double distance = (X_WHand * reach.wrist_hand - problem.robot.X_WBase * reach.centre).norm();
  if (distance <= reach.max) return "";
  return "'" + region.name + "' is out of reach of '" + problem.robot.name + "' by " +
         Millimetres(distance - reach.max) + " with the hand straight down";
}

const ActionSchema* FindSchema(const Problem& problem, const std::string& action) {
  const std::string name = ParseActionCall(action).name;
  const auto found = std::find_if(problem.actions.begin(), problem.actions.end(),
                                  [&](const ActionSchema& schema) { return schema.name == name; });
  return found == problem.actions.end() ? nullptr : &*found;
}

}  // namespace

bool HasRegionStep(const ActionSchema& action) {
  return std::any_of(action.steps.begin(), action.steps.end(),
                     [](const StepSchema& step) { return step.target_is_region; });
}

bool HasRegionStep(const Problem& problem, const std::vector<std::string>& actions) {
  return std::any_of(actions.begin(), actions.end(), [&](const std::string& action) {
    const ActionSchema* schema = FindSchema(problem, action);
    return schema != nullptr && HasRegionStep(*schema);
  });
}

Verdict CheckRegionSteps(const SceneFacts& facts, const std::vector<std::string>& actions, int index,
                         const Limits& limits) {
  const Problem& problem = facts.problem();
  const double begin = limits.Elapsed();
  Verdict verdict;
  CandidateReport& report = verdict.report;
  report.status = CandidateStatus::kFeasible;
  report.plan.scenario = problem.title;
  report.plan.robot = problem.robot.name;
  report.plan.actions = actions;
  std::map<std::string, std::vector<PlanStep>> known;  // by action
  for (size_t i = 0; i < actions.size(); ++i) {
    const auto [steps, fresh] = known.try_emplace(actions[i]);
    if (fresh) {
      std::string reason;
      std::vector<std::string> unmoved;
      CandidateStatus status = CandidateStatus::kInfeasible;
      if (const ActionSchema* schema = FindSchema(problem, actions[i]); schema && !HasRegionStep(*schema)) {
        Verdict alone = OptimizeCandidate(facts, {actions[i]}, index, limits);
        if (alone.report.feasible()) {
          steps->second = std::move(alone.report.plan.steps);
        } else {
          status = alone.report.status;
          reason = alone.report.reason;
          // From the poses at the start: not after an action has moved them.
          unmoved = alone.unmoved;
          const bool moved_before =
              std::any_of(report.plan.steps.begin(), report.plan.steps.end(), [&](const PlanStep& step) {
                return std::find(unmoved.begin(), unmoved.end(), step.control) != unmoved.end();
              });
          if (moved_before) status = CandidateStatus::kGaveUp;
        }
        report.evaluations += alone.report.evaluations;
        report.max_violation_m = std::max(report.max_violation_m, alone.report.max_violation_m);
        report.max_violation_rad = std::max(report.max_violation_rad, alone.report.max_violation_rad);
      } else {
        for (const BoundStep& step : BindSkeleton(problem, {actions[i]})) {
          PlanStep& bare = steps->second.emplace_back();
          bare.action = step.action;
          bare.control = step.schema.control;
          bare.target = step.schema.target;
          bare.target_is_region = step.schema.target_is_region;
          bare.execute = step.schema.execute;
          bare.max_force = step.schema.max_force;
          if (!reason.empty()) continue;
          const Objection objection = step.schema.target_is_region ? WhyNot(problem, step.schema)
                                                                   : WhyNotGrasped(problem, step.schema);
          reason = objection.reason;
          if (reason.empty() && step.schema.target_is_region) reason = WhyHardly(problem, step.schema);
          if (!reason.empty() && !objection.proved) status = CandidateStatus::kGaveUp;
        }
      }
      if (!reason.empty() || status == CandidateStatus::kGaveUp) {
        report.status = status;
        report.reason = reason.starts_with(actions[i]) ? reason : actions[i] + ": " + reason;
        report.plan.steps.clear();
        verdict.failing_actions = limits.Over() ? 0 : i + 1;
        verdict.failing_anywhere = unmoved.empty();
        verdict.unmoved = std::move(unmoved);
        break;
      }
    }
    for (PlanStep step : steps->second) {
      step.action_index = static_cast<int>(i);
      report.plan.steps.push_back(std::move(step));
    }
  }
  report.plan.held = problem.robot.holds;
  SetModes(&report.plan);
  report.optimize_s = limits.Elapsed() - begin;
  return verdict;
}

}  // namespace tether::planning
