#include <algorithm>
#include <cmath>

#include "tether/common/text.h"
#include "tether/execution/observer/grasp_width.h"
#include "tether/execution/sequencer/sequencer.h"
#include "tether/robot/gravity.h"
#include "tether/scene/friction.h"
#include "tether/scene/region.h"

namespace tether::execution {
namespace {

// Of the force that friction needs; for accelerations up to this, m/s².
constexpr double kGripSafety = 1.5, kGripAcceleration = 2;
constexpr double kLeastFriction = 0.1;
// Each time that an object has slipped so much further, m, it is held so much harder; an increase by this is
// told.
constexpr double kSlipStep = 0.004, kMoreForce = 1.4, kTold = 1.2;
// A gripper that has further to go than this and has not moved does not answer, m.
constexpr double kWay = 0.004;

// Why what was put into a region is not in it.
std::string Misfit(const scene::RegionFit& fit) {
  char text[80];
  if (fit.outside > scene::RegionFit::kOutlineTolerance) {
    FormatInto(text, sizeof text, "its footprint reaches %.1f mm beyond", 1e3 * fit.outside);
  } else {
    FormatInto(text, sizeof text, "its foot is %.1f mm off", 1e3 * fit.height);
  }
  return text;
}

}  // namespace

void Sequencer::Release() {
  s_.held = kNone;
  lost_since_ = -1;
  servo_->HeldChanged();
}

void Sequencer::BeginGrip(const planning::GripperVerb& verb) {
  servo_->Rest(true);
  first_opening_ = last_opening_ = s_.opening;
  quiet_since_ = s_.time;
  unanswered_ = -1;
  if (!verb.close_on.empty()) {
    s_.gripper.mode = robot::GripperCommand::Mode::kForce;
    const ObjectId object = s_.recovering ? kNone : s_.current().close_on[s_.verb];
    const double mass = object == kNone ? 0 : s_.object(object).mass.value_or(0);
    s_.gripper.force =
        std::min(std::max(verb.force, HoldingForce(object, mass)), s_.model->gripper().max_force);
    slipped_ = told_force_ = 0;
  } else {
    s_.gripper.mode = robot::GripperCommand::Mode::kOpening;
    s_.gripper.opening = servo_->WidestOpening();
    if (s_.held != kNone) {
      s_.Record(EventKind::kReleased, "'" + s_.object_name(s_.held) + "'");
      s_.released = s_.held;
      Release();
    }
  }
}

Progress Sequencer::Grip(const planning::GripperVerb& verb) {
  const GripperSettling& settling = options_.gripper;
  const bool open = verb.close_on.empty();
  const bool begins = !entered_;
  if (begins) BeginGrip(verb);
  entered_ = true;
  // Fingers that close on something move it: the hand does not follow that motion.
  if (open || begins) servo_->Rest(false);
  if (std::abs(s_.opening - last_opening_) > settling.change) {
    last_opening_ = s_.opening;
    quiet_since_ = s_.time;
    if (unanswered_ >= 0) NoteGripperMoves();
  }
  const double elapsed = s_.time - verb_start_;
  const bool settled = s_.time - quiet_since_ > settling.quiet && elapsed > settling.least_time;
  const bool wide = open && s_.opening > settling.open_share * s_.gripper.opening - settling.open_slack;
  if (!settled && !wide && elapsed <= settling.timeout) return Progress::Running();
  const bool unmoved = std::abs(s_.opening - first_opening_) <= settling.change;
  if (open) {
    const bool answers = !unmoved || wide || s_.gripper.opening - s_.opening < kWay;
    return answers ? Progress::Done() : WaitForGripper();
  }
  Progress judged = JudgeGrasp();
  const bool missed = judged.state != Progress::State::kDone;
  return missed && unmoved && s_.opening > kWay + options_.least_width ? WaitForGripper() : judged;
}

Progress Sequencer::JudgeGrasp() {
  const ObjectId object = s_.recovering ? kNone : s_.current().close_on[s_.verb];
  if (object == kNone)
    return Progress::Retry(EventKind::kGraspMissed, "there is nothing to close on", s_.step, true);
  const scene::Object& taken = s_.object(object);
  const math::Pose X_HO = math::Between(s_.X_WH, s_.objects[object].X);
  const std::string wrong =
      WrongWidth(s_.opening, taken.shape, X_HO, s_.model->gripper(), options_.least_width);
  if (!wrong.empty()) {
    return Progress::Retry(EventKind::kGraspMissed,
                           "the gripper closed on " + wrong + " instead of '" + taken.name + "'", s_.step,
                           true);
  }
  s_.held = object;
  s_.held_since = s_.time;
  s_.X_HO_grasp = X_HO;
  held_width_ = s_.opening;
  lost_since_ = -1;
  servo_->HeldChanged();
  s_.Record(EventKind::kGrasped, "'" + taken.name + "', " + Length(s_.opening) + " wide");
  return Progress::Done();
}

// The arm rests while it grips.
Progress Sequencer::WaitForGripper() {
  const std::string what =
      "the gripper of '" + s_.robot + "' does not answer: its fingers stay " + Length(s_.opening) + " apart";
  if (unanswered_ < 0) {
    unanswered_ = s_.time;
    s_.Record(EventKind::kFault, what + "; the arm waits");
  }
  const double lasting = options_.faults.lasting;
  if (s_.time < unanswered_ + lasting) return Progress::Running();
  return Progress::Failed(EventKind::kFailed, what + ", for more than " + Fixed(lasting, 1) + " s");
}

void Sequencer::NoteGripperMoves() {
  s_.Record(EventKind::kRecovered, "the gripper moves after " + Fixed(s_.time - unanswered_, 2) + " s");
  unanswered_ = -1;
}

Progress Sequencer::Wait(const planning::WaitVerb& verb) {
  if (!entered_) servo_->Rest(true);
  entered_ = true;
  servo_->Rest(false);
  const scene::Region* region = verb.region.empty() ? nullptr : s_.scene.FindRegion(verb.region);
  const double seconds = region != nullptr ? region->dwell : verb.seconds;
  return s_.time - verb_start_ >= seconds ? Progress::Done() : Progress::Running();
}

// Coulomb friction at two pads carries the weight and what accelerates it.
double Sequencer::HoldingForce(ObjectId object, double mass) const {
  if (object == kNone) return 0;
  const double friction = scene::PairFriction(s_.object(object).friction, s_.model->gripper().pad_friction);
  return kGripSafety * mass * (robot::kGravity + kGripAcceleration) /
         (2 * std::max(friction, kLeastFriction));
}

// The fingers close harder where what is held turns out to be heavier than it was said to be, and where it
// begins to slip.
void Sequencer::WatchGrip(double slip) {
  if (s_.gripper.mode != robot::GripperCommand::Mode::kForce) return;
  double force = std::max(s_.gripper.force, HoldingForce(s_.held, servo_->HeldMass()));
  if (slip > slipped_ + kSlipStep) {
    slipped_ = slip;
    force *= kMoreForce;
  }
  force = std::min(force, s_.model->gripper().max_force);
  if (force > kTold * s_.gripper.force && force > told_force_) {
    s_.Record(EventKind::kSafety, "'" + s_.object_name(s_.held) + "' is held with " + Fixed(force, 0) +
                                      " N: it is heavy, or begins to slip");
    told_force_ = kTold * force;
  }
  s_.gripper.force = force;
}

void Sequencer::WatchGrasp() {
  if (s_.held == kNone) return;
  const math::Pose X_HO = math::Between(s_.X_WH, s_.objects[s_.held].X);
  const bool slipped = (X_HO.p - s_.X_HO_grasp.p).norm() > options_.slip_distance ||
                       math::AngleBetween(X_HO.R, s_.X_HO_grasp.R) > options_.slip_angle;
  const bool empty = s_.opening < std::max(options_.least_width, held_width_ - kWidthTolerance);
  if (!slipped && !empty) {
    lost_since_ = -1;
    WatchGrip((X_HO.p - s_.X_HO_grasp.p).norm());
    return;
  }
  if (lost_since_ < 0) lost_since_ = s_.time;
  if (s_.time - lost_since_ < options_.lost_time) return;
  const std::string name = "'" + s_.object_name(s_.held) + "'";
  const int grasp = s_.recovering ? kNoStep : s_.GraspStep(s_.held);
  Release();
  Abort(Progress::Retry(EventKind::kGraspLost,
                        empty ? name + " is no longer between the fingers" : name + " slipped away",
                        grasp == kNoStep ? s_.step : grasp, true));
}

// What was released in this step stands beside its target region: it is grasped again, and where that did not
// help either the run has failed, since later actions begin from where it was to be.
bool Sequencer::MissedItsRegion() {
  if (s_.released == kNone || s_.region() == nullptr) return false;
  const scene::Region& region = *s_.region();
  if (region.hub || std::holds_alternative<geometry::Primitive>(region.form)) return false;
  const ObjectId object = s_.released;
  const scene::RegionFit fit = scene::FitRegion(region.form, s_.X_WF(s_.current().target),
                                                s_.object(object).shape, s_.objects[object].X);
  if (fit.Holds()) return false;
  const std::string reason =
      "'" + s_.object_name(object) + "' is not in '" + region.name + "': " + Misfit(fit);
  const int grasp = s_.GraspStep(s_.released);
  if (grasp == kNoStep) {
    Abort(Progress::Failed(EventKind::kPlaceMissed, reason + ", and no earlier step of the plan grasps it"));
    return true;
  }
  const int action = s_.plan_step().action_index;
  if (s_.retries[action] >= options_.max_retries) {
    Abort(Progress::Failed(EventKind::kPlaceMissed, reason + ", although it was grasped again " +
                                                        std::to_string(options_.max_retries) + " times"));
    return true;
  }
  Abort(Progress::Retry(EventKind::kPlaceMissed, reason, grasp, false));
  return true;
}

}  // namespace tether::execution
