#include <algorithm>
#include <chrono>
#include <utility>

#include "tether/execution/sequencer/sequencer.h"

namespace tether::execution {
namespace {

// Poses nearer than this are the same to planning, m and rad.
constexpr double kSamePlace = 0.01;
constexpr double kSameAngle = 0.05;
// What is faster than this moves: m/s, rad/s.
constexpr double kMoves = 0.03, kTurns = 0.3;
// What is tilted by more than this against how it lay lies on another side, rad.
constexpr double kOtherSide = 0.4;
// What changed the state is waited for until it rests, but no longer than this, s.
constexpr double kSettles = 1;

/// The world's vertical in the object's frame.
Eigen::Vector3d UpIn(const control::MovingPose& object) {
  return object.X.R.transpose() * Eigen::Vector3d::UnitZ();
}

/// Whether `next` is what is left of `before` from some action on.
bool IsSuffix(const std::vector<std::string>& next, const std::vector<std::string>& before) {
  return next.size() <= before.size() &&
         std::equal(next.begin(), next.end(), before.end() - static_cast<std::ptrdiff_t>(next.size()));
}

/// Whether planning for one would find what it found for the other.
bool IsLike(const PlanRequest& a, const PlanRequest& b) {
  if (a.held != b.held || a.unseen != b.unseen || a.failed != b.failed || a.facts.size() != b.facts.size() ||
      a.X_WO.size() != b.X_WO.size())
    return false;
  return std::all_of(a.X_WO.begin(), a.X_WO.end(), [&](const auto& entry) {
    const math::Pose& X = b.X_WO.at(entry.first);
    return (entry.second.p - X.p).norm() < kSamePlace &&
           math::LogSO3(entry.second.R.transpose() * X.R).norm() < kSameAngle;
  });
}

}  // namespace

// Observes the facts. What no longer allows the plan ends the running action at once, but where the hand has
// grasped or released something in it: then it is looked at before the next one.
void Sequencer::Watch() {
  if (!monitor_ || !running()) return;
  const bool acts = s_.in_plan() && !pending_ && !ask_again_;
  const int action = acts ? s_.plan_step().action_index : -1;
  const bool exact = std::all_of(trackers_.begin(), trackers_.end(), [](const auto& t) { return t.exact(); });
  monitor_->set_exact(exact && IsFresh());
  monitor_->Observe(s_.time, s_.objects, s_.held, action);
  if (!acts || s_.held != held_before_) return;
  std::string reason = WhyAtOnce(), why;
  if (reason.empty()) {
    if (!monitor_->changed() && unsettled_since_ < 0) return;
    const PlanOutlook outlook = monitor_->Look(action);
    if (outlook.reaches) {
      unsettled_since_ = -1;
      return;
    }
    if (IsUnsettled()) return;
    reason = outlook.reason;
  }
  unsettled_since_ = -1;
  if (!AskForPlan(reason, &why)) Fail(reason + "; " + why);
}

void Sequencer::NoteSides() {
  up_O_.clear();
  for (const control::MovingPose& object : s_.objects) up_O_.push_back(UpIn(object));
}

// Key poses and grasps are for the side that an object lies on.
ObjectId Sequencer::LiesOtherwise(int action) const {
  for (int k = s_.step; k < s_.num_steps() && s_.plan_step(k).action_index == action; ++k) {
    for (const ObjectId i : {s_.steps[k].control, s_.steps[k].target.object}) {
      if (i == kNone || i == s_.held || !s_.object(i).movable() || !s_.objects[i].seen) continue;
      if (std::acos(std::clamp(UpIn(s_.objects[i]).dot(up_O_[i]), -1.0, 1.0)) > kOtherSide) return i;
    }
  }
  return kNone;
}

// What ends the present action whatever else is so.
std::string Sequencer::WhyAtOnce() const {
  if (new_goal_) return "the goal is another";
  for (const ObjectId object : {s_.current().control, s_.current().target.object}) {
    if (object != kNone && !s_.objects[object].seen) return "'" + s_.object_name(object) + "' is not seen";
  }
  return "";
}

// A state that is still changing is not planned from; but what never rests is not waited for long.
bool Sequencer::IsUnsettled() {
  bool moves = false;
  for (const ObjectId i : s_.objects.ids()) {
    const control::MovingPose& object = s_.objects[i];
    moves = moves || (i != s_.held && s_.object(i).movable() && object.seen &&
                      (object.V.head<3>().norm() > kMoves || object.V.tail<3>().norm() > kTurns));
  }
  if (!moves) return false;
  if (unsettled_since_ < 0) unsettled_since_ = s_.time;
  return s_.time < unsettled_since_ + kSettles;
}

// True while a plan is waited for.
bool Sequencer::ContinueLoop() {
  if (!monitor_ || !running()) return false;
  if (verify_at_ >= 0 && s_.time >= verify_at_ && !IsUnsettled()) {
    verify_at_ = -1;
    unsettled_since_ = -1;
    const PlanOutlook outlook = monitor_->Look(static_cast<int>(s_.plan.actions.size()));
    std::string why;
    const std::string reason = new_goal_ ? "the goal is another" : outlook.reason;
    if (outlook.reaches && !new_goal_) {
      Finish("");
    } else if (!AskForPlan(reason, &why)) {
      Fail(reason + "; " + why);
    }
    return true;
  }
  if (ask_again_ && s_.time >= ask_again_->due) AskAgain();
  if (pending_ && s_.time >= pending_->due - 1e-9 &&
      (options_.replanning.waits ||
       pending_->answer.wait_for(std::chrono::seconds(0)) == std::future_status::ready))
    AdoptAnswer();
  return pending_ || ask_again_ || verify_at_ >= 0;
}

bool Sequencer::ChangeGoal(const Goal& goal) {
  if (!monitor_ || !running()) return false;
  // It is looked at here, so that what is wrong with it is said now.
  if (!goal.temporal) symbolic::WithGoal(*monitor_->problem(), goal.pddl, {});
  new_goal_ = goal;
  ++goals_;
  return true;
}

void Sequencer::Verify() {
  s_.step = s_.num_steps();
  servo_->Stop();
  verify_at_ = s_.time + options_.replanning.verify;
}

// Before an action begins: whether the plan from it on still reaches the goal.
bool Sequencer::AllowsAction(int action) {
  if (!monitor_) return true;
  std::string reason, why;
  if (const ObjectId object = LiesOtherwise(action); object != kNone) {
    reason = "'" + s_.object_name(object) + "' lies on another side";
  } else {
    if (!monitor_->changed()) return true;
    const PlanOutlook outlook = monitor_->Look(action);
    if (outlook.reaches) return true;
    reason = outlook.reason;
  }
  // Where no plan can be asked for, the action is tried all the same.
  return !AskForPlan(reason, &why);
}

bool Sequencer::AskForPlan(const std::string& reason, std::string* why) {
  const ReplanningOptions& options = options_.replanning;
  if (!monitor_) return false;
  if (replans_ >= options.max_plans) {
    *why = "plans have been made anew " + std::to_string(replans_) + " times";
    return false;
  }
  int action = s_.in_plan() ? s_.plan_step().action_index : static_cast<int>(s_.plan.actions.size());
  if (s_.in_plan() && s_.held != kNone && s_.held != held_before_) {
    // What it was to do to the object in the hand is done.
    monitor_->Finish(action);
    held_before_ = s_.held;
    ++action;
  }
  waiting_.reset();
  servo_->Stop();
  if (s_.held == kNone) OpenHand();
  Request(MakeRequest(), action, reason);
  return true;
}

PlanRequest Sequencer::MakeRequest() {
  PlanRequest request;
  for (const ObjectId i : s_.objects.ids()) {
    if (s_.objects[i].seen)
      request.X_WO[s_.object_name(i)] = s_.objects[i].X;
    else
      request.unseen.push_back(s_.object_name(i));
  }
  request.q = s_.q;
  request.held = held();
  request.problem = monitor_->problem();
  request.goal = monitor_->Goal();
  if (new_goal_) {
    request.goal = new_goal_->temporal;
    if (!request.goal) request.problem = symbolic::WithGoal(*request.problem, new_goal_->pddl, {});
  }
  request.facts = monitor_->Facts(s_.time, s_.objects, s_.held);
  for (const auto& [failed, times] : failures_) {
    if (times > 1) request.failed.push_back(failed);
  }
  return request;
}

void Sequencer::Request(PlanRequest request, int action, const std::string& reason) {
  PlanningRecord& record = plannings_.emplace_back();
  record.asked = s_.time;
  record.reason = reason;
  Pending pending;
  pending.action = action;
  pending.due = s_.time + options_.replanning.latency;
  pending.reason = reason;
  pending.goals = goals_;
  pending.request = request;  // What it was asked with, should there be none.
  pending.answer =
      std::async(std::launch::async, [plan_anew = options_.replanning.plan_anew,
                                      request = std::move(request)] { return plan_anew(request); });
  pending_ = std::move(pending);
}

// What was not found is not looked for again until something has moved.
void Sequencer::AskAgain() {
  Again again = std::move(*ask_again_);
  ask_again_.reset();
  PlanRequest request = MakeRequest();
  if (again.goals == goals_ && IsLike(request, again.in_vain)) return FailToPlan(std::move(again));
  Request(std::move(request), again.action, again.reason);
}

void Sequencer::FailToPlan(Again again) {
  if (++fruitless_ >= options_.replanning.max_failures) return EndFailed(again.why_not);
  again.due = s_.time + options_.replanning.wait;
  ask_again_ = std::move(again);
}

void Sequencer::AdoptAnswer() {
  Pending pending = std::move(*pending_);
  pending_.reset();
  PlanAnswer answer = pending.answer.get();
  std::string why = answer.reason;
  PlanningRecord& record = plannings_.back();
  record.cpu = answer.cpu;
  record.decision = "none";
  for (const std::string& broken : answer.broken) s_.Record(EventKind::kGoalBroken, broken);
  if (answer.plan && answer.plan->actions.empty()) {
    // The goal is reached as it is.
    s_.plan.actions.resize(ToIndex(pending.action));
    std::erase_if(s_.plan.steps, [&](const auto& step) { return step.action_index >= pending.action; });
    s_.steps.resize(s_.plan.steps.size());
    s_.records.resize(s_.plan.steps.size());
    if (pending.goals == goals_) new_goal_.reset();
    monitor_->Adopt(answer.task, {}, pending.action, answer.goal);
    record.decision = "finished";
    record.adopted = s_.time;
    return Verify();
  }
  if (answer.plan) {
    planning::Plan next = s_.plan;
    const bool resumes = IsSuffix(answer.plan->actions, s_.plan.actions);
    next.actions.resize(ToIndex(pending.action));
    std::erase_if(next.steps, [&](const auto& step) { return step.action_index >= pending.action; });
    next.actions.insert(next.actions.end(), answer.plan->actions.begin(), answer.plan->actions.end());
    for (planning::PlanStep& step : answer.plan->steps) step.action_index += pending.action;
    next.steps.insert(next.steps.end(), answer.plan->steps.begin(), answer.plan->steps.end());
    planning::SetModes(&next);
    if (Adopt(std::move(next), pending.action, &why)) {
      fruitless_ = 0;
      if (pending.goals == goals_) new_goal_.reset();
      monitor_->Adopt(answer.task, answer.plan->actions, pending.action, answer.goal);
      std::string text = pending.reason + ":";
      for (const std::string& action : answer.plan->actions) text += " " + action;
      s_.Record(resumes ? EventKind::kResumed : EventKind::kReplanned, text);
      NoteSides();
      record.decision = resumes ? "resumed" : "replanned";
      record.adopted = s_.time;
      record.actions = answer.plan->actions;
      return EnterStep(s_.step);
    }
  }
  Again again;
  again.why_not = pending.reason + "; no plan from here: " + why;
  again.reason = std::move(pending.reason);
  again.action = pending.action;
  again.goals = pending.goals;
  again.in_vain = std::move(pending.request);
  if (fruitless_ == 0) s_.Record(EventKind::kWaiting, again.why_not);
  FailToPlan(std::move(again));
}

}  // namespace tether::execution
