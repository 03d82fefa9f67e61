#pragma once

#include <memory>

#include "tether/execution/contact/touch.h"
#include "tether/execution/servo/progress.h"
#include "tether/execution/servo/situation.h"
#include "tether/planning/skeleton/action.h"
#include "tether/robot/interface.h"
#include "tether/scene/scene.h"

namespace tether::control {
struct FieldConstraint;
}

namespace tether::execution {

/// Moves the arm for the sequencer: what it commands, and when a motion has arrived or can't, is its own;
/// what comes next is the sequencer's. All calls are made within a tick; none blocks or throws.
class Servo {
 public:
  virtual ~Servo() = default;

  /// Sets what the commands to all robots have in every tick.
  virtual void Prepare(robot::Commands* commands) const = 0;
  /// The situation holds what is measured at this tick, but for the hand's pose and velocity: they are set.
  virtual void Sense() = 0;
  /// The first tick with a trustworthy measurement: nothing moves yet.
  virtual void Begin() = 0;
  /// A step begins, or begins anew.
  virtual void BeginStep() = 0;
  /// A verb begins; also after BeginStep().
  virtual void BeginVerb() = 0;

  virtual Progress Reach(const planning::ReachVerb& reach) = 0;
  virtual Progress Shift(const planning::ShiftVerb& shift) = 0;
  /// The hand rests where it is, relative to what it touches if that moves; `first`: it begins to.
  virtual void Rest(bool first) = 0;
  /// How wide the hand opens here, m.
  virtual double WidestOpening() = 0;
  /// What is held weighs, as far as the joints' torques tell, kg; 0: not known.
  virtual double HeldMass() const { return 0; }
  /// The situation says that an object is held, or that nothing is.
  virtual void HeldChanged() = 0;
  /// The torques that hold what the hand carries, n, Nm, as of the last tick; null: none are known of.
  virtual const Eigen::VectorXd* Carried() const { return nullptr; }
  /// A fault has ended, and the situation is no longer `stopping`: the verb goes on from where the arm is.
  virtual void Resume() {}
  /// What was being done ends here: the step was given up, or the run has ended.
  virtual void Stop() = 0;

  /// The commands of this tick, the gripper's excepted. Where what is measured can't be trusted, safe ones.
  virtual void Command(const robot::Observations& observations, robot::Commands* commands) = 0;

  /// Pairs that the present step may bring into contact.
  virtual const TouchList& allowed() const;
  /// The present verb's own constraints, which hold besides the scenario's.
  virtual const std::vector<control::FieldConstraint>& verb_fields() const;
};

}  // namespace tether::execution
