#include "tether/planning/relaxed.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>
#include <variant>

#include "tether/common/text.h"
#include "tether/geometry/bounds.h"
#include "tether/geometry/polygon.h"
#include "tether/geometry/support.h"
#include "tether/planning/skeleton_binding.h"
#include "tether/scene/region.h"

namespace tether::planning {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

// Directions in which a footprint is looked at. It comes out too small if at all.
constexpr int kDirections = 64;

std::string Millimetres(double metres) {
  char text[32];
  FormatInto(text, sizeof text, "%.0f mm", 1e3 * metres);
  return text;
}

/// The projection of an object on a region's plane, both as they are at the start.
geometry::Polygon Footprint(const scene::Scene& scene, const scene::Object& object,
                            const scene::Region& region) {
  const math::Pose X_RO = math::Between(scene.InitialPose(region.name), scene.InitialPose(object.name));
  std::vector<Vector2d> points;
  for (int i = 0; i < kDirections; ++i) {
    const double angle = 2 * std::numbers::pi * i / kDirections;
    const Vector3d d_R(std::cos(angle), std::sin(angle), 0);
    points.push_back((X_RO * geometry::SupportPoint(object.shape, X_RO.R.transpose() * d_R)).head<2>());
  }
  return geometry::ConvexHull(std::move(points));
}

/// Why no pose of the controlled frame in the region will do; empty if nothing is known against it.
std::string WhyNot(const Problem& problem, const StepSchema& step) {
  const scene::Region& region = *problem.scene.FindRegion(step.target);
  const scene::Object* object = problem.scene.FindObject(step.control);
  const geometry::Polygon outline = scene::OutlinePolygon(region.form);
  if (object != nullptr && !region.hub) {
    geometry::Polygon roomy;
    for (const Vector2d& corner : outline)
      roomy.push_back(corner + scene::RegionFit::kOutlineTolerance * std::sqrt(2) * corner.normalized());
    if (!geometry::FitsInside(Footprint(problem.scene, *object, region), roomy)) {
      return "the footprint of '" + object->name + "' does not fit into '" + region.name + "'";
    }
  }
  if (problem.robot.model == nullptr) return "";
  // A bound, whatever the height: from the column over the region's outline to the shoulder.
  const robot::Reach& reach = problem.robot.model->reach();
  const Vector3d p_RS =
      scene::RegionPose(problem.scene, {}, region).Inverse() * (problem.robot.X_WBase * reach.centre);
  double extent = 0;
  for (const Vector2d& corner : outline) extent = std::max(extent, corner.norm());
  double length = reach.max + reach.wrist_hand.norm();
  if (object != nullptr) length += geometry::BoundingRadius(object->shape);
  const double missing = p_RS.head<2>().norm() - extent - length;
  if (missing <= 0) return "";
  return "'" + region.name + "' is out of reach of '" + problem.robot.name + "' by " + Millimetres(missing);
}

/// Why the arm will hardly do: it is too short for a hand that points straight down where the region is.
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

bool IsRelaxed(const ActionSchema& action) {
  return std::any_of(action.steps.begin(), action.steps.end(),
                     [](const StepSchema& step) { return step.target_is_region; });
}

bool IsRelaxed(const Problem& problem, const std::vector<std::string>& actions) {
  return std::any_of(actions.begin(), actions.end(), [&](const std::string& action) {
    const ActionSchema* schema = FindSchema(problem, action);
    return schema != nullptr && IsRelaxed(*schema);
  });
}

Verdict CheckRelaxed(const SceneFacts& facts, const std::vector<std::string>& actions, int index,
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
      CandidateStatus status = CandidateStatus::kInfeasible;
      if (const ActionSchema* schema = FindSchema(problem, actions[i]); schema && !IsRelaxed(*schema)) {
        Verdict alone = OptimizeCandidate(facts, {actions[i]}, index, limits);
        if (alone.report.feasible()) {
          steps->second = std::move(alone.report.plan.steps);
        } else {
          status = alone.report.status;
          reason = alone.report.reason;
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
          if (!step.schema.target_is_region || !reason.empty()) continue;
          reason = WhyNot(problem, step.schema);
          if (!reason.empty()) continue;
          reason = WhyHardly(problem, step.schema);
          if (!reason.empty()) status = CandidateStatus::kGaveUp;
        }
      }
      if (!reason.empty() || status == CandidateStatus::kGaveUp) {
        report.status = status;
        report.reason = reason.starts_with(actions[i]) ? reason : actions[i] + ": " + reason;
        report.plan.steps.clear();
        verdict.failing_actions = limits.Over() ? 0 : i + 1;
        verdict.failing_anywhere = true;
        break;
      }
    }
    for (PlanStep step : steps->second) {
      step.action_index = static_cast<int>(i);
      report.plan.steps.push_back(std::move(step));
    }
  }
  report.optimize_s = limits.Elapsed() - begin;
  return verdict;
}

}  // namespace tether::planning
