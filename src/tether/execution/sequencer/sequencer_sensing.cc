#include <algorithm>
#include <cassert>
#include <cmath>

#include "tether/common/text.h"
#include "tether/execution/sequencer/sequencer.h"

namespace tether::execution {
namespace {

// Time constant with which it is followed how a held object lies in the hand, s; ticks within which a pose is
// as good as new.
constexpr double kHeldFollows = 0.3;
constexpr double kFresh = 1.5;
// An arm with slower joints stands, rad/s.
constexpr double kStands = 0.02;
// What has not been measured for so long may be anywhere, s.
constexpr double kUnseen = 0.5;

bool IsFinite(const math::Pose& X) { return X.R.allFinite() && X.p.allFinite(); }

}  // namespace

// The pose of an object that is not finite, or that the estimate lacks, is its last one: where poses are
// filtered, moved on as it moved; else at rest.
void Sequencer::Track(ObjectId object, const math::Pose* measured, bool news) {
  control::MovingPose& now = s_.objects[object];
  FrameTracker& tracker = trackers_[object];
  const bool usable = measured != nullptr && IsFinite(*measured);
  const bool bad = measured != nullptr && !usable;
  // Measured when it was taken, which may be some time ago.
  if (options_.filters_poses) {
    if (!sensed_) {
      tracker.Reset(usable ? *measured : s_.scene.InitialPose(s_.object_name(object)), estimate_time_);
    } else if (news && usable) {
      tracker.Predict(estimate_time_);
      tracker.Correct(*measured);
    }
    now = {tracker.At(s_.time), tracker.V_WF(), now.seen};
  } else if (!usable) {
    now.V.setZero();
  } else {
    // What stands on a contact trembles from one tick to the next, and is at rest.
    if (sensed_ && !invalid_[object]) {
      if (news) {
        tracker.Predict(estimate_time_);
        tracker.Correct(*measured);
      }
    } else {
      tracker.Reset(*measured, estimate_time_);
    }
    now = {tracker.exact() && IsFresh() ? *measured : tracker.At(s_.time), tracker.V_WF(), now.seen};
  }
  if (bad && (news || !sensed_) && !invalid_[object]) {
    s_.Record(EventKind::kEstimateInvalid,
              "the pose of '" + s_.object_name(object) + "' is not finite; the last one is used");
  }
  if (news || !sensed_) invalid_[object] = !usable;
  if (!bad) valid_[object] = s_.time;
  if (usable || !sensed_) seen_at_[object] = s_.time;
  const bool seen = s_.time - seen_at_[object] < kUnseen || object == s_.held;
  if (seen != now.seen)
    s_.Record(EventKind::kSight,
              "'" + s_.object_name(object) + (seen ? "' is seen again" : "' is not seen any more"));
  now.seen = seen;
}

void Sequencer::Sense(const scene::WorldEstimate& estimate, const robot::Observation& seen) {
  s_.trustworthy = std::isfinite(seen.time) && seen.q.allFinite() && seen.v.allFinite() &&
                   std::isfinite(seen.gripper_opening);
  estimate_jumped_ = estimate_clock_.Take(estimate.time, options_.period);
  const bool news = estimate_clock_.news();
  // The later of both clocks: estimates may be old.
  if (std::isfinite(seen.time)) s_.time = std::max({s_.time, seen.time, estimate_clock_.time()});
  if (news) {
    estimate_time_ = estimate_clock_.time();
    news_time_ = s_.time;
  }
  for (const ObjectId i : s_.objects.ids()) {
    const auto found = estimate.X_WO.find(s_.object_name(i));
    Track(i, found == estimate.X_WO.end() ? nullptr : &found->second, news);
  }
  sensed_ = true;
  s_.q = seen.q;
  s_.v = seen.v;
  if (s_.trustworthy) {
    s_.opening = seen.gripper_opening;
    s_.tau_external = seen.tau_external;
  }
  servo_->Sense();
  if (s_.trustworthy) FollowHeld(estimate, news);
}

ObjectId Sequencer::LostTarget() const {
  if (!s_.in_plan()) return kNone;
  const ResolvedStep& step = s_.current();
  for (const ObjectId object : {step.control, step.target.object, step.tool}) {
    if (object != kNone && s_.time - valid_[object] > options_.faults.pose_silence) return object;
  }
  return kNone;
}

std::pair<Sequencer::Wrong, double> Sequencer::FindWrong() {
  using Trouble = ObservationGuard::Trouble;
  if (guard_.trouble() != Trouble::kFine) {
    const double silence = std::max(options_.faults.silence, 3 * options_.period);
    return {Wrong::kArm, guard_.trouble() == Trouble::kClock ? 0 : silence};
  }
  if (estimate_jumped_) return {Wrong::kPoseClock, 0};
  if (s_.time - news_time_ > options_.faults.pose_silence) return {Wrong::kPoses, 0};
  lost_target_ = LostTarget();
  return {lost_target_ == kNone ? Wrong::kNothing : Wrong::kTarget, 0};
}

std::string Sequencer::DescribeWrong() const {
  switch (wrong_) {
    case Wrong::kNothing:
      return "";
    case Wrong::kArm:
      return guard_.Describe(s_.robot);
    case Wrong::kPoses:
      return "no poses of objects come";
    case Wrong::kPoseClock:
      return "the clock of the objects' poses has jumped by " + Fixed(estimate_clock_.jump(), 3) + " s";
    case Wrong::kTarget:
      return "the pose of '" + s_.object_name(lost_target_) + "' is not finite";
  }
  return "";
}

void Sequencer::LetServoHold(robot::Command* command) const {
  if (mode_ == robot::Command::Mode::kVelocity) return;
  const bool stands = s_.trustworthy && s_.v.cwiseAbs().maxCoeff() < kStands;
  const bool holds = command->mode == robot::Command::Mode::kVelocity;
  const bool hold = s_.stopping && guard_.blind() && (holds || stands);
  command->mode = hold ? robot::Command::Mode::kVelocity : mode_;
  if (hold) command->velocity.setZero();
}

void Sequencer::WatchFaults() {
  const auto [wrong, patience] = FindWrong();
  if (wrong != Wrong::kNothing) wrong_ = wrong;
  faults_.Update(s_.time, wrong != Wrong::kNothing, patience);
  s_.stopping = faults_.stopped();
  if (faults_.ended() && started_) servo_->Resume();
  if (!running()) return;
  using Trouble = ObservationGuard::Trouble;
  if (faults_.began()) {
    s_.Record(EventKind::kFault, DescribeWrong() + "; the arm is stopped");
  } else if (faults_.first() && guard_.trouble() != Trouble::kSilence && s_.trustworthy) {
    s_.Record(EventKind::kFault, DescribeWrong() + "; it is not believed");
  }
  if (faults_.ended()) {
    s_.Record(EventKind::kRecovered,
              "all is measured again after " + Fixed(faults_.lasted(), 2) + " s: the arm goes on");
  }
  if (!faults_.lasts()) return;
  servo_->Stop();
  Fail(DescribeWrong() + ", for more than " + Fixed(options_.faults.lasting, 1) + " s");
}

// Poses that are not older than a tick or two.
bool Sequencer::IsFresh() const { return s_.time - estimate_time_ < kFresh * options_.period; }

// What the hand holds is where the hand is: noisy or late poses of it only tell how it lies in the hand.
void Sequencer::FollowHeld(const scene::WorldEstimate& estimate, bool news) {
  hands_[next_hand_] = {s_.time, s_.X_WH};
  next_hand_ = (next_hand_ + 1) % hands_.size();
  if (s_.held == kNone) return;
  const ObjectId object = s_.held;
  if (s_.held != followed_) {
    followed_ = s_.held;
    X_HO_ = s_.X_HO_grasp;
    followed_time_ = estimate_time_;
  }
  if (trackers_[object].exact() && IsFresh()) return;
  const auto found = estimate.X_WO.find(s_.object_name(object));
  if (news && found != estimate.X_WO.end() && IsFinite(found->second)) {
    const TimedPose* then = &hands_.front();
    for (const TimedPose& hand : hands_) {
      if (std::abs(hand.time - estimate_time_) < std::abs(then->time - estimate_time_)) then = &hand;
    }
    const math::Pose measured = math::Between(then->X_WH, found->second);
    const double share = 1 - std::exp(-(estimate_time_ - followed_time_) / kHeldFollows);
    X_HO_.p += share * (measured.p - X_HO_.p);
    X_HO_.R =
        math::ProjectToSO3(X_HO_.R * math::ExpSO3(share * math::LogSO3(X_HO_.R.transpose() * measured.R)));
    followed_time_ = estimate_time_;
  }
  control::MovingPose& now = s_.objects[object];
  now.X = s_.X_WH * X_HO_;
  now.V = s_.V_WH;
  now.V.head<3>() += s_.V_WH.tail<3>().cross(now.X.p - s_.X_WH.p);
}

}  // namespace tether::execution
