#include "tether/evaluation/run.h"

#include <algorithm>
#include <cctype>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <memory>
#include <optional>
#include <thread>

#include "tether/common/log.h"
#include "tether/common/output/output_header.h"
#include "tether/common/stop.h"
#include "tether/common/text.h"
#include "tether/evaluation/log/run_recorder.h"
#include "tether/evaluation/loop/replanning.h"
#include "tether/evaluation/margins/run_margins.h"
#include "tether/execution/sequencer/executive.h"
#include "tether/execution/sequencer/velocity_executive.h"
#include "tether/execution/servo/torque_servo.h"
#include "tether/planning/plan/plan_file.h"
#include "tether/robot/kinematics.h"
#include "tether/sim/renderer.h"
#include "tether/sim/sensor_model.h"
#include "tether/sim/world.h"
#include "tether/task/search/replanner.h"

namespace tether::evaluation {
namespace {

using Clock = std::chrono::steady_clock;

/// One run: world, executive and everything around their loop.
class Run {
 public:
  Run(const scenario::Scenario& scenario, const scene::Scene& scene, const symbolic::Task& task,
      const planning::Plan& plan, const RunOptions& options)
      : scenario_(scenario),
        scene_(scene),
        task_(task),
        options_(options),
        period_(1.0 / scenario.execution.rate),
        world_(scene, scenario.models),
        runner_(MakeRunner(scenario, scene, task, plan, options)),
        margins_(scenario, scene, *runner_, period_),
        sensors_(scenario.sensing, scene, scenario.models, options.seed),
        cost_(plan.cost),
        done_(options.events.size(), false) {
    const auto& goal = options.goal ? options.goal : scenario.goal;
    if (goal) temporal_judge_.emplace(scene, task, *goal);
    if (!options_.snapshots.empty()) {
      std::filesystem::create_directories(options_.snapshots);
      renderer_ = std::make_unique<sim::Renderer>(world_, 960, 540);
    }
    if (!options_.log.path.empty()) StartLog();
  }

  RunReport Execute() {
    const auto begin = Clock::now();
    Snapshot("start");
    try {
      Loop(begin);
      if (report_.status != RunStatus::kInterrupted) Settle(begin);
    } catch (const InputError& error) {
      // The simulation has become unstable: an outcome of this run, not a mistake of the user.
      report_.status = RunStatus::kFailed;
      report_.reason = error.what();
    }
    world_.Truth(&truth_);
    world_.Observe(&observations_);
    Log(nullptr);
    Judge();
    NameMissedEvents();
    Snapshot("end");
    report_.sim_time_s = world_.time();
    report_.wall_s = std::chrono::duration<double>(Clock::now() - begin).count();
    report_.plan = runner_->plan();
    report_.plan.cost = cost_;
    report_.steps = runner_->records();
    report_.retries = runner_->retries();
    report_.replans = runner_->replans();
    report_.margins = margins_.margins();
    report_.forces = margins_.forces();
    if (recorder_ != nullptr)
      report_.log_problem =
          recorder_->Finish(world_.time(), WriteRunReport(report_, scenario_.title, options_.seed));
    return std::move(report_);
  }

  static std::unique_ptr<execution::PlanRunner> MakeRunner(const scenario::Scenario& scenario,
                                                           const scene::Scene& scene,
                                                           const symbolic::Task& task,
                                                           const planning::Plan& plan,
                                                           const RunOptions& options) {
    const scenario::ExecutionSettings& settings = scenario.execution;
    const bool torques = settings.controller != scenario::Controller::kConstrainedVelocity;
    const bool constrained = settings.controller == scenario::Controller::kConstrainedTorque;
    if (!torques || (constrained && execution::NeedsObjectives(plan))) {
      execution::VelocityExecutiveOptions velocity = MakeVelocityOptions(scenario);
      velocity.torques = torques;
      velocity.replanning = MakeReplanning(scenario, scene, task, options);
      if (!velocity.replanning.plan_anew) velocity.alternative = MakeAlternative(scenario, task, options);
      return std::make_unique<execution::VelocityExecutive>(scene, scenario.models, scenario.actions, plan,
                                                            velocity);
    }
    execution::ExecutiveOptions torque = MakeExecutiveOptions(scenario);
    torque.replanning = MakeReplanning(scenario, scene, task, options);
    return std::make_unique<execution::Executive>(scene, scenario.models, plan, torque);
  }

