#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "tether/scene/scene.h"
#include "tether/symbolic/task.h"
#include "tether/task/product.h"

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

/// Whether `object` is in a region, or in one of a group, and nothing holds it.
bool IsIn(const scene::Scene& scene, const Truth& truth, const std::string& object, const std::string& area);

/// Judges the problem's goal. The predicates `on` (of two objects), `in` (of an object and a region or group)
/// and `inhand` (of an object) are taken from geometry; all others keep the symbolic value that they have
/// after the plan's first `actions_done` actions, applied to the initial state.
Judgement JudgeGoal(const scene::Scene& scene, const Truth& truth, const symbolic::Task& task,
                    const std::vector<std::string>& actions, int actions_done);

/// Judges a temporal goal as a plan is executed: the word that it reads has one letter for the start and one
/// for the end of each action. Propositions are judged as JudgeGoal() judges atoms.
class TemporalJudge {
 public:
  /// The first two must outlive the judge. Throws InputError if the goal names what does not exist.
  TemporalJudge(const scene::Scene& scene, const symbolic::Task& task, const task::TemporalGoal& goal);

  /// The next letter: how things are at the start, or after the next of the plan's `actions`.
  void Observe(const Truth& truth, const std::vector<std::string>& actions);
  /// Whether the letters so far make the goal true. The facts are those of the last letter that the goal
  /// asked for.
  Judgement Judge() const;

 private:
  const scene::Scene& scene_;
  const symbolic::Task& task_;
  std::vector<int> propositions_;
  ltl::LazyAutomaton automaton_;
  int state_ = ltl::LazyAutomaton::initial();
  int letters_ = 0;
  std::vector<GoalFact> facts_;
};

}  // namespace tether::experiment
