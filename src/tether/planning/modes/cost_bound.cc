#include "tether/planning/modes/cost_bound.h"

#include <algorithm>
#include <optional>

#include "tether/planning/modes/hand_bounds.h"

namespace tether::planning {
namespace {

using Eigen::Vector3d;

constexpr int kSweeps = 60;

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

/// The same for Σ w ‖qᵢ₊₁ − qᵢ‖: the sum of the distances between neighbouring balls.
double LeastLength(const std::vector<Ball>& balls, double weight) {
  double sum = 0;
  for (size_t i = 1; i < balls.size(); ++i) {
    const double gap = (balls[i].centre - balls[i - 1].centre).norm() - balls[i].radius - balls[i - 1].radius;
    sum += weight * std::max(0.0, gap);
  }
  return sum;
}

}  // namespace

double LowerCostBound(const SceneFacts& facts, const std::vector<BoundStep>& steps) {
  const Problem& problem = facts.problem();
  const std::optional<std::vector<HandBound>> bounds = BoundHand(facts, steps);
  if (!bounds) return 0;
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
    if (const std::optional<Ball>& ball = (*bounds)[ToIndex(t)].place) add(*ball, t);
  }
  if (problem.program.home && !steps.empty())
    add({problem.robot.X_WHand.p, 0}, static_cast<int>(steps.size()));
  if (problem.program.objective == Objective::kLength)
    return LeastLength(balls, problem.program.weights.translation);
  return LeastTravel(balls, weights);
}

}  // namespace tether::planning