 private:
  /// Other actions, for where plans are not made anew. The task outlives the run.
  static execution::Alternative MakeAlternative(const scenario::Scenario& scenario,
                                                const symbolic::Task& task, const RunOptions& options) {
    const auto replanner = std::make_shared<task::Replanner>(
        std::shared_ptr<const symbolic::Task>(&task, [](const symbolic::Task*) {}),
        options.goal ? options.goal : scenario.goal);
    return [replanner](const auto& done, const std::string& blocked, std::string& reason) {
      return replanner->Find(done, blocked, reason);
    };
  }

  /// Nothing for temporal goals.
  static execution::ReplanningOptions MakeReplanning(const scenario::Scenario& scenario,
                                                     const scene::Scene& scene, const symbolic::Task& task,
                                                     const RunOptions& options) {
    execution::ReplanningOptions replanning;
    if (!options.replan || options.goal || scenario.goal || scenario.problem == nullptr) return replanning;
    replanning.plan_anew = MakePlanAnew(scenario, scene, options.stop);
    // The task outlives the run.
    replanning.task = std::shared_ptr<const symbolic::Task>(&task, [](const symbolic::Task*) {});
    return replanning;
  }

  static execution::ExecutiveOptions MakeExecutiveOptions(const scenario::Scenario& scenario) {
    const scenario::ExecutionSettings& settings = scenario.execution;
    execution::ExecutiveOptions options;
    options.period = 1.0 / settings.rate;
    if (settings.gain) options.gains.position = options.gains.rotation = *settings.gain;
    if (settings.damping) options.gains.position_damping = options.gains.rotation_damping = *settings.damping;
    options.gains.Validate();
    options.constrained = settings.controller == scenario::Controller::kConstrainedTorque;
    options.servo.constraints = scenario.control_constraints;
    options.servo.max_force = settings.max_force;
    options.servo.max_force_where = settings.max_force_where;
    return options;
  }

  void Loop(Clock::time_point begin) {
    while (runner_->running()) {
      if (IsStopped(options_.stop)) {
        report_.status = RunStatus::kInterrupted;
        report_.reason = "interrupted";
        return;
      }
      if (world_.time() > scenario_.execution.timeout_s) {
        report_.status = RunStatus::kTimeout;
        report_.reason =
            "the plan was not finished after " + Fixed(world_.time(), 1) + " s (execution: timeout)";
        return;
      }
      Tick(begin);
    }
    const execution::ExecutiveStatus& status = runner_->status();
    if (status.state == execution::ExecutiveStatus::State::kFailed) {
      report_.status = RunStatus::kFailed;
      report_.reason = status.reason;
    }
  }

  void StartLog() {
    LogSettings settings = options_.log;
    settings.seed = options_.seed;
    settings.realtime = options_.realtime;
    if (options_.goal) {
      settings.goal = options_.goal->formula.ToString();
      settings.semantics = ToString(options_.goal->semantics);
    }
    recorder_ = std::make_unique<RunRecorder>(settings, scenario_, scene_, options_.events, world_, *runner_);
  }

  void Settle(Clock::time_point begin) {
    const double end = world_.time() + options_.settle_s;
    while (world_.time() < end && !IsStopped(options_.stop)) Tick(begin);
  }

  void Tick(Clock::time_point begin) {
    world_.Truth(&truth_);
    history_.Add(world_.time(), truth_.X_WO);
    world_.Observe(&observations_);
    const bool exact = sensors_.exact();
    if (!exact) sensors_.Sense(truth_, observations_, &estimate_, &sensed_);
    const robot::Commands& commands =
        exact ? runner_->Step(truth_, observations_) : runner_->Step(estimate_, sensed_);
    if (runner_->running()) {
      margins_.Observe(world_, truth_, observations_, commands, *runner_);
    }
    if (temporal_judge_) {
      temporal_judge_->Feed([this] { return MakeTruth(); }, runner_->plan().actions, ActionsDone(),
                            runner_->running());
    }
    TakeEvents();
    Disturb();
    Log(&commands);
    world_.Apply(commands, period_);
    if (options_.realtime) {
      std::this_thread::sleep_until(
          begin + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(world_.time())));
    }
  }

