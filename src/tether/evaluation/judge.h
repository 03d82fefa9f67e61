#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "tether/evaluation/pose_history.h"
#include "tether/scene/scene.h"
#include "tether/symbolic/grounding/task.h"
#include "tether/task/goal/product.h"

namespace tether::evaluation {

/// The truth about the world at one moment, from the simulator, never from an estimate.
struct Truth {
  std::map<std::string, math::Pose> X_WO;
  std::map<std::string, math::Pose> X_WHand;  ///< By robot name.
  /// Poses kRestWindow earlier, of all objects; empty: all are at rest.
  std::map<std::string, math::Pose> X_WO_before = {};
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
  /// It held during the run and, by the effects of the actions, should still hold, but does not.
  bool lapsed = false;
};

struct Judgement {
  bool goal_reached = false;
  std::vector<GoalFact> facts;  ///< Every ground atom that the goal's evaluation read, in order.
};

/// Whether `object` is grasped by a robot: pressed by its hand, with the grasp point in it or at most 1 cm
/// from it.
bool IsInHand(const scene::Scene& scene, const Truth& truth, const std::string& object);

/// Whether `upper` rests on `lower` and nothing holds it: contact to within 3 mm from above, centre of mass
/// above it, stood on a face or lying on a side (to 0.1 rad: what leans is not on), and not moving relative
/// to it (2 cm/s, and 0.2 rad/s or what rolling at that speed is, in the mean over kRestWindow).
bool IsOn(const scene::Scene& scene, const Truth& truth, const std::string& upper, const std::string& lower);

/// Whether `object` is in a region, or in one of a group, and nothing holds it.
bool IsIn(const scene::Scene& scene, const Truth& truth, const std::string& object, const std::string& area);

/// Judges the problem's goal. The predicates `on` (of two objects), `in` (of an object and a region or group)
/// and `inhand` (of an object) are judged by geometry; all others have the symbolic value after the plan's
/// first `actions_done` actions, applied to the initial state.
Judgement JudgeGoal(const scene::Scene& scene, const Truth& truth, const symbolic::Task& task,
                    const std::vector<std::string>& actions, int actions_done);

/// Judges a temporal goal as a plan is executed. Conjuncts of the goal with an X read a word that has one
/// letter for the start and one for the end of each action. Those without read all samples: while an action
/// runs, atoms among its effects keep the value that they had when it began. Propositions are judged as
/// JudgeGoal() judges atoms.
class TemporalJudge {
 public:
  /// The first two must outlive the judge. Throws InputError if the goal names what does not exist.
  TemporalJudge(const scene::Scene& scene, const symbolic::Task& task, const task::TemporalGoal& goal);

  /// Reads what there is to read when the first `done` of the plan's actions are done and, if `running`, the
  /// next one runs: letters at the start and after each action, samples in between. Asks for the truth only
  /// then.
  void Feed(const std::function<Truth()>& truth, const std::vector<std::string>& actions, int done,
            bool running);
  /// Reads the letter at the start, or after the next of the plan's `actions`.
  void Observe(const Truth& truth, const std::vector<std::string>& actions);
  /// Reads a sample in between. `running`: the action that runs, or empty.
  void Sample(const Truth& truth, const std::string& running);
  /// Whether further samples can change the result.
  bool NeedsSamples() const { return !sampled_.automaton.IsSettled(sampled_.state); }
  /// Whether the goal is true of what was observed so far. The facts are all atoms of the goal as they are
  /// in `truth`, in the order of the formula; those that held before and still should are marked.
  Judgement Judge(const Truth& truth) const;

 private:
  /// Some of the conjuncts, as an automaton with its present state.
  struct Part {
    Part(const ltl::Formula& formula, const symbolic::Task& task, const task::TemporalGoal& goal);
    std::vector<int> propositions;
    ltl::LazyAutomaton automaton;
    int state = ltl::LazyAutomaton::initial();
  };
  using Values = std::function<bool(int atom)>;

  void Step(Part& part, const Values& holds);
  GoalFact JudgeNumber(int atom, const Truth& truth) const;

  const scene::Scene& scene_;
  const symbolic::Task& task_;
  std::vector<int> atoms_;  ///< Of the task, that the goal names.
  Part bounded_, sampled_;
  symbolic::State symbolic_;         ///< After the actions so far.
  std::map<int, bool> at_boundary_;  ///< Values when the last letter was read.
  std::map<int, bool> held_;         ///< Atoms that held in some letter or sample.
  std::string running_;
  std::vector<int> effects_;  ///< Atoms among the effects of `running_`.
  int letters_ = 0;
};

}  // namespace tether::evaluation
