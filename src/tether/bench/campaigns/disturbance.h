#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "tether/planning/plan/plan.h"
#include "tether/scenario/events/obstacle.h"
#include "tether/scenario/scenario.h"

namespace tether::bench {

/// What is done to a run, drawn at random: one to three of
///
/// - moved: a movable object is moved by 5 to 35 cm on what it stands on;
/// - support: what something is put onto, or a fixed object that does not carry the robot, is moved by as
/// much;
/// - knocked: what was put down is pushed aside by its own width or more, or thrown onto something else;
/// - crossing: a ball crosses the arm's space at 0.2 m/s;
/// - pushed: the arm is pushed with up to 20 Nm on joints 1 to 4, or up to 5 Nm on those after, for 0.3 s.
///
/// At random times of the first 5 s per action, or as an action starts; nothing is faster than 0.25 m/s.
struct Disturbances {
  std::vector<std::string> kinds;
  std::vector<scenario::Event> events;
  std::optional<scenario::Obstacle> obstacle;  ///< Its event is among `events`.
};

Disturbances DrawDisturbances(const scenario::Scenario& scenario, const scene::Scene& start,
                              const planning::Plan& plan, uint64_t seed);

}  // namespace tether::bench
