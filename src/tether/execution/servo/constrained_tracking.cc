#include <algorithm>

#include "tether/common/text.h"
#include "tether/execution/servo/reference_servo.h"
#include "tether/geometry/distance/distance.h"

namespace tether::execution {
namespace {

// What happens again within this time is one event, s.
constexpr double kSameEvent = 1.0;
// What is grasped touches what it is nearer to than this, m, and is clear of it from this on.
constexpr double kTouching = 0.004;
constexpr double kClear = 0.01;

}  // namespace

void ReferenceServo::MakeServo() {
  TorqueServoOptions servo = options_.servo;
  servo.controller.period = shared_.period;
  servo.controller.gains = options_.gains;
  servo_.emplace(s_.scene, s_.robot, s_.model, servo);
}

// The hand may touch what the step is about and what it holds; what it holds may touch the step's target and
// what it stood on; what was touched before stays allowed while the arm recovers.
void ReferenceServo::WatchSupports() {
  const auto distance = [this](int object) {
    const auto held = static_cast<size_t>(s_.held), other = static_cast<size_t>(object);
    return geometry::SignedDistance(s_.scene.objects[held].shape, X_WO(s_.held),
                                    s_.scene.objects[other].shape, X_WO(object))
        .distance;
  };
  if (s_.held != supported_) {
    supported_ = s_.held;
    supports_.clear();
    for (int i = 0; s_.held != kNone && i < static_cast<int>(s_.objects.size()); ++i) {
      if (i != s_.held && distance(i) < kTouching) supports_.push_back(i);
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

bool ReferenceServo::FindAllowed() {
  WatchSupports();
  touching_.clear();
  const auto allow = [this](int of, int to) {
    if (to == kNone || of == to) return;
    const Touch touch{of, to};
    if (std::find(touching_.begin(), touching_.end(), touch) == touching_.end()) touching_.push_back(touch);
  };
  const auto with = [&](int of) {
    if (s_.step < static_cast<int>(s_.steps.size())) {
      allow(of, s_.current().control);
      allow(of, s_.current().target.object);
      allow(of, s_.current().tool);
    }
    if (s_.recovering) {
      allow(of, before_recovery_.frame.object);
      allow(of, before_recovery_.held);
      allow(of, before_recovery_.released);
    }
    for (size_t i = 0; i < s_.objects.size(); ++i) {
      if (s_.held != kNone && carried_[i]) allow(of, static_cast<int>(i));
    }
  };
  with(kTouchingHand);
  if (s_.held != kNone) {
    allow(kTouchingHand, s_.held);
    with(s_.held);
    for (const int support : supports_) allow(s_.held, support);
  }
  return touching_ != named_;
}

void ReferenceServo::NameAllowed() {
  named_.assign(touching_.begin(), touching_.end());
  allowed_.clear();
  for (const auto& [of, to] : touching_) {
    allowed_.emplace_back(of == kTouchingHand ? "hand" : s_.scene.objects[static_cast<size_t>(of)].name,
                          s_.scene.objects[static_cast<size_t>(to)].name);
  }
}

double ReferenceServo::MaxForce() const {
  const double usual = options_.servo.max_force;
  return s_.in_plan() ? s_.plan_step().max_force.value_or(usual) : usual;
}

void ReferenceServo::CommandConstrained(const control::HandTarget& target, robot::Command* command) {
  command->torque = servo_->Compute(
      {state_, s_.opening, s_.objects, s_.tau_external, target, posture_, s_.held, touching_, MaxForce()});
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

}  // namespace tether::execution
