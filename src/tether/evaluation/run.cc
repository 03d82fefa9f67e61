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
#include "tether/common/stop.h"
#include "tether/common/text.h"
#include "tether/evaluation/log/run_recorder.h"
#include "tether/evaluation/loop/disturber.h"
#include "tether/evaluation/loop/replanning.h"
#include "tether/evaluation/margins/run_margins.h"
#include "tether/execution/sequencer/executive.h"
#include "tether/execution/sequencer/velocity_executive.h"
#include "tether/execution/servo/torque_servo.h"
#include "tether/planning/modes/region_domain.h"
#include "tether/robot/kinematics.h"
#include "tether/sim/renderer.h"
#include "tether/sim/sensing/fault_model.h"
#include "tether/sim/sensing/sensor_model.h"
#include "tether/sim/world.h"
#include "tether/task/search/replanner.h"

namespace tether::evaluation {
namespace {

using Clock = std::chrono::steady_clock;

// An arm whose joints are slower than this has stopped, rad/s.
constexpr double kArmRests = 0.02;

/// One run: world, executive and everything around their loop.
class Run {
 public:
  Run(const scenario::Scenario& scenario, const scene::Scene& scene, const symbolic::Task& task,
      const planning::Plan& plan, const RunOptions& options)
      : scenario_(scenario),
        scene_(SceneOfRun(scenario, scene)),
        task_(&task),
        options_(options),
        period_(1.0 / scenario.execution.rate),
        world_(scene_, scenario.models),
        runner_(MakeRunner(scenario, scene_, task, plan, options)),
        margins_(scenario, scene_, *runner_, period_),
        sensors_(scenario.sensing, scene_, scenario.models, options.seed),
        cost_(plan.cost),
        disturber_(scene_, options.events, options.seed, world_) {
    const auto& goal = options.goal ? options.goal : scenario.goal;
    if (goal) temporal_judge_.emplace(scene_, task, *goal);
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
    report_.plannings = runner_->plannings();
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
  /// In the domain of regions, what has come to lie in none of them is at its spot.
  static scene::Scene SceneOfRun(const scenario::Scenario& scenario, const scene::Scene& scene) {
    return scenario.problem != nullptr && scenario.task.domain.empty() ? planning::WithSpots(scene) : scene;
  }

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

  static execution::ReplanningOptions MakeReplanning(const scenario::Scenario& scenario,
                                                     const scene::Scene& scene, const symbolic::Task& task,
                                                     const RunOptions& options) {
    execution::ReplanningOptions replanning;
    if (!options.replan || scenario.problem == nullptr) return replanning;
    replanning.goal = options.goal ? options.goal : scenario.goal;
    replanning.latency = scenario.planning.latency;
    replanning.waits = !options.realtime;
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
    options.faults.pose_silence = execution::PoseSilence(scenario.sensing);
    return options;
  }

  void Loop(Clock::time_point begin) {
    while (runner_->running()) {
      if (IsStopped(options_.stop)) {
        StopArm(begin);
        report_.status = RunStatus::kInterrupted;
        report_.reason = "interrupted";
        return;
      }
      const bool pause = options_.pause != nullptr && options_.pause->load();
      runner_->Pause(pause);
      if (pause) {
        // Time goes on as it does on the wall, and does not count.
        paused_ += period_;
        std::this_thread::sleep_for(std::chrono::duration<double>(options_.realtime ? 0 : period_));
      }
      if (world_.time() - paused_ > scenario_.execution.timeout_s) {
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

  /// Brakes the arm within its limits.
  void StopArm(Clock::time_point begin) {
    constexpr double kLongest = 0.4;  // s; a stop takes less
    if (world_.time() <= 0) return;
    runner_->Pause(true);
    const double end = world_.time() + kLongest;
    for (bool moves = true; moves && world_.time() < end;) {
      Tick(begin);
      moves = std::any_of(observations_.begin(), observations_.end(),
                          [](const auto& entry) { return entry.second.v.cwiseAbs().maxCoeff() > kArmRests; });
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
    const scene::WorldEstimate& visible = Visible();
    const bool faulty = faults_.active(world_.time());
    const bool exact = sensors_.exact() && !faulty;
    if (!exact) sensors_.Sense(visible, observations_, &estimate_, &sensed_);
    if (faulty) faults_.Distort(world_.time(), &estimate_, &sensed_);
    const robot::Commands& commands =
        exact ? runner_->Step(visible, observations_) : runner_->Step(estimate_, sensed_);
    if (runner_->running()) {
      margins_.Observe(world_, truth_, observations_, commands, *runner_);
    }
    if (temporal_judge_) {
      temporal_judge_->Feed([this] { return MakeTruth(); }, runner_->plan().actions, ActionsDone(),
                            runner_->running());
    }
    TakeEvents();
    Disturb(exact ? visible : estimate_, exact ? observations_ : sensed_, commands);
    Log(&commands);
    Apply(commands);
    if (options_.realtime) {
      std::this_thread::sleep_until(
          begin + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(world_.time())));
    }
  }

  void Apply(const robot::Commands& commands) {
    if (!faults_.active(world_.time())) return world_.Apply(commands, period_);
    distorted_ = commands;
    faults_.Distort(world_.time(), &distorted_);
    world_.Apply(distorted_, period_);
  }

  const scene::WorldEstimate& Visible() {
    if (disturber_.removed().empty()) return truth_;
    visible_ = truth_;
    for (const std::string& object : disturber_.removed()) visible_.X_WO.erase(object);
    return visible_;
  }

  /// Hands the recorder what this tick is.
  void Log(const robot::Commands* commands) {
    if (recorder_ == nullptr) return;
    recorder_->Observe({world_.time(), truth_, observations_, commands, *runner_, margins_, ActionsDone()});
  }

  /// Records what the executive did in this tick.
  void TakeEvents() {
    for (; seen_ < runner_->events().size(); ++seen_) {
      const execution::Event event = runner_->events()[seen_];
      if (event.kind == execution::EventKind::kActionStarted) moment_.started.push_back(event.text);
      if (event.kind == execution::EventKind::kStepStarted) moment_.steps.push_back(event.step);
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

  void Disturb(const scene::WorldEstimate& estimate, const robot::Observations& seen,
               const robot::Commands& commands) {
    const int done = ActionsDone();
    for (; ended_ < done && ended_ < static_cast<int>(runner_->plan().actions.size()); ++ended_)
      moment_.ended.push_back(runner_->plan().actions[ToIndex(ended_)]);
    for (const scenario::Event* event : disturber_.Disturb(moment_, truth_, runner_->held())) {
      Record(world_.time(), "disturbance", runner_->step(), event->Describe());
      if (const auto* goal = std::get_if<scenario::NewGoal>(&event->other)) ChangeGoal(*goal);
      if (const auto* fault = std::get_if<robot::Fault>(&event->other))
        faults_.Start(*fault, world_.time(), estimate, seen, commands);
    }
    moment_ = {};
  }

  void ChangeGoal(const scenario::NewGoal& goal) {
    if (!runner_->ChangeGoal({goal.pddl, goal.temporal})) {
      Record(world_.time(), "never_happened", runner_->step(), "nothing plans for another goal in this run");
      return;
    }
    temporal_judge_.reset();
    if (goal.temporal) {
      temporal_judge_.emplace(scene_, *task_, *goal.temporal);
    } else {
      own_task_ = symbolic::Task::Ground(symbolic::WithGoal(task_->problem(), goal.pddl, {}));
      task_ = own_task_.get();
    }
  }

  /// Events that never started are reported: the run did not test what it should.
  void NameMissedEvents() {
    for (const std::string& missed : disturber_.Missed())
      Record(world_.time(), "never_happened", runner_->step(), missed);
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
      report_.judgement = JudgeGoal(scene_, truth, *task_, runner_->plan().actions, ActionsDone());
    }
    if (report_.status != RunStatus::kNotCalled) return;
    report_.status = report_.judgement.goal_reached ? RunStatus::kSuccess : RunStatus::kGoalMissed;
    if (report_.judgement.goal_reached || !report_.reason.empty()) return;
    for (const RunEvent& event : report_.events) {
      if (event.kind == "goal_broken") report_.reason += (report_.reason.empty() ? "" : ", ") + event.text;
    }
    if (!report_.reason.empty()) {
      report_.reason += " can't become true any more";
      return;
    }
    for (const GoalFact& fact : report_.judgement.facts)
      report_.reason += (report_.reason.empty() ? "the goal does not hold: " : ", ") + fact.atom +
                        (fact.holds ? " is true" : " is false");
  }

  const scenario::Scenario& scenario_;
  const scene::Scene scene_;
  const symbolic::Task* task_;
  std::shared_ptr<const symbolic::Task> own_task_;  ///< Null until the goal becomes another.
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
  sim::FaultModel faults_;
  robot::Commands distorted_;
  PoseHistory history_;  ///< From which the judge tells rest.
  size_t seen_ = 0;
  Disturber disturber_;
  Disturber::Moment moment_;      ///< What has begun and ended in this tick.
  int ended_ = 0;                 ///< Actions of the plan that have.
  double paused_ = 0;             ///< For so long, s.
  scene::WorldEstimate visible_;  ///< The truth without objects that are not there.
  RunReport report_;
  std::unique_ptr<RunRecorder> recorder_;  ///< Null: no log.
};

}  // namespace

void RequireRunnable(const scenario::Scenario& scenario, const symbolic::Task& task,
                     const planning::Plan& plan) {
  Run::MakeRunner(scenario, scenario.scene, task, plan, {});
}

execution::VelocityExecutiveOptions MakeVelocityOptions(const scenario::Scenario& scenario) {
  const scenario::ExecutionSettings& settings = scenario.execution;
  execution::VelocityExecutiveOptions options;
  options.period = 1.0 / settings.rate;
  options.faults.pose_silence = execution::PoseSilence(scenario.sensing);
  options.constraints = scenario.control_constraints;
  options.max_force = settings.max_force;
  if (settings.controller != scenario::Controller::kConstrainedVelocity) {
    control::OperationalSpaceGains& gains = options.torque.gains;
    if (settings.gain) gains.position = gains.rotation = *settings.gain;
    if (settings.damping) gains.position_damping = gains.rotation_damping = *settings.damping;
    options.constraints = execution::TorqueConstraints(options.constraints, scenario.scene);
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

}  // namespace tether::evaluation