  /// Hands the recorder what this tick is.
  void Log(const robot::Commands* commands) {
    if (recorder_ == nullptr) return;
    recorder_->Observe({world_.time(), truth_, observations_, commands, *runner_, margins_, ActionsDone()});
  }

  /// Records what the executive did in this tick.
  void TakeEvents() {
    started_.clear();
    for (; seen_ < runner_->events().size(); ++seen_) {
      const execution::Event event = runner_->events()[seen_];
      if (event.kind == execution::EventKind::kActionStarted) started_.push_back(event.text);
      Record(event.time, std::string(execution::ToString(event.kind)), event.step, event.text);
      if (event.kind == execution::EventKind::kStalled) LogContacts();
      if (event.kind == execution::EventKind::kStepStarted ||
          event.kind == execution::EventKind::kStepFinished)
        LogPoses();
      if (event.kind == execution::EventKind::kStepFinished) {
        const auto& steps = runner_->plan().steps;
        Snapshot(event.step < static_cast<int>(steps.size()) ? steps[event.step].action : "step");
      }
    }
  }

  void Disturb() {
    for (size_t i = 0; i < options_.events.size(); ++i) {
      const scenario::Event& event = options_.events[i];
      const bool starts = std::find(started_.begin(), started_.end(), event.starts) != started_.end();
      const bool now = event.starts.empty() ? world_.time() >= event.time : starts;
      if (done_[i] || !now) continue;
      done_[i] = true;
      Record(world_.time(), "disturbance", runner_->step(), event.Describe());
      if (!event.robot.empty()) {
        world_.PushArm(event.robot, event.torques, event.over);
      } else {
        world_.MoveObject(event.object, Goal(event), event.over, event.steady);
      }
    }
  }

  /// Events that never started are reported: the run did not test what it should.
  void NameMissedEvents() {
    for (size_t i = 0; i < options_.events.size(); ++i) {
      if (done_[i]) continue;
      const scenario::Event& event = options_.events[i];
      const std::string why = event.starts.empty() ? "the run ended before " + Fixed(event.time, 2) + " s"
                                                   : "'" + event.starts + "' never started";
      Record(world_.time(), "never_happened", runner_->step(), event.Describe() + ": " + why);
    }
  }

  /// What touches what, for --verbose: why a motion may have stopped.
  void LogContacts() const {
    std::vector<std::string> bodies;
    for (const scene::Object& object : scene_.objects) bodies.push_back(object.name);
    for (const scene::Robot& robot : scene_.robots) bodies.push_back(robot.name);
    for (size_t i = 0; i < bodies.size(); ++i) {
      for (size_t j = i + 1; j < bodies.size(); ++j) {
        const double force = world_.ContactForce(bodies[i], bodies[j]);
        if (force > 0)
          LogDebug(bodies[i] + " and " + bodies[j] + " press with " + std::to_string(force) + " N");
      }
    }
  }

  /// Where things truly are, for --verbose.
  void LogPoses() const {
    for (const scene::Object& object : scene_.objects) {
      if (!object.movable()) continue;
      const math::Pose& X = truth_.X_WO.at(object.name);
      const Eigen::Vector3d w = math::LogSO3(X.R);
      char text[200];
      FormatInto(text, sizeof text, "%s at (%.4f, %.4f, %.4f) m, turned (%.3f, %.3f, %.3f) rad",
                 object.name.c_str(), X.p.x(), X.p.y(), X.p.z(), w.x(), w.y(), w.z());
      LogDebug(text);
    }
  }

  math::Pose Goal(const scenario::Event& event) const {
    if (!event.has_goal) {
      const math::Pose& X = truth_.X_WO.at(event.object);
      return {event.X_by.R * X.R, event.X_by.p + X.p};
    }
    const auto parent = truth_.X_WO.find(event.parent);
    return (parent != truth_.X_WO.end() ? parent->second : scene_.InitialPose(event.parent)) *
           event.X_ParentGoal;
  }

