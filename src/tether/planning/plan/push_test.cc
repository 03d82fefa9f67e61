#include <algorithm>
#include <cmath>
#include <numbers>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "testing/planning/test_scene.h"
#include "tether/planning/check/checker.h"
#include "tether/planning/plan/problem.h"
#include "tether/symbolic/pddl/pddl.h"

/// The largest angle of a push to the normal: half the friction angle (ERRATA A13) for the checker, half of
/// that for the planner.
namespace tether::planning {
namespace {

using Eigen::Vector3d;

constexpr size_t kPushStep = 2;

PlanReport PlanReach(Problem& problem) {
  const std::string folder = std::string(TETHER_SOURCE_DIR) + "/scenarios/workspace_reach/";
  problem.search.max_actions = 5;
  problem.search.max_plans = 1;
  return PlanTask(problem, *symbolic::Task::Ground(
                               symbolic::ReadProblem(folder + "domain.pddl", folder + "problem.pddl")));
}

/// On the table, and for boxes that are not turned: the push, and the normal of the side that it presses.
struct Push {
  Vector3d along, normal;
  double angle() const { return std::acos(std::clamp(along.normalized().dot(normal), -1.0, 1.0)); }
};

Push PushOf(const Problem& problem, const Plan& plan) {
  EXPECT_EQ(plan.steps[kPushStep].control, "box");
  Push push;
  push.along = plan.steps[kPushStep].X_TC.p - problem.scene.FindObject("box")->X_ParentObject.p;
  int axis = 0;
  push.along.cwiseAbs().maxCoeff(&axis);
  push.normal = Vector3d::Unit(axis) * (push.along[axis] > 0 ? 1 : -1);
  return push;
}

double HalfFrictionAngle(double friction) { return 0.5 * std::atan(friction); }

void SetFriction(Problem& problem, double hook, double box) {
  for (scene::Object& object : problem.scene.objects) {
    if (object.name == "hook") object.friction = hook;
    if (object.name == "box") object.friction = box;
  }
}

TEST(PushTest, TheCheckerRefusesMoreThanHalfTheFrictionAngle) {
  Problem problem = ReachProblem();
  const Plan plan = PlanReach(problem).best()->plan;
  const Push push = PushOf(problem, plan);
  const Vector3d across = Vector3d::UnitZ().cross(push.normal);
  for (const auto& [hook, box] : {std::pair(0.5, 0.5), std::pair(0.2, 0.8), std::pair(0.9, 0.3)}) {
    SetFriction(problem, hook, box);
    const double half = HalfFrictionAngle(std::min(hook, box));
    for (const double share : {-1.9, -1.05, -0.95, 0.0, 0.5, 0.95, 1.05, 1.5}) {
      Plan turned = plan;
      const double angle = share * half, length = push.along.norm();
      turned.steps[kPushStep].X_TC.p +=
          length * (std::cos(angle) * push.normal + std::sin(angle) * across) - push.along;
      double beyond = 0;
      for (const CheckFinding& finding : CheckPlan(problem, turned).findings) {
        if (finding.label != "push_normal(hook, box): direction within half the friction angle") continue;
        EXPECT_EQ(finding.unit, nlp::Unit::kRadian);
        beyond = finding.amount;
      }
      EXPECT_NEAR(beyond, std::max(0.0, std::abs(angle) - half), 1e-3) << share << " of " << half;
      EXPECT_EQ(beyond > 0, std::abs(share) > 1) << share;
    }
  }
}

TEST(PushTest, APlannedPushUsesHalfOfWhatTheCheckerAllows) {
  int oblique = 0;
  for (const double y : {-0.2, -0.1, 0.0, 0.1, 0.15}) {
    for (const double friction : {0.3, 0.6}) {
      Problem problem = ReachProblem();
      SetFriction(problem, friction, friction);
      for (scene::Object& object : problem.scene.objects) {
        if (object.name == "box") object.X_ParentObject.p.y() = y;
      }
      const PlanReport report = PlanReach(problem);
      if (report.best() == nullptr) continue;
      const double share = PushOf(problem, report.best()->plan).angle() / HalfFrictionAngle(friction);
      EXPECT_LT(share, 0.5 + 0.01) << y;
      if (share > 0.45) ++oblique;
    }
  }
  EXPECT_GE(oblique, 3) << "pushes that would rather go more to the side";
}

}  // namespace
}  // namespace tether::planning
