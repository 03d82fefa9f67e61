#include "tether/common/text.h"
#include "tether/execution/servo/reference_servo.h"

namespace tether::execution {
namespace {

// A joint this near to its limit is at it, beside what the controller keeps, rad.
constexpr double kAtLimit = 0.03;
// A hand that is kept from its pose by less is not pressed on, N.
constexpr double kPressed = 4;

}  // namespace

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
    add(s_.model->joint_names()[static_cast<size_t>(i)] + " is at its limit");
  }
  const bool singular = servo_ ? servo_->flags().singular : controller_.flags().singular;
  if (singular) add("the arm is stretched or folded so far that the hand hardly moves (singular)");
  if (!text.empty()) return text;
  const double force = HandWrench(state_, s_.tau_external).head<3>().norm();
  if (s_.held == kNone && force > kPressed) add("something presses on the hand with " + Fixed(force, 0) + " N");
  return text;
}

}  // namespace tether::execution