  void Record(double time, const std::string& kind, int step, const std::string& text) {
    report_.events.push_back({time, kind, step, text});
    if (recorder_ != nullptr) recorder_->Event(time, kind, step, text, runner_->plan());
    if (options_.on_event) options_.on_event(time, kind, text);
  }

  void Snapshot(const std::string& label) {
    if (renderer_ == nullptr) return;
    char number[16];
    FormatInto(number, sizeof number, "%02d_", static_cast<int>(report_.snapshots.size()));
    std::string name = number;
    for (char c : label) {
      if (std::isalnum(static_cast<unsigned char>(c)) || c == '-')
        name += c;
      else if (!name.ends_with("_"))
        name += '_';
    }
    while (name.ends_with("_")) name.pop_back();
    report_.snapshots.push_back((std::filesystem::path(options_.snapshots) / (name + ".png")).string());
    renderer_->WritePng(world_, report_.snapshots.back());
    if (recorder_ != nullptr) recorder_->Picture(world_.time(), report_.snapshots.back());
  }

  int ActionsDone() const {
    const auto& steps = runner_->plan().steps;
    const int step = runner_->step();
    return step >= static_cast<int>(steps.size()) ? static_cast<int>(runner_->plan().actions.size())
                                                  : steps[step].action_index;
  }

  Truth MakeTruth() const {
    Truth truth;
    truth.X_WO = world_.Truth().X_WO;
    for (const auto& [name, observation] : world_.Observe()) {
      robot::Kinematics kinematics(scenario_.models.at(name));
      kinematics.Set(observation.q);
      truth.X_WHand[name] = scene_.InitialPose(name) * kinematics.X_BH();
    }
    truth.X_WO_before = history_.Before(world_.time());
    truth.contact_force = [this](const std::string& a, const std::string& b) {
      return world_.ContactForce(a, b);
    };
    return truth;
  }

  void Judge() {
    const Truth truth = MakeTruth();
    for (const scene::Object& object : scene_.objects)
      report_.final_X_WO[object.name] = truth.X_WO.at(object.name);
    if (temporal_judge_) {
      report_.judgement = temporal_judge_->Judge(truth);
    } else {
      report_.judgement = JudgeGoal(scene_, truth, task_, runner_->plan().actions, ActionsDone());
    }
    if (report_.status != RunStatus::kNotCalled) return;
    report_.status = report_.judgement.goal_reached ? RunStatus::kSuccess : RunStatus::kGoalMissed;
  }

  const scenario::Scenario& scenario_;
  const scene::Scene& scene_;
  const symbolic::Task& task_;
  const RunOptions& options_;
  double period_;
  sim::World world_;
  std::unique_ptr<execution::PlanRunner> runner_;
  RunMargins margins_;
  sim::SensorModel sensors_;
  std::optional<TemporalJudge> temporal_judge_;
  double cost_ = 0;
  std::unique_ptr<sim::Renderer> renderer_;
  scene::WorldEstimate truth_;
  robot::Observations observations_;
  scene::WorldEstimate estimate_;  ///< What sensors give of the truth, where they are not exact.
  robot::Observations sensed_;
  PoseHistory history_;  ///< From which the judge tells rest.
  size_t seen_ = 0;
  std::vector<std::string> started_;  ///< Actions that started in this tick.
  std::vector<bool> done_;            ///< Per disturbance.
  RunReport report_;
  std::unique_ptr<RunRecorder> recorder_;  ///< Null: no log.
};

}  // namespace

std::string ToString(RunStatus status) {
  switch (status) {
    case RunStatus::kNotCalled:
      return "not_called";
    case RunStatus::kSuccess:
      return "success";
    case RunStatus::kGoalMissed:
      return "goal_missed";
    case RunStatus::kFailed:
      return "failed";
    case RunStatus::kTimeout:
      return "timeout";
    case RunStatus::kInterrupted:
      return "interrupted";
  }
  return "not_called";
}

