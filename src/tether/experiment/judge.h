#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "tether/scene/scene.h"
#include "tether/symbolic/task.h"

namespace tether::experiment {

/// The truth about the world at one moment, from the simulator, never from an estimate.
struct Truth {
  std::map<std::string, math::Pose> X_WO;
  std::map<std::string, math::Pose> X_WHand;  ///< By robot name.
  /// Sum of the normal contact forces between two bodies (object or robot names), N. Empty: nothing is
  /// grasped.
  std::function<double(const std::string&, const std::string&)> contact_force;
};

/// One atom of the goal and its truth.
struct GoalFact {
  std::string atom;  ///< "on(box,shelf)"
  bool holds = false;
  bool geometric =
      false;  ///< Judged from poses and contacts; else the symbolic value after the executed actions.
};

struct Judgement {
  bool goal_reached = false;
  std::vector<GoalFact>
      facts;  ///< Every ground atom that the goal's evaluation looked at, in the order of looking.
};

/// Whether `object` is grasped by a robot: pressed by its hand, with the grasp point in it or at most 1 cm
/// from it.
bool IsInHand(const scene::Scene& scene, const Truth& truth, const std::string& object);

/// Whether `upper` rests on `lower` and nothing holds it: contact to within 3 mm from above, centre of mass
/// above it.
bool IsOn(const scene::Scene& scene, const Truth& truth, const std::string& upper, const std::string& lower);

/// Judges the problem's goal. The predicates `on` (of two objects) and `inhand` (of one) are taken from
/// geometry; all others keep the symbolic value that they have after the plan's first `actions_done` actions,
/// applied to the initial state.
Judgement JudgeGoal(const scene::Scene& scene, const Truth& truth, const symbolic::Task& task,
                    const std::vector<std::string>& actions, int actions_done);

}  // namespace tether::experiment
