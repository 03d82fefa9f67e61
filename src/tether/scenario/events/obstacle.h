#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "tether/scenario/scenario.h"

namespace tether::scenario {

/// An obstacle that a campaign adds to a scenario's clearances, and how it moves during a run.
struct Obstacle {
  scene::Object object;  ///< Fixed, with a name of its own.
  Event event;
};

/// A post of 5 × 5 cm, 5 to 25 cm high, that stands on what carries the regions and slides to another place,
/// at 0.1 m/s on average. Both places and all between are such that the task stays possible: further from
/// every region that things stand in than half its radius and the open hand, from hubs than 20 cm, from the
/// robot's axis than 20 cm, and 3 cm clear of everything else. The place it goes to is within 30 cm of a
/// region. One run in four has it moved before the arm starts, the others at a time drawn from the first 5 s
/// per action. Empty if there is no such place.
std::optional<Obstacle> DrawMovedObstacle(const Scenario& scenario, const scene::Scene& start, int actions,
                                          uint64_t seed);

/// A ball of 4 to 6 cm radius that crosses the space between the hub and a region on a level line at 0.2 m/s,
/// above everything that stands there, at a time drawn from the first 4.5 s per action. The line is so far
/// from the robot's axis that turning the first joint is enough to evade the ball. Empty if there is no such
/// line.
std::optional<Obstacle> DrawCrossingObstacle(const Scenario& scenario, const scene::Scene& start, int actions,
                                             uint64_t seed);

/// Adds the obstacle to the scene (the scenario's, or a perturbed one), and to what every clearance of the
/// scenario keeps away from.
void AddObstacle(const Obstacle& obstacle, scene::Scene& scene, Scenario& scenario);

}  // namespace tether::scenario
