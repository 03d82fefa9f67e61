#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "tether/evaluation/judge.h"
#include "tether/evaluation/log/log_settings.h"
#include "tether/evaluation/margins/force_record.h"
#include "tether/evaluation/margins/margins.h"
#include "tether/execution/sequencer/plan_runner.h"
#include "tether/execution/sequencer/velocity_executive.h"
#include "tether/planning/plan/plan.h"
#include "tether/scenario/scenario.h"

namespace tether::evaluation {

struct RunOptions {
  uint64_t seed = 0;
  std::vector<scenario::Event> events;     ///< Disturbances.
  bool realtime = false;                   ///< Not faster than the clock on the wall.
  std::string snapshots;                   ///< Folder for a picture at each step boundary; empty: none.
  std::optional<task::TemporalGoal> goal;  ///< In place of the scenario's.
  LogSettings log;                         ///< Where to write what happens; its seed and goal are set.
  bool replan = true;                      ///< Plan anew when what is observed no longer allows the plan.
  double settle_s = 1.0;  ///< Simulated time between the end of the plan and the judgement, s.
  const std::atomic<bool>* stop = nullptr;   ///< The arm stops, and the run ends.
  const std::atomic<bool>* pause = nullptr;  ///< While it is set the arm stands still.
  /// Called for everything that happens, in order: time (s), a word for the kind, text for people.
  std::function<void(double, const std::string&, const std::string&)> on_event;
};

/// How a run ended.
enum class RunStatus {
  kNotCalled,
  kSuccess,      ///< The plan was executed and the goal is reached.
  kGoalMissed,   ///< The plan was executed, but the goal is not reached.
  kFailed,       ///< Execution failed: see `reason`.
  kTimeout,      ///< The scenario's execution timeout passed.
  kInterrupted,  ///< Stopped by the user.
};
/// "success", "goal_missed", "failed", "timeout" or "interrupted".
std::string ToString(RunStatus status);

struct RunEvent {
  double time = 0;   ///< s
  std::string kind;  ///< An execution::EventKind by name, or "disturbance".
  int step = -1;
  std::string text;
};

struct RunReport {
  RunStatus status = RunStatus::kNotCalled;
  std::string reason;
  Judgement judgement;
  double sim_time_s = 0;
  double wall_s = 0;
  planning::Plan plan;
  std::vector<execution::StepRecord> steps;
  int retries = 0;
  int replans = 0;
  std::vector<execution::PlanningRecord> plannings;  ///< Each time that a plan was asked for.
  std::vector<RunEvent> events;
  /// While the plan ran: of the scenario's control constraints; of torque runs also of clearances of the arm
  /// from everything that no step intends, torques, torque rates and unintended forces.
  std::vector<Margin> margins;
  ForceSummary forces;                           ///< That no step intends, while the plan ran.
  std::map<std::string, math::Pose> final_X_WO;  ///< Where each object is in the end, in the world.
  std::vector<std::string> snapshots;            ///< Files written.
  std::string log_problem;  ///< Why the log is not whole; empty: it is, or there is none.

  bool ok() const { return status == RunStatus::kSuccess; }
};

/// The scenario's settings of the executive that follows objectives, by velocities or by torques.
execution::VelocityExecutiveOptions MakeVelocityOptions(const scenario::Scenario& scenario);

/// Executes a plan in the simulation, starting from `scene`, and judges the scenario's goal from the
/// simulator's true state. The same scenario, scene, plan and events give the same run, bit for bit. Throws
/// InputError for what can't be simulated or executed.
RunReport RunPlan(const scenario::Scenario& scenario, const scene::Scene& scene, const symbolic::Task& task,
                  const planning::Plan& plan, const RunOptions& options);

/// Throws InputError for what RunPlan() can't execute of a plan, without running it.
void RequireRunnable(const scenario::Scenario& scenario, const symbolic::Task& task,
                     const planning::Plan& plan);

/// The report in format `tether.run/1`.
Value WriteRunReport(const RunReport& report, const std::string& scenario, uint64_t seed);

}  // namespace tether::evaluation
