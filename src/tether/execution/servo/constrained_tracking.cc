#include "tether/common/text.h"
#include "tether/execution/servo/reference_servo.h"

namespace tether::execution {
namespace {

// What happens again within this time is one event, s.
constexpr double kSameEvent = 1.0;
// A joint this near to its limit is at it, beside what the controller keeps, rad.
constexpr double kAtLimit = 0.03;
// A hand that is kept from its pose by less is not pressed on, N.
constexpr double kPressed = 4;

}  // namespace

void ReferenceServo::MakeServo() {
  TorqueServoOptions servo = options_.servo;
  servo.controller.period = shared_.period;
  servo.controller.gains = options_.gains;
  servo_.emplace(s_.scene, s_.robot, s_.model, servo);
}

// The hand may touch what the step is about and what it holds; what it holds may touch the step's target and
// what it stood on; what was touched before stays allowed while the arm recovers.
void ReferenceServo::FindAllowed() {
  supports_.Watch();
  allowed_.clear();
  const auto allow = [this](ObjectId of, ObjectId to) {
    if (to != kNone) allowed_.Allow(of, to);
  };
  const auto with = [&](ObjectId of) {
    if (s_.in_plan()) {
      allow(of, s_.current().control);
      allow(of, s_.current().target.object);
      allow(of, s_.current().tool);
    }
    if (s_.recovering) {
      const Contact& before = after_contact_.before_recovery();
      allow(of, before.frame.object);
      allow(of, before.held);
      allow(of, before.released);
    }
    for (const ObjectId i : s_.objects.ids()) {
      if (MovesWithHand(i)) allow(of, i);
    }
  };
  with(kTouchingHand);
  if (s_.held == kNone) return;
  with(s_.held);
  for (const ObjectId support : supports_.list()) allow(s_.held, support);
}

double ReferenceServo::MaxForce() const {
  const double usual = options_.servo.max_force;
  return s_.in_plan() ? s_.plan_step().max_force.value_or(usual) : usual;
}

void ReferenceServo::CommandConstrained(const control::HandTarget& target, robot::Command* command) {
  const control::JointTarget joints{transit_.joints().q, transit_.joints().v, transit_.joints().a};
  const bool follows = transit_.active() && !s_.stopping;
  command->torque =
      servo_->Compute({state_, s_.opening, s_.objects, s_.tau_external, target, posture_, s_.held, allowed_,
                       MaxForce(), follows ? &joints : nullptr, s_.stopping && !resting_});
  WatchServo();
}

void ReferenceServo::WatchServo() {
  const control::TorqueFlags& flags = servo_->flags();
  const auto name = [&] { return servo_->controller().constraint_name(flags.worst); };
  if (flags.fault && !fault_reported_) {
    s_.Record(EventKind::kSafety, "what was measured is not finite; the arm is braked");
  }
  fault_reported_ = flags.fault;
  if (servo_->controller().contact().began) s_.Record(EventKind::kSafety, servo_->DescribeContact());
  if (flags.braking && s_.time > relaxed_time_ + kSameEvent) {
    s_.Record(EventKind::kSafety, "no torques were found that keep all constraints; the arm is braked");
    relaxed_time_ = s_.time;
  }
  if (flags.relaxed && flags.worst >= 0 && s_.time > relaxed_time_ + kSameEvent) {
    s_.Record(EventKind::kSafety, name() + " is relaxed: constraints conflict");
    relaxed_time_ = s_.time;
  }
  if (flags.violated && !flags.relaxed && flags.worst >= 0 && s_.time > violated_time_ + kSameEvent) {
    s_.Record(EventKind::kSafety, name() + " is violated by " + Length(flags.violation));
    violated_time_ = s_.time;
  }
  if (flags.outside && !limit_reported_) {
    s_.Record(EventKind::kSafety, "a joint is beyond its limit; it comes back");
    limit_reported_ = true;
  }
}

std::string ReferenceServo::WhatHoldsUp() const {
  std::string text;
  const auto add = [&text](const std::string& reason) { text += (text.empty() ? ": " : "; ") + reason; };
  if (servo_) {
    const control::Contact& contact = servo_->controller().contact();
    if (const std::string rows = servo_->DescribeBinding(); !rows.empty()) add("held up by " + rows);
    if (contact.active) {
      add("something presses on the arm with " + Fixed(contact.force, 0) + " N");
    } else if (servo_->flags().force_limit) {
      add("no more than " + Fixed(MaxForce(), 0) + " N are pressed with ('max_force')");
    }
  }
  double kept = kAtLimit;
  if (servo_) {
    const control::TorqueOptions& options = servo_->controller().options();
    kept += options.joint_margin + options.limit_gap;
  }
  for (int i = 0; i < s_.model->dof(); ++i) {
    if (s_.q[i] > s_.model->lower()[i] + kept && s_.q[i] < s_.model->upper()[i] - kept) continue;
    add(s_.model->joint_names()[i] + " is at its limit");
  }
  const bool singular = servo_ ? servo_->flags().singular : controller_.flags().singular;
  if (singular) add("the arm is stretched or folded so far that the hand hardly moves (singular)");
  if (!text.empty()) return text;
  const double force = HandWrench(state_, s_.tau_external).head<3>().norm();
  if (s_.held == kNone && force > kPressed)
    add("something presses on the hand with " + Fixed(force, 0) + " N");
  return text;
}

}  // namespace tether::execution
