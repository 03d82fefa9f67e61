#include "tether/planning/cost_bound.h"

#include <algorithm>
#include <optional>

namespace tether::planning {
namespace {

using constraints::Column;
using Eigen::Vector3d;

constexpr int kSweeps = 60;

struct Ball {
  Vector3d centre = Vector3d::Zero();
  double radius = 0;
};

/// Where the step's control frame is in its target frame, as far as its constraints tell.
std::optional<Ball> Locate(const StepContext& context, const BoundStep& step) {
  std::optional<Column> all;
  for (const BoundConstraint& constraint : step.constraints) {
    if (!constraint.kind->locate) continue;
    const std::optional<Column> column = constraint.kind->locate(context, constraint.parameters);
    if (!column) continue;
    if (!all) {
      all = column;
    } else if (std::abs(all->axis.dot(column->axis)) > 1 - 1e-9) {
      // Two about the same axis: the narrower and the shorter.
      const double height = all->axis.dot(all->centre);
      if (column->radius < all->radius) {
        const double half_height = all->half_height;
        all->centre = column->centre + all->axis * (height - all->axis.dot(column->centre));
        all->radius = column->radius;
        all->half_height = half_height;
      }
      if (column->half_height < all->half_height) {
        all->centre += all->axis * (all->axis.dot(column->centre) - all->axis.dot(all->centre));
        all->half_height = column->half_height;
      }
    }
  }
  if (!all || !std::isfinite(all->radius) || !std::isfinite(all->half_height)) return std::nullopt;
  return Ball{all->centre, std::hypot(all->radius, all->half_height)};
}

/// Where the hand is in the world after a step; none if that is not known.
std::optional<Ball> HandAt(const FrameTree& tree, int step, const std::vector<std::optional<Ball>>& located) {
  math::Pose X_WF;  // known as long as the links are constant
  Ball ball;
  bool turned = false;
  for (const ChainLink& link : tree.ChainTo(constraints::kHand, step)) {
    Ball next;
    if (link.variable < 0) {
      next.centre = tree.parameters()[static_cast<size_t>(link.parameter)].p;
    } else {
      const std::optional<Ball>& found = located[static_cast<size_t>(link.variable)];
      if (!found) return std::nullopt;
      next = *found;
    }
    if (turned) {
      ball.radius += next.centre.norm() + next.radius;
    } else if (link.variable >= 0) {
      ball = {X_WF * next.centre, next.radius};
      turned = true;
    } else {
      X_WF = X_WF * tree.parameters()[static_cast<size_t>(link.parameter)];
    }
  }
  return turned ? ball : Ball{X_WF.p, 0};
}

/// min Σ wᵢ ‖qᵢ₊₁ − qᵢ‖² with every qᵢ in its ball, from below: block coordinate descent, and then the
/// Frank–Wolfe gap, by which a convex function lies at most above its minimum (Jaggi 2013).
double LeastTravel(const std::vector<Ball>& balls, const std::vector<double>& weights) {
  std::vector<Vector3d> q;
  for (const Ball& ball : balls) q.push_back(ball.centre);
  const auto pull = [&](size_t i) {  // half the negative gradient, and its weight
    Vector3d sum = Vector3d::Zero();
    double weight = 0;
    if (i > 0) sum += weights[i - 1] * q[i - 1], weight += weights[i - 1];
    if (i + 1 < q.size()) sum += weights[i] * q[i + 1], weight += weights[i];
    return std::pair(sum, weight);
  };
  for (int sweep = 0; sweep < kSweeps; ++sweep) {
    for (size_t i = 0; i < q.size(); ++i) {
      const auto [sum, weight] = pull(i);
      if (weight == 0) continue;
      const Vector3d from_centre = sum / weight - balls[i].centre;
      const double distance = from_centre.norm();
      q[i] = balls[i].centre + (distance > balls[i].radius ? balls[i].radius / distance : 1) * from_centre;
    }
  }
  double bound = 0;
  for (size_t i = 0; i < q.size(); ++i) {
    if (i + 1 < q.size()) bound += weights[i] * (q[i + 1] - q[i]).squaredNorm();
    const auto [sum, weight] = pull(i);
    const Vector3d gradient = 2 * (weight * q[i] - sum);
    bound -= gradient.dot(q[i] - balls[i].centre) + balls[i].radius * gradient.norm();
  }
  return std::max(0.0, bound);
}

}  // namespace

double LowerCostBound(const SceneFacts& facts, const std::vector<BoundStep>& steps) {
  const Problem& problem = facts.problem();
  FrameTree tree(problem.scene, problem.robot.X_WHand);
  const auto choose = [](const std::string&, const std::vector<constraints::Option>&) { return 0; };
  const constraints::Memo memo;
  const std::vector<math::Pose> poses(steps.size());  // Not read: bounds don't depend on poses.
  std::vector<std::optional<Ball>> located;
  std::vector<Ball> balls{{problem.robot.X_WHand.p, 0}};
  std::vector<double> weights;
  int last = -1;  // step of the last ball
  const auto add = [&](const Ball& ball, int step) {
    // k even steps over a distance d cost d²/k.
    if (step > last) {
      weights.push_back(problem.program.weights.translation / (step - last));
      balls.push_back(ball);
    }
    last = step;
  };
  for (int t = 0; t < static_cast<int>(steps.size()); ++t) {
    const BoundStep& step = steps[static_cast<size_t>(t)];
    if (!tree.AddStep(step.schema.control, step.schema.target)) return 0;
    const StepContext context(facts, memo, tree, poses, t, step.schema.control, step.schema.target, choose);
    located.push_back(Locate(context, step));
    if (const std::optional<Ball> ball = HandAt(tree, t, located)) add(*ball, t);
  }
  if (problem.program.home && !steps.empty())
    add({problem.robot.X_WHand.p, 0}, static_cast<int>(steps.size()));
  return LeastTravel(balls, weights);
}

}  // namespace tether::planning
