#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tether/execution/contact/touch.h"
#include "tether/execution/monitor/replanning.h"
#include "tether/execution/observer/event.h"
#include "tether/planning/plan/plan.h"
#include "tether/robot/interface.h"
#include "tether/scene/scene.h"
#include "tether/task/goal/product.h"

namespace tether::control {
struct FieldConstraint;
}

namespace tether::execution {

struct ExecutiveStatus {
  enum class State { kRunning, kFinished, kFailed };
  State state = State::kRunning;
  std::string reason;  ///< With kFailed.
};

/// How one step of the plan went.
struct StepRecord {
  int step = 0;
  double start = 0;  ///< s, of the last attempt
  double end = 0;    ///< s
  int attempts = 0;
  double position_error = 0;            ///< Of the control frame at the end of its last reach, m.
  double rotation_error = 0;            ///< rad
  std::optional<math::Pose> X_TC = {};  ///< Chosen as it ran: the plan has no key pose here.
};

/// An executive: runs a plan tick by tick, by torques (Executive) or by velocities (VelocityExecutive).
class PlanRunner {
 public:
  virtual ~PlanRunner() = default;

  /// One tick: commands for all robots of the scene.
  virtual const robot::Commands& Step(const scene::WorldEstimate& estimate,
                                      const robot::Observations& observations) = 0;
  virtual const planning::Plan& plan() const = 0;
  virtual const ExecutiveStatus& status() const = 0;
  bool running() const { return status().state == ExecutiveStatus::State::kRunning; }
  /// Index of the step that is being executed; the number of steps when finished.
  virtual int step() const = 0;
  /// The object in the hand, or empty.
  virtual const std::string& held() const = 0;
  /// Everything that happened so far, in order.
  virtual const std::vector<Event>& events() const = 0;
  /// One record per step of the plan.
  virtual const std::vector<StepRecord>& records() const = 0;
  virtual int retries() const = 0;
  /// How often the plan went on with other actions than it began with.
  virtual int replans() const { return 0; }
  /// While it is paused the arm is braked within its limits and stands still; it goes on where it was.
  virtual void Pause(bool) {}
  /// Each time that a plan was asked for.
  virtual const std::vector<PlanningRecord>& plannings() const;
  /// The goal is another from now on: a PDDL formula, or a temporal one in its place. Plans anew when the
  /// hand's present grasp or release is done; false where nothing plans anew, or the run has ended. Throws
  /// InputError for a goal that names what does not exist.
  struct Goal {
    std::string pddl;
    std::optional<task::TemporalGoal> temporal;
  };
  virtual bool ChangeGoal(const Goal&) { return false; }
  /// Pairs that the present step may bring into contact.
  virtual const TouchList& allowed() const;
  /// The present verb's own constraints, which hold besides the scenario's.
  virtual const std::vector<control::FieldConstraint>& verb_fields() const;
};

}  // namespace tether::execution
