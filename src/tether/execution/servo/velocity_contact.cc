#include <algorithm>

#include "tether/control/objective.h"
#include "tether/execution/contact/carriers.h"
#include "tether/execution/servo/velocity_servo.h"
#include "tether/geometry/distance/distance.h"

namespace tether::execution {
namespace {

// A held object touches what it is nearer to than this, m; it is clear of it from this on, besides what it
// must keep: from there on it can keep that.
constexpr double kTouching = 0.002;

}  // namespace

Supports::Distances VelocityServo::SupportDistances(const VelocityServoOptions& options) {
  double keep = 0;
  for (const control::ConstraintSpec& spec : options.constraints) keep = std::max(keep, spec.distance);
  return {kTouching, keep + options.controller.buffer + kTouching};
}

void VelocityServo::WatchSupports() {
  if (supports_.Watch()) UpdateAllowed();
  FindBeneath();
}

void VelocityServo::UpdateAllowed() {
  allowed_.clear();
  const auto find = [this](const AllowedEnd& end, std::vector<ObjectId>* found) {
    found->clear();
    if (end.hand) {
      found->push_back(kTouchingHand);
    } else if (end.region >= 0) {
      FindCarriers(s_, end.region, found);
    } else if (end.object != kNone) {
      found->push_back(end.object);
    }
  };
  if (s_.in_plan()) {
    const ObjectId target = s_.current().target.object;
    for (const auto& [first, second] : s_.current().allow) {
      const bool touches_target =
          (first.hand && second.object == target) || (second.hand && first.object == target);
      if (keeps_off_ && touches_target) continue;
      find(first, &first_ends_);
      find(second, &second_ends_);
      for (const ObjectId a : first_ends_) {
        for (const ObjectId b : second_ends_) allowed_.Allow(a, b);
      }
    }
  }
  if (s_.held != kNone) {
    for (const ObjectId support : supports_.list()) allowed_.Allow(s_.held, support);
    for (const ObjectId object : beneath_) allowed_.Allow(s_.held, object);
  }
  FindBodies(allowed_, controller_.bodies(), &allowed_bodies_);
  controller_.Allow(allowed_bodies_);
  if (drive_) drive_->Allow(allowed_bodies_);
}

// A reach that another one follows leads to before the target, which the hand touches in the last one.
bool VelocityServo::KeepsOff() const {
  if (!s_.in_plan() || s_.held != kNone || s_.verb >= static_cast<int>(s_.verbs().size())) return false;
  const auto is_reach = [](const planning::Verb& verb) {
    return std::holds_alternative<planning::ReachVerb>(verb);
  };
  const auto verb = s_.verbs().begin() + s_.verb;
  return is_reach(*verb) && std::any_of(verb + 1, s_.verbs().end(), is_reach);
}

void VelocityServo::WatchApproach() {
  if (keeps_off_ || !KeepsOff()) return;
  const ObjectId target = s_.current().target.object;
  if (target == kNone) return;
  const double distance = geometry::SignedDistance(s_.model->HandShape(s_.opening), s_.X_WH,
                                                   s_.object(target).shape, s_.objects[target].X)
                              .distance;
  if (distance < SupportDistances(options_).clear) return;
  keeps_off_ = true;
  UpdateAllowed();
}

// What lies under what the held object stood on, and under what carries the region that it is brought to.
void VelocityServo::FindBeneath() {
  beneath_next_.clear();
  carriers_next_.clear();
  if (s_.held != kNone) {
    for (const ObjectId support : supports_.list()) AddBeneath(s_, support, &beneath_next_);
    if (s_.in_plan() && s_.region() != nullptr && s_.current().control == s_.held)
      FindCarriers(s_, s_.current().region, &carriers_next_);
    for (const ObjectId carrier : carriers_next_) AddBeneath(s_, carrier, &beneath_next_);
  }
  if (beneath_next_ == beneath_ && carriers_next_ == carriers_) return;
  std::swap(beneath_, beneath_next_);
  std::swap(carriers_, carriers_next_);
  UpdateAllowed();
}

// `move`: the verb has a goal of its own, which moves along; else the hand keeps its pose relative to what
// was touched.
void VelocityServo::GoAlong(bool move) {
  const std::optional<AttachedFrame> next = after_contact_.NextFrame(along_);
  if (!next) return;
  const auto pose_of = [&](ObjectId of) { return of == kNone ? control_scene_.X_WBase() : s_.X_WO(of); };
  if (!move && next->object == kNone) {
    goal_.reset();
  } else {
    const math::Pose X_WGoal = move ? pose_of(along_) * goal_pose_ : s_.X_WH;
    if (!goal_) {
      goal_ = control::Goal{};
      goal_->turn_speed = options_.turn_speed;
    }
    goal_->target = {};
    goal_->target.object = next->object.value();
    goal_pose_ = pose_of(next->object).Inverse() * X_WGoal;
    goal_->functions = control::MakeObjective(control::Objective::kPose, goal_pose_);
  }
  along_ = next->object;
}

}  // namespace tether::execution
