#include <algorithm>

#include "tether/common/text.h"
#include "tether/execution/sequencer/executive_impl.h"
#include "tether/geometry/distance/distance.h"

namespace tether::execution {
namespace {

constexpr double kGravity = 9.81;  // m/s²
// What happens again within this time is one event, s.
constexpr double kSameEvent = 1.0;
// What is grasped touches what it is nearer to than this, m, and is clear of it from this on.
constexpr double kTouching = 0.004;
constexpr double kClear = 0.01;

}  // namespace

void Executive::Impl::MakeServo() {
  TorqueServoOptions servo = options_.servo;
  servo.controller.period = options_.period;
  servo.controller.gains = options_.gains;
  servo_.emplace(scene_, robot_, model_, servo);
  object_motions_.resize(objects_.size());
}

// The hand may touch what the step is about and what it holds; what it holds may touch the step's target and
// what it stood on; what was touched before stays allowed while the arm recovers.
void Executive::Impl::WatchSupports() {
  const auto distance = [this](int object) {
    const auto held = static_cast<size_t>(held_), other = static_cast<size_t>(object);
    return geometry::SignedDistance(scene_.objects[held].shape, X_WO(held_), scene_.objects[other].shape,
                                    X_WO(object))
        .distance;
  };
  if (held_ != supported_) {
    supported_ = held_;
    supports_.clear();
    for (int i = 0; held_ != kNone && i < static_cast<int>(objects_.size()); ++i) {
      if (i != held_ && distance(i) < kTouching) supports_.push_back(i);
    }
  }
  for (size_t i = 0; i < supports_.size();) {
    if (distance(supports_[i]) < kClear) {
      ++i;
    } else {
      supports_.erase(supports_.begin() + static_cast<std::ptrdiff_t>(i));
    }
  }
}

bool Executive::Impl::FindAllowed() {
  WatchSupports();
  touching_.clear();
  const auto allow = [this](int of, int to) {
    if (to == kNone || of == to) return;
    const Touch touch{of, to};
    if (std::find(touching_.begin(), touching_.end(), touch) == touching_.end()) touching_.push_back(touch);
  };
  const auto with = [&](int of) {
    if (step_ < static_cast<int>(resolved_.steps.size())) {
      allow(of, step().control);
      allow(of, step().target.object);
      allow(of, step().tool);
    }
    if (recovering_) {
      allow(of, before_recovery_.frame.object);
      allow(of, before_recovery_.held);
      allow(of, before_recovery_.released);
    }
    for (size_t i = 0; i < objects_.size(); ++i) {
      if (held_ != kNone && carried_[i]) allow(of, static_cast<int>(i));
    }
  };
  with(kTouchingHand);
  if (held_ != kNone) {
    allow(kTouchingHand, held_);
    with(held_);
    for (const int support : supports_) allow(held_, support);
  }
  return touching_ != named_;
}

void Executive::Impl::NameAllowed() {
  named_.assign(touching_.begin(), touching_.end());
  allowed_.clear();
  for (const auto& [of, to] : touching_) {
    allowed_.emplace_back(of == kTouchingHand ? "hand" : scene_.objects[static_cast<size_t>(of)].name,
                          scene_.objects[static_cast<size_t>(to)].name);
  }
}

void Executive::Impl::CommandConstrained(const control::HandTarget& target, robot::Command* command) {
  for (size_t i = 0; i < objects_.size(); ++i) {
    object_motions_[i] = {objects_[i].X_WF(), objects_[i].V_WF()};
  }
  double payload = 0;
  if (held_ != kNone) payload = kGravity * scene_.objects[static_cast<size_t>(held_)].mass.value_or(0);
  double max_force = options_.servo.max_force;
  if (step_ < static_cast<int>(resolved_.steps.size())) max_force = plan_step().max_force.value_or(max_force);
  command->torque = servo_->Compute({state_, opening_, object_motions_, tau_external_, target, posture_,
                                     held_, touching_, payload, max_force});
  command->gripper = gripper_;
  WatchServo();
}

void Executive::Impl::WatchServo() {
  const control::TorqueFlags& flags = servo_->flags();
  const auto name = [&] { return servo_->controller().constraint_name(flags.worst); };
  if (flags.fault && !fault_reported_) {
    Record(EventKind::kSafety, "what was measured is not finite; the arm is braked");
  }
  fault_reported_ = flags.fault;
  if (servo_->controller().contact().began) Record(EventKind::kSafety, servo_->DescribeContact());
  if (flags.braking && time_ > relaxed_time_ + kSameEvent) {
    Record(EventKind::kSafety, "no torques were found that keep all constraints; the arm is braked");
    relaxed_time_ = time_;
  }
  if (flags.relaxed && flags.worst >= 0 && time_ > relaxed_time_ + kSameEvent) {
    Record(EventKind::kSafety, name() + " is relaxed: constraints conflict");
    relaxed_time_ = time_;
  }
  if (flags.violated && !flags.relaxed && flags.worst >= 0 && time_ > violated_time_ + kSameEvent) {
    Record(EventKind::kSafety, name() + " is violated by " + Millimetres(flags.violation));
    violated_time_ = time_;
  }
  if (flags.outside && !limit_reported_) {
    Record(EventKind::kSafety, "a joint is beyond its limit; it comes back");
    limit_reported_ = true;
  }
}

}  // namespace tether::execution