void RequireRunnable(const scenario::Scenario& scenario, const symbolic::Task& task,
                     const planning::Plan& plan) {
  Run::MakeRunner(scenario, scenario.scene, task, plan, {});
}

execution::VelocityExecutiveOptions MakeVelocityOptions(const scenario::Scenario& scenario) {
  const scenario::ExecutionSettings& settings = scenario.execution;
  execution::VelocityExecutiveOptions options;
  options.period = 1.0 / settings.rate;
  options.constraints = scenario.control_constraints;
  if (settings.controller != scenario::Controller::kConstrainedVelocity) {
    control::OperationalSpaceGains& gains = options.torque.gains;
    if (settings.gain) gains.position = gains.rotation = *settings.gain;
    if (settings.damping) gains.position_damping = gains.rotation_damping = *settings.damping;
    options.constraints = execution::TorqueConstraints(options.constraints, scenario.scene);
    options.max_force = settings.max_force;
    return options;
  }
  if (settings.gain) options.controller.gain = *settings.gain;
  if (settings.damping) options.controller.damping = *settings.damping;
  return options;
}

RunReport RunPlan(const scenario::Scenario& scenario, const scene::Scene& scene, const symbolic::Task& task,
                  const planning::Plan& plan, const RunOptions& options) {
  return Run(scenario, scene, task, plan, options).Execute();
}

Value WriteRunReport(const RunReport& report, const std::string& scenario, uint64_t seed) {
  Value actions = Value::Array(), steps = Value::Array(), events = Value::Array(), facts = Value::Array();
  for (const std::string& action : report.plan.actions) actions.Append(action);
  for (size_t i = 0; i < report.steps.size() && i < report.plan.steps.size(); ++i) {
    const execution::StepRecord& record = report.steps[i];
    planning::PlanStep executed = report.plan.steps[i];
    executed.X_TC = record.X_TC.value_or(executed.X_TC);
    Value step = planning::WriteStep(executed, false);
    step.Set("start_s", record.start).Set("end_s", record.end).Set("attempts", record.attempts);
    step.Set("position_error_m", record.position_error).Set("rotation_error_rad", record.rotation_error);
    steps.Append(step);
  }
  for (const RunEvent& event : report.events) {
    events.Append(Value::Object()
                      .Set("time_s", event.time)
                      .Set("kind", event.kind)
                      .Set("step", event.step)
                      .Set("text", event.text));
  }
  for (const GoalFact& fact : report.judgement.facts) {
    facts.Append(Value::Object()
                     .Set("atom", fact.atom)
                     .Set("holds", fact.holds)
                     .Set("judged_by", fact.geometric ? "geometry" : "effects")
                     .Set("lapsed", fact.lapsed));
  }
  Value margins = Value::Array();
  for (const Margin& margin : report.margins) margins.Append(WriteMargin(margin));
  Value snapshots = Value::Array();
  for (const std::string& file : report.snapshots) snapshots.Append(file);
  Value value = OutputHeader("tether.run/1", seed);
  value.Set("scenario", scenario).Set("status", ToString(report.status));
  value.Set("goal_reached", report.judgement.goal_reached).Set("reason", report.reason);
  value.Set("sim_time_s", report.sim_time_s).Set("wall_s", report.wall_s).Set("actions", actions);
  value.Set("cost", report.plan.cost).Set("steps", steps).Set("retries", report.retries);
  value.Set("replans", report.replans).Set("goal", facts).Set("events", events).Set("margins", margins);
  value.Set("unintended_forces", WriteForces(report.forces));
  Value poses = Value::Object();
  for (const auto& [object, X_WO] : report.final_X_WO) {
    const Eigen::Quaterniond q(X_WO.R);
    poses.Set(object,
              Value::Object()
                  .Set("position", Eigen::VectorXd(X_WO.p))
                  .Set("quaternion_wxyz", Eigen::VectorXd(Eigen::Vector4d(q.w(), q.x(), q.y(), q.z()))));
  }
  value.Set("final_poses", poses).Set("snapshots", snapshots);
  return value;
}

}  // namespace tether::evaluation
