#pragma once

#include <string>
#include <vector>

#include "tether/planning/plan/problem.h"

namespace tether::planning {

/// What the path of the hand costs. Paper A, eq. (4), or the same of lengths (Objective).
struct HandCost {
  double travel = 0;
  double turn = 0;
  double total() const { return travel + turn; }
};

/// The cost of the hand's path from its start through these key poses, and home if the problem asks for it.
HandCost CostOfHand(const Problem& problem, const std::vector<math::Pose>& X_WHand);

/// How far the hand at X_WHand is out of the arm's reach, m; below zero within it. Not without an arm.
double OutOfReach(const ActingRobot& robot, const math::Pose& X_WHand);

/// The same in words that follow an action: "the hand would be 3.7 cm too near to the base of panda".
std::string SayReach(const ActingRobot& robot, const math::Pose& X_WHand);

}  // namespace tether::planning
