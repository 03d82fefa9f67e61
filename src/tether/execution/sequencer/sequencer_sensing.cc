#include <algorithm>
#include <cassert>
#include <cmath>

#include "tether/execution/sequencer/sequencer.h"

namespace tether::execution {
namespace {

bool IsFinite(const math::Pose& X) { return X.R.allFinite() && X.p.allFinite(); }

}  // namespace

// The pose of an object that is not finite, or that the estimate lacks, is its last one: where poses are
// filtered, moved on as it moved; else at rest.
void Sequencer::Track(ObjectId object, const math::Pose* measured, bool news) {
  control::MovingPose& now = s_.objects[object];
  FrameTracker& tracker = trackers_[object];
  const bool usable = measured != nullptr && IsFinite(*measured);
  const bool bad = measured != nullptr && !usable;
  if (options_.filters_poses) {
    if (!sensed_) {
      tracker.Reset(usable ? *measured : s_.scene.InitialPose(s_.object_name(object)), s_.time);
    } else {
      tracker.Predict(s_.time);
      if (news && usable) tracker.Correct(*measured);
    }
    now = {tracker.X_WF(), tracker.V_WF()};
  } else if (!usable) {
    now.V.setZero();
  } else {
    // What stands on a contact trembles from one tick to the next, and is at rest.
    if (sensed_ && !invalid_[object]) {
      tracker.Predict(s_.time);
      tracker.Correct(*measured);
    } else {
      tracker.Reset(*measured, s_.time);
    }
    now = {*measured, tracker.V_WF()};
  }
  if (bad && (news || !sensed_) && !invalid_[object]) {
    s_.Record(EventKind::kEstimateInvalid,
              "the pose of '" + s_.object_name(object) + "' is not finite; the last one is used");
  }
  if (news || !sensed_) invalid_[object] = !usable;
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
}

}  // namespace tether::execution
