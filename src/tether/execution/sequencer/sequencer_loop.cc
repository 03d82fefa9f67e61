#include <algorithm>
#include <utility>

#include "tether/execution/sequencer/sequencer.h"

namespace tether::execution {

// Observes the facts. What no longer allows the plan ends the running action at once, but where the hand has
// grasped or released something in it: then it is looked at before the next one.
void Sequencer::Watch() {
  if (!monitor_ || !running()) return;
  const bool acts = s_.in_plan() && !pending_ && !ask_again_;
  const int action = acts ? s_.plan_step().action_index : -1;
  monitor_->Observe(s_.time, s_.objects, s_.held, action);
  if (!acts || !monitor_->changed() || s_.held != held_before_) return;
  const PlanOutlook outlook = monitor_->Look(action);
  std::string why;
  if (!outlook.reaches && !AskForPlan(outlook.reason, &why)) Fail(why);
}

// True while a plan is waited for.
bool Sequencer::ContinueLoop() {
  if (!monitor_ || !running()) return false;
  if (verify_at_ >= 0 && s_.time >= verify_at_) {
    verify_at_ = -1;
    const PlanOutlook outlook = monitor_->Look(static_cast<int>(s_.plan.actions.size()));
    std::string why;
    if (outlook.reaches) {
      Finish("");
    } else if (!AskForPlan(outlook.reason, &why)) {
      Fail(outlook.reason + "; " + why);
    }
    return true;
  }
  if (ask_again_ && s_.time >= ask_again_->first) {
    const std::string reason = std::exchange(ask_again_, std::nullopt)->second;
    std::string why;
    if (!AskForPlan(reason, &why)) Fail(reason + "; " + why);
  }
  if (pending_ && s_.time >= pending_->due - 1e-9) AdoptAnswer();
  return pending_ || ask_again_ || verify_at_ >= 0;
}

void Sequencer::Verify() {
  s_.step = s_.num_steps();
  servo_->Stop();
  verify_at_ = s_.time + options_.replanning.verify;
}

// Before an action begins: whether the plan from it on still reaches the goal.
bool Sequencer::AllowsAction(int action) {
  if (!monitor_ || !monitor_->changed()) return true;
  const PlanOutlook outlook = monitor_->Look(action);
  if (outlook.reaches) return true;
  std::string why;
  // Where no plan can be asked for, the action is tried all the same.
  return !AskForPlan(outlook.reason, &why);
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
  PlanRequest request;
  for (const ObjectId i : s_.objects.ids()) request.X_WO[s_.object_name(i)] = s_.objects[i].X;
  request.q = s_.q;
  request.held = held();
  request.facts = monitor_->Facts(s_.time, s_.objects, s_.held);
  Pending pending;
  pending.action = action;
  pending.due = s_.time + options.latency;
  pending.reason = reason;
  pending.answer =
      std::async(std::launch::async, [plan_anew = options.plan_anew, request] { return plan_anew(request); });
  pending_ = std::move(pending);
  waiting_.reset();
  servo_->Stop();
  if (s_.held == kNone) OpenHand();
  return true;
}

void Sequencer::AdoptAnswer() {
  Pending pending = std::move(*pending_);
  pending_.reset();
  PlanAnswer answer = pending.answer.get();
  std::string why = answer.reason;
  if (answer.plan && answer.plan->actions.empty()) {
    // The goal is reached as it is.
    s_.plan.actions.resize(ToIndex(pending.action));
    std::erase_if(s_.plan.steps, [&](const auto& step) { return step.action_index >= pending.action; });
    s_.steps.resize(s_.plan.steps.size());
    s_.records.resize(s_.plan.steps.size());
    monitor_->Adopt(answer.task, {}, pending.action);
    return Verify();
  }
  if (answer.plan) {
    planning::Plan next = s_.plan;
    next.actions.resize(ToIndex(pending.action));
    std::erase_if(next.steps, [&](const auto& step) { return step.action_index >= pending.action; });
    next.actions.insert(next.actions.end(), answer.plan->actions.begin(), answer.plan->actions.end());
    for (planning::PlanStep& step : answer.plan->steps) step.action_index += pending.action;
    next.steps.insert(next.steps.end(), answer.plan->steps.begin(), answer.plan->steps.end());
    planning::SetModes(&next);
    if (Adopt(std::move(next), pending.action, &why)) {
      fruitless_ = 0;
      monitor_->Adopt(answer.task, answer.plan->actions, pending.action);
      std::string text = pending.reason + ":";
      for (const std::string& action : answer.plan->actions) text += " " + action;
      s_.Record(EventKind::kReplanned, text);
      return EnterStep(s_.step);
    }
  }
  const std::string text = pending.reason + "; no plan from here: " + why;
  if (++fruitless_ >= options_.replanning.max_failures) {
    return EndFailed(text);
  }
  ask_again_ = {s_.time + options_.replanning.wait, pending.reason};
}

}  // namespace tether::execution
