#include "tether/execution/sequencer/sequencer.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <utility>
#include <variant>

#include "tether/robot/gravity.h"

namespace tether::execution {
namespace {

// Measurements of objects are no older than this, s.
constexpr double kHandHistory = 0.3;
// The hand rises so far before a retry, m: above what it may have knocked over.
constexpr double kRecoveryRise = 0.08;
// A clock of poses whose stamp is further ahead than this has jumped, s.
constexpr double kPoseClockSlack = 0.1;

Eigen::Vector3d GravityIn(const math::Pose& X_WB) {
  return X_WB.R.transpose() * Eigen::Vector3d(0, 0, -robot::kGravity);
}

}  // namespace

Sequencer::Sequencer(std::unique_ptr<Situation> situation, const ServoMaker& make_servo, Resolver resolve,
                     const SequencerOptions& options)
    : situation_(std::move(situation)),
      s_(*situation_),
      servo_(make_servo(s_)),
      resolve_(std::move(resolve)),
      options_(options),
      trackers_(s_.objects.size()),
      invalid_(s_.objects.size(), false),
      seen_at_(s_.objects.size(), 0.0),
      valid_(s_.objects.size(), 0.0),
      guard_(s_.model, GravityIn(s_.X_WB), options.period),
      estimate_clock_(kPoseClockSlack),
      faults_(options.faults),
      hands_(static_cast<size_t>(std::ceil(kHandHistory / options.period)) + 1) {
  servo_->Prepare(&commands_);
  robot::Command& command = commands_.find(s_.robot)->second;
  mode_ = command.mode;
  if (command.velocity.size() == 0) command.velocity.setZero(s_.model->dof());
}

Sequencer::~Sequencer() = default;

const std::string& Sequencer::held() const {
  static const std::string nothing;
  return s_.held == kNone ? nothing : s_.object_name(s_.held);
}

const robot::Commands& Sequencer::Step(const scene::WorldEstimate& estimate,
                                       const robot::Observations& observations) {
  const auto seen = observations.find(s_.robot);
  assert(seen != observations.end());
  guard_.Take(seen->second, commands_.find(s_.robot)->second, servo_->Carried());
  Sense(estimate, guard_.believed());
  WatchFaults();
  s_.stopping = s_.stopping || paused_;
  for (OtherArm& other : s_.others) {
    const auto found = observations.find(other.name);
    if (found != observations.end() && found->second.q.allFinite()) other.q = found->second.q;
  }
  if (s_.trustworthy && !s_.stopping) {
    if (!started_) Begin();
    Watch();
    if (ContinueLoop()) {
      // The arm rests until there is a plan.
    } else if (waiting_) {
      WaitToRetry();
    } else {
      if (running()) WatchGrasp();
      if (running() && !waiting_ && !pending_) Advance();
    }
  }
  servo_->Command(observations, &commands_);
  robot::Command& command = commands_.find(s_.robot)->second;
  command.gripper = s_.gripper;
  LetServoHold(&command);
  return commands_;
}

void Sequencer::Pause(bool pause) {
  if (pause == paused_) return;
  paused_ = pause;
  if (!started_ || !running()) return;
  s_.Record(pause ? EventKind::kPaused : EventKind::kContinued, "");
  if (!pause && !faults_.stopped()) servo_->Resume();
}

void Sequencer::Begin() {
  started_ = true;
  servo_->Begin();
  if (options_.replanning.plan_anew)
    monitor_ = std::make_unique<Monitor>(s_.scene, options_.replanning.task, s_.plan.actions,
                                         options_.replanning.goal);
  NoteSides();
  if (s_.in_plan()) {
    EnterStep(0);
  } else {
    Finish("the plan is empty");
  }
}

void Sequencer::EnterStep(int index) {
  s_.step = index;
  s_.verb = 0;
  s_.recovering = false;
  s_.released = kNone;
  const bool first = s_.current().action_start == index;
  if (first && !AllowsAction(s_.plan_step().action_index)) return;
  StepRecord& record = s_.record();
  record.start = s_.time;
  ++record.attempts;
  if (first && record.attempts == 1) held_before_ = s_.held;
  if (first) s_.Record(EventKind::kActionStarted, s_.plan_step().action);
  s_.Record(EventKind::kStepStarted, s_.plan_step().control + " to " + s_.plan_step().target);
  servo_->BeginStep();
  BeginVerb();
}

void Sequencer::BeginVerb() {
  entered_ = false;
  servo_->BeginVerb();
}

void Sequencer::FinishStep() {
  StepRecord& record = s_.record();
  record.end = s_.time;
  s_.Record(EventKind::kStepFinished,
            s_.plan_step().action + ": " + Length(record.position_error) + " from its pose");
  if (MissedItsRegion()) return;
  const int action = s_.plan_step().action_index;
  const bool last = s_.step + 1 == s_.num_steps();
  if (monitor_ && (last || s_.plan_step(s_.step + 1).action_index != action)) {
    monitor_->Finish(action);
    failures_.clear();
  }
  if (!last) {
    EnterStep(s_.step + 1);
  } else if (monitor_) {
    Verify();
  } else {
    Finish("");
  }
}

void Sequencer::Finish(const std::string& text) {
  s_.step = s_.num_steps();
  s_.status.state = ExecutiveStatus::State::kFinished;
  servo_->Stop();
  s_.Record(EventKind::kFinished, text);
}

Progress Sequencer::RunVerb() {
  struct Run {
    Sequencer& sequencer;
    Progress operator()(const planning::ReachVerb& verb) { return sequencer.servo_->Reach(verb); }
    Progress operator()(const planning::ShiftVerb& verb) { return sequencer.servo_->Shift(verb); }
    Progress operator()(const planning::GripperVerb& verb) { return sequencer.Grip(verb); }
    Progress operator()(const planning::WaitVerb& verb) { return sequencer.Wait(verb); }
  };
  if (!entered_) verb_start_ = s_.time;
  return std::visit(Run{*this}, s_.present_verb());
}

void Sequencer::Advance() {
  const Progress progress = RunVerb();
  if (progress.state == Progress::State::kRunning) return;
  if (progress.state != Progress::State::kDone) return Abort(progress);
  ++s_.verb;
  BeginVerb();
  if (s_.verb < static_cast<int>(s_.verbs().size())) return;
  if (s_.recovering) {
    EnterStep(s_.step);
  } else {
    FinishStep();
  }
}

void Sequencer::Abort(const Progress& progress) {
  if (progress.kind != EventKind::kFailed) s_.Record(progress.kind, progress.reason);
  servo_->Stop();
  if (progress.state == Progress::State::kFailed) return Fail(progress.reason);
  if (progress.state == Progress::State::kGiveUp || (progress.out_of_reach && monitor_))
    return GiveUp(progress.reason);
  waiting_ = progress;
  WaitToRetry();
}

// A retry right after another one finds what that one found: the arm rests in between.
void Sequencer::WaitToRetry() {
  if (s_.time < last_retry_ + options_.retry_spacing) return;
  const Progress progress = std::move(*waiting_);
  waiting_.reset();
  last_retry_ = s_.time;
  Retry(progress);
}

void Sequencer::Retry(const Progress& progress) {
  int& tried = s_.retries[s_.plan_step().action_index];
  if (tried >= options_.max_retries) return GiveUp(progress.reason);
  ++tried;
  ++retry_count_;
  s_.step = progress.resume;
  s_.Record(EventKind::kRetry, s_.plan_step().action + " again");
  Recover(progress.open);
}

// Before it tries again, the hand opens, unless it is to keep what it holds, and rises.
void Sequencer::Recover(bool open) {
  s_.recovery.clear();
  if (open) s_.recovery.emplace_back(planning::GripperVerb{});
  planning::ShiftVerb rise;
  rise.by = Eigen::Vector3d(0, 0, kRecoveryRise);
  s_.recovery.emplace_back(rise);
  s_.recovering = true;
  s_.verb = 0;
  BeginVerb();
}

void Sequencer::GiveUp(const std::string& reason) {
  std::string why;
  if (monitor_) ++failures_[s_.plan.actions[ToIndex(s_.plan_step().action_index)]];
  if (monitor_ ? AskForPlan(reason, &why) : TryAlternative(&why)) return;
  Fail(why.empty() ? reason : reason + "; " + why);
}

bool Sequencer::TryAlternative(std::string* why) {
  if (!options_.alternative) return false;
  if (replans_ >= options_.max_alternatives) {
    *why = "other actions have been tried " + std::to_string(replans_) + " times";
    return false;
  }
  const int action = s_.plan_step().action_index;
  const std::string blocked = s_.plan.actions[ToIndex(action)];
  planning::Plan next = s_.plan;
  next.actions.resize(ToIndex(action));
  const auto found = options_.alternative(next.actions, blocked, *why);
  if (!found) return false;
  next.actions.insert(next.actions.end(), found->begin(), found->end());
  std::erase_if(next.steps, [&](const planning::PlanStep& step) { return step.action_index >= action; });
  if (!Adopt(std::move(next), action, why)) return false;
  LetGoOfWhatWasJustGrasped();
  std::string text = "without " + blocked + ":";
  for (const std::string& name : *found) text += " " + name;
  s_.Record(EventKind::kReplanned, text);
  EnterStep(s_.step);
  return true;
}

bool Sequencer::Adopt(planning::Plan next, int action, std::string* why) {
  try {
    ResolvedPlan resolved = resolve_(std::move(next));
    s_.plan = std::move(resolved.plan);
    s_.steps = std::move(resolved.steps);
  } catch (const InputError& error) {
    *why = "other actions can't be executed: " + std::string(error.what());
    return false;
  }
  ++replans_;
  const auto first =
      std::find_if(s_.plan.steps.begin(), s_.plan.steps.end(),
                   [&](const planning::PlanStep& step) { return step.action_index >= action; });
  s_.step = static_cast<int>(first - s_.plan.steps.begin());
  s_.records.resize(s_.steps.size());
  for (int i = s_.step; i < s_.records.next_id(); ++i) {
    s_.records[i] = {};
    s_.records[i].step = i;
  }
  std::erase_if(s_.retries, [&](const auto& entry) { return entry.first >= action; });
  return true;
}

void Sequencer::LetGoOfWhatWasJustGrasped() {
  if (s_.held == kNone || s_.held == held_before_) return;
  s_.Record(EventKind::kReleased, "'" + s_.object_name(s_.held) + "'");
  Release();
  OpenHand();
}

void Sequencer::OpenHand() {
  s_.gripper.mode = robot::GripperCommand::Mode::kOpening;
  s_.gripper.opening = s_.model->gripper().max_opening;
}

void Sequencer::Fail(const std::string& reason) {
  EndFailed(s_.in_plan() ? s_.plan_step().action + ": " + reason : reason);
}

void Sequencer::EndFailed(const std::string& reason) {
  s_.status.state = ExecutiveStatus::State::kFailed;
  s_.status.reason = reason;
  s_.Record(EventKind::kFailed, reason);
}

}  // namespace tether::execution
