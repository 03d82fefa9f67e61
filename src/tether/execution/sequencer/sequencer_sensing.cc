#include <algorithm>
#include <cassert>
#include <cmath>

#include "tether/execution/sequencer/sequencer.h"

namespace tether::execution {
namespace {

// Time constant with which it is followed how a held object lies in the hand, s; ticks within which a pose is
// as good as new.
constexpr double kHeldFollows = 0.3;
constexpr double kFresh = 1.5;
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
  // The later of both clocks: estimates may be old.
  if (std::isfinite(seen.time)) s_.time = std::max(seen.time, estimate.time);
  const bool news = estimate.time > estimate_time_;
  if (news) estimate_time_ = estimate.time;
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
