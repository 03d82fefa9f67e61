#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "tether/common/document/value.h"
#include "tether/evaluation/log/log_settings.h"
#include "tether/evaluation/margins/run_margins.h"
#include "tether/execution/sequencer/plan_runner.h"
#include "tether/robot/kinematics.h"
#include "tether/scenario/scenario.h"
#include "tether/sim/world.h"

namespace tether::evaluation {

class LogStream;

/// What a run is at one moment.
struct RunMoment {
  double time = 0;  ///< s
  const scene::WorldEstimate& truth;
  const robot::Observations& observations;
  const robot::Commands* commands;  ///< Null: none, at the end, which is recorded whatever the time.
  const execution::PlanRunner& runner;
  RunMargins& margins;  ///< Measured while the plan runs; an interval begins when one was recorded.
  int actions_done = 0;
};

/// Writes a run's log (docs/logs.md) while the run goes on: twenty times a second of simulated time, and
/// whenever something happens, so that the goal can be judged again. Never waits.
class RunRecorder {
 public:
  /// What outlives it: scenario, scene and world. Throws InputError if the log can't be written.
  RunRecorder(const LogSettings& settings, const scenario::Scenario& scenario, const scene::Scene& scene,
              const std::vector<scenario::Event>& events, const sim::World& world,
              const execution::PlanRunner& runner);
  ~RunRecorder();

  /// One tick, after its margins and its events.
  void Observe(const RunMoment& moment);
  void Event(double time, const std::string& kind, int step, const std::string& text,
             const planning::Plan& plan);
  /// A picture that was just written to a file.
  void Picture(double time, const std::string& path);
  /// Ends the log with the run's report. Why the log is not whole; empty if it is.
  std::string Finish(double time, const Value& report);

 private:
  struct Arm {
    const scene::Robot* robot;
    robot::Kinematics kinematics;
    math::Pose X_WB;
  };

  void WriteOnce();
  void MakeTransforms();
  void MakeJoints();
  void Text(int channel, double time, Value message);
  void WriteState(const RunMoment& moment);
  void WritePlan(double time, const planning::Plan& plan);
  void WriteTransforms(const RunMoment& moment);
  void WriteJoints(const RunMoment& moment);
  void WriteCommands(const RunMoment& moment);
  void WriteContacts(double time);
  const std::string& NameText(const std::string& name);
  void WriteMargins(double time, RunMargins& margins);
  math::Pose TargetPose(const RunMoment& moment) const;
  void AddPose(const math::Pose& X);

  const scenario::Scenario& scenario_;
  const scene::Scene& scene_;
  const sim::World& world_;
  uint64_t seed_;
  std::unique_ptr<LogStream> stream_;
  std::vector<const scene::Object*> moving_;  // That may move: the others' transforms are written once.
  std::vector<Arm> arms_;
  std::vector<std::string> margin_names_;  // In the present template.
  bool margins_seen_ = false;              // Measured since the last sample.
  int transforms_ = -1, joints_ = -1, commands_ = -1, margins_template_ = -1;
  std::string modes_;  // Of commands, in the present template.
  std::vector<double> numbers_;
  std::string text_;
  std::map<std::string, std::string> name_texts_;  // Of bodies, with quotes.
  double next_ = 0;                                // Time of the next sample, s.
  int step_ = -2, done_ = -1, retries_ = -1, replans_ = -1;
  bool running_ = false;
  std::string held_;
  std::vector<std::string> actions_;  // Of the plan as it was last written.
};

}  // namespace tether::evaluation
