#include "tether/planning/checker.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <optional>
#include <set>

#include "tether/common/text.h"
#include "tether/geometry/bounds.h"
#include "tether/geometry/distance.h"
#include "tether/planning/arm_checker.h"
#include "tether/planning/clearances.h"
#include "tether/planning/hand_path.h"
#include "tether/planning/relaxed.h"

namespace tether::planning {
namespace {

using constraints::kHand;
using math::Pose;
using nlp::Unit;

class Collector final : public constraints::Findings {
 public:
  explicit Collector(CheckResult& result) : result_(result) {}
  void BeginStep(int step, const std::string& action) {
    step_ = step;
    action_ = action;
  }
  void Report(const std::string& label, Unit unit, double amount) override {
    // A test that can't be evaluated is not passed.
    const double violation = std::isfinite(amount) ? std::max(0.0, amount) : 1e9;
    double& worst = unit == Unit::kRadian ? result_.max_violation_rad : result_.max_violation_m;
    worst = std::max(worst, violation);
    if (violation > 1e-6) result_.findings.push_back({step_, action_, label, unit, violation});
  }

 private:
  CheckResult& result_;
  int step_ = 0;
  std::string action_;
};

bool Allowed(const StepSchema& schema, const std::string& a, const std::string& b) {
  for (const auto& [x, y] : schema.allow) {
    if ((x == a && y == b) || (x == b && y == a)) return true;
  }
  return false;
}

}  // namespace

std::string CheckResult::Worst() const {
  if (findings.empty()) return "";
  const CheckFinding& worst = findings.front();
  char text[64];
  if (worst.unit == Unit::kRadian) {
    FormatInto(text, sizeof text, " is off by %.1f mrad", 1e3 * worst.amount);
  } else {
    FormatInto(text, sizeof text, " is off by %.1f mm", 1e3 * worst.amount);
  }
  return worst.action + ": " + worst.label + text;
}

namespace {

/// Of a plan with relaxed actions, the key poses of the others, each from where things are at the start.
CheckResult CheckRelaxedPlan(const Problem& problem, const std::vector<BoundStep>& steps, const Plan& plan) {
  const SceneFacts facts(problem);
  CheckResult all;
  std::set<std::string> seen;
  for (size_t begin = 0, end = 0; begin < steps.size(); begin = end) {
    bool relaxed = false;
    std::vector<BoundStep> own;
    std::vector<Pose> poses;
    for (end = begin; end < steps.size() && steps[end].action_index == steps[begin].action_index; ++end) {
      relaxed = relaxed || steps[end].schema.target_is_region;
      own.push_back(steps[end]);
      poses.push_back(plan.steps[end].X_TC);
    }
    if (relaxed || !seen.insert(steps[begin].action).second) continue;
    const CheckResult one = CheckKeyPoses(facts, own, poses);
    all.max_violation_m = std::max(all.max_violation_m, one.max_violation_m);
    all.max_violation_rad = std::max(all.max_violation_rad, one.max_violation_rad);
    all.findings.insert(all.findings.end(), one.findings.begin(), one.findings.end());
  }
  all.cost = plan.cost;
  return all;
}

}  // namespace

CheckResult CheckPlan(const Problem& problem, const Plan& plan) {
  const std::vector<BoundStep> steps = BindSkeleton(problem, plan.actions);
  if (steps.size() != plan.steps.size()) {
    throw InputError("the plan has " + std::to_string(plan.steps.size()) +
                     " key poses, but its actions have " + std::to_string(steps.size()));
  }
  FrameTree tree(problem.scene, problem.robot.X_WHand);
  std::vector<Pose> poses;
  std::vector<Eigen::VectorXd> q;
  for (size_t t = 0; t < steps.size(); ++t) {
    const StepSchema& schema = steps[t].schema;
    const PlanStep& step = plan.steps[t];
    if (schema.control != step.control || schema.target != step.target) {
      throw InputError("key pose " + std::to_string(t + 1) + " of the plan is of '" + step.control +
                           "' in '" + step.target + "'",
                       "'" + schema.control + "' in '" + schema.target + "' belongs to " + steps[t].action);
    }
    if (!tree.AddStep(schema.control, schema.target)) {
      throw InputError("key pose " + std::to_string(t + 1) + " hangs '" + schema.control +
                       "' on what hangs on it");
    }
    poses.push_back(step.X_TC);
    q.push_back(step.q);
  }
  if (IsRelaxed(problem, plan.actions)) return CheckRelaxedPlan(problem, steps, plan);
  return CheckKeyPoses(SceneFacts(problem), steps, poses, q);
}

CheckResult CheckKeyPoses(const SceneFacts& facts, const std::vector<BoundStep>& steps,
                          const std::vector<Pose>& poses, const std::vector<Eigen::VectorXd>& q) {
  const Problem& problem = facts.problem();
  CheckResult result;
  Collector collector(result);
  FrameTree tree(problem.scene, problem.robot.X_WHand);
  for (const BoundStep& step : steps) {
    [[maybe_unused]] const bool hangs = tree.AddStep(step.schema.control, step.schema.target);
    assert(hangs);
  }

  std::optional<ArmChecker> arm;
  if (problem.robot.model != nullptr && !q.empty()) arm.emplace(facts);
  const auto choose = [](const std::string&, const std::vector<constraints::Option>&) { return 0; };
  const constraints::Memo memo;
  for (int t = 0; t < static_cast<int>(steps.size()); ++t) {
    const BoundStep& step = steps[static_cast<size_t>(t)];
    collector.BeginStep(t, step.action);
    const StepContext context(facts, memo, tree, poses, t, step, choose);
    for (const BoundConstraint& constraint : step.constraints) {
      if (constraint.kind->check) constraint.kind->check(context, constraint.parameters, collector);
    }
    const std::vector<std::string>& solids = facts.solids();
    const std::vector<bool> moved = MovedSolids(facts, tree, step.schema.control, t);
    for (size_t i = 0; i < solids.size(); ++i) {
      for (size_t j = 0; j < solids.size(); ++j) {
        const std::string &a = solids[i], &b = solids[j];
        if (!moved[i] || moved[j] || Allowed(step.schema, a, b)) continue;
        const Pose X_WA = tree.PoseAt(a, t, poses), X_WB = tree.PoseAt(b, t, poses);
        const geometry::Shape &shape_a = *facts.ShapeOf(a), &shape_b = *facts.ShapeOf(b);
        if (geometry::DistanceLowerBound(shape_a, X_WA, shape_b, X_WB) > 0) continue;
        const geometry::Distance distance = geometry::SignedDistance(shape_a, X_WA, shape_b, X_WB);
        collector.Report("clearance(" + a + ", " + b + ")", Unit::kMetre, -distance.distance);
      }
    }
    const Pose X_WHand = tree.PoseAt(kHand, t, poses);
    if (problem.robot.model != nullptr)
      collector.Report("reach of " + problem.robot.name, Unit::kMetre, OutOfReach(problem.robot, X_WHand));
    if (arm && static_cast<size_t>(t) < q.size() && q[static_cast<size_t>(t)].size() > 0)
      arm->Check(tree, poses, t, X_WHand, q[static_cast<size_t>(t)], collector);
    result.X_WHand.push_back(X_WHand);
  }
  result.cost = CostOfHand(problem, result.X_WHand).total();
  std::stable_sort(result.findings.begin(), result.findings.end(),
                   [](const CheckFinding& a, const CheckFinding& b) { return a.amount > b.amount; });
  return result;
}

}  // namespace tether::planning
