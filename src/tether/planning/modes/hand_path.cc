#include "tether/planning/modes/hand_path.h"

#include <algorithm>
#include <cstdio>

namespace tether::planning {

HandCost CostOfHand(const Problem& problem, const std::vector<math::Pose>& X_WHand) {
  HandCost cost;
  math::Pose before = problem.robot.X_WHand;
  const auto visit = [&](const math::Pose& X_WH) {
    const double angle = math::AngleBetween(before.R, X_WH.R);
    const double distance = (X_WH.p - before.p).norm();
    const bool length = problem.program.objective == Objective::kLength;
    cost.travel += problem.program.weights.translation * (length ? distance : distance * distance);
    cost.turn += problem.program.weights.rotation * (length ? angle : angle * angle);
    before = X_WH;
  };
  for (const math::Pose& X_WH : X_WHand) visit(X_WH);
  if (problem.program.home && !X_WHand.empty()) visit(problem.robot.X_WHand);
  return cost;
}

double OutOfReach(const ActingRobot& robot, const math::Pose& X_WHand) {
  const robot::Reach& reach = robot.model->reach();
  const double distance = (robot.X_WBase.Inverse() * (X_WHand * reach.wrist_hand) - reach.centre).norm();
  return std::max(distance - reach.max, reach.min - distance);
}

std::string SayReach(const ActingRobot& robot, const math::Pose& X_WHand) {
  const robot::Reach& reach = robot.model->reach();
  const double distance = (robot.X_WBase.Inverse() * (X_WHand * reach.wrist_hand) - reach.centre).norm();
  const bool near = distance < reach.min;
  char text[96];
  std::snprintf(text, sizeof text, "the hand would be %.1f cm %s%s",
                100 * (near ? reach.min - distance : distance - reach.max),
                near ? "too near to the base of " : "beyond the reach of ", robot.name.c_str());
  return text;
}

}  // namespace tether::planning
