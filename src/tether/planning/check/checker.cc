#include "tether/planning/check/checker.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <optional>
#include <set>
#include <utility>

#include "tether/common/text.h"
#include "tether/constraints/core/words.h"
#include "tether/geometry/distance/bounds.h"
#include "tether/geometry/distance/distance.h"
#include "tether/planning/check/arm_checker.h"
#include "tether/planning/check/region_check.h"
#include "tether/planning/modes/hand_path.h"
#include "tether/planning/program/clearances.h"

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

 protected:
  void Take(const std::string& label, Unit unit, double amount, std::string cause) override {
    // A test that can't be evaluated counts as violated.
    const double violation = std::isfinite(amount) ? std::max(0.0, amount) : 1e9;
    double& worst = unit == Unit::kRadian ? result_.max_violation_rad : result_.max_violation_m;
    worst = std::max(worst, violation);
    if (violation > 1e-6)
      result_.findings.push_back({step_, action_, label, unit, violation, std::move(cause)});
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

/// "a finger of the hand", "part 2 of shelf", "can".
std::string SaySolid(const SceneFacts& facts, const std::string& name, int part) {
  // The palm comes first (robot::Model::HandShape); without a robot there is none.
  const bool palm = part == 0 && facts.problem().robot.model != nullptr;
  if (name == kHand) return palm ? "the palm of the hand" : "a finger of the hand";
  if (!facts.ShapeOf(name)->is_compound()) return name;
  return "part " + std::to_string(part + 1) + " of " + name;
}

}  // namespace

std::string CheckResult::Worst() const {
  if (findings.empty()) return "";
  const CheckFinding& worst = findings.front();
  if (!worst.cause.empty()) return worst.action + ": " + worst.cause;
  char text[64];
  if (worst.unit == Unit::kRadian) {
    FormatInto(text, sizeof text, " is off by %.1f mrad", 1e3 * worst.amount);
  } else {
    FormatInto(text, sizeof text, " is off by %.1f mm", 1e3 * worst.amount);
  }
  return worst.action + ": " + worst.label + text;
}

namespace {

/// Of a plan with region steps, the key poses of the other actions, each from the poses at the start.
CheckResult CheckRegionPlan(const Problem& problem, const std::vector<BoundStep>& steps, const Plan& plan) {
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
  FrameTree tree(problem.scene, problem.robot.X_WHand, problem.robot.holds);
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
      throw InputError("key pose " + std::to_string(t + 1) + " attaches '" + schema.control +
                       "' to a frame that is attached to it");
    }
    poses.push_back(step.X_TC);
    q.push_back(step.q);
  }
  if (HasRegionStep(problem, plan.actions)) return CheckRegionPlan(problem, steps, plan);
  return CheckKeyPoses(SceneFacts(problem), steps, poses, q);
}

CheckResult CheckKeyPoses(const SceneFacts& facts, const std::vector<BoundStep>& steps,
                          const std::vector<Pose>& poses, const std::vector<Eigen::VectorXd>& q) {
  const Problem& problem = facts.problem();
  CheckResult result;
  Collector collector(result);
  FrameTree tree(problem.scene, problem.robot.X_WHand, problem.robot.holds);
  for (const BoundStep& step : steps) {
    [[maybe_unused]] const bool added = tree.AddStep(step.schema.control, step.schema.target);
    assert(added);
  }

  std::optional<ArmChecker> arm;
  if (problem.robot.model != nullptr && !q.empty()) arm.emplace(facts);
  const auto choose = [](const std::string&, const std::vector<constraints::Option>&) { return 0; };
  const constraints::Memo memo;
  std::vector<const geometry::Shape*> shapes;
  std::vector<size_t> frames;
  for (const std::string& solid : facts.solids()) {
    shapes.push_back(facts.ShapeOf(solid));
    frames.push_back(static_cast<size_t>(tree.IndexOf(solid)));
  }
  for (int t = 0; t < static_cast<int>(steps.size()); ++t) {
    const BoundStep& step = steps[static_cast<size_t>(t)];
    collector.BeginStep(t, step.action);
    const StepContext context(facts, memo, tree, poses, t, step, choose);
    for (const BoundConstraint& constraint : step.constraints) {
      if (constraint.kind->check) constraint.kind->check(context, constraint.parameters, collector);
    }
    const std::vector<std::string>& solids = facts.solids();
    const std::vector<bool> moved = MovedSolids(facts, tree, step.schema.control, t);
    std::vector<Pose> X_W;
    tree.PosesAt(t, poses, X_W);
    std::vector<geometry::Aabb> boxes;
    for (size_t i = 0; i < solids.size(); ++i)
      boxes.push_back(geometry::BoundingBox(*shapes[i], X_W[frames[i]]));
    for (size_t i = 0; i < solids.size(); ++i) {
      if (!moved[i]) continue;
      const std::string& a = solids[i];
      const Pose& X_WA = X_W[frames[i]];
      const geometry::Shape& shape_a = *shapes[i];
      for (size_t j = 0; j < solids.size(); ++j) {
        const std::string& b = solids[j];
        if (moved[j] || boxes[i].DistanceTo(boxes[j]) > 0 || Allowed(step.schema, a, b)) continue;
        const Pose& X_WB = X_W[frames[j]];
        const geometry::Shape& shape_b = *shapes[j];
        if (geometry::DistanceLowerBound(shape_a, X_WA, shape_b, X_WB) > 0) continue;
        const geometry::Distance distance = geometry::SignedDistance(shape_a, X_WA, shape_b, X_WB);
        collector.Report("clearance(" + a + ", " + b + ")", Unit::kMetre, -distance.distance, [&] {
          return SaySolid(facts, a, distance.part_a) + " would be " +
                 constraints::InMillimetres(distance.distance) + " inside " +
                 SaySolid(facts, b, distance.part_b);
        });
      }
    }
    const Pose X_WHand = tree.PoseAt(kHand, t, poses);
    if (problem.robot.model != nullptr)
      collector.Report("reach of " + problem.robot.name, Unit::kMetre, OutOfReach(problem.robot, X_WHand),
                       [&] { return SayReach(problem.robot, X_WHand); });
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
