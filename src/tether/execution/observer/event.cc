#include "tether/execution/observer/event.h"

namespace tether::execution {

std::string_view ToString(EventKind kind) {
  switch (kind) {
    case EventKind::kActionStarted:
      return "action_started";
    case EventKind::kStepStarted:
      return "step_started";
    case EventKind::kStepFinished:
      return "step_finished";
    case EventKind::kContact:
      return "contact";
    case EventKind::kNoContact:
      return "no_contact";
    case EventKind::kGrasped:
      return "grasped";
    case EventKind::kReleased:
      return "released";
    case EventKind::kGraspMissed:
      return "grasp_missed";
    case EventKind::kGraspLost:
      return "grasp_lost";
    case EventKind::kPlaceMissed:
      return "place_missed";
    case EventKind::kPushSlipped:
      return "push_slipped";
    case EventKind::kStalled:
      return "stalled";
    case EventKind::kDetour:
      return "detour";
    case EventKind::kTransit:
      return "transit";
    case EventKind::kResumed:
      return "resumed";
    case EventKind::kReplanned:
      return "replanned";
    case EventKind::kWaiting:
      return "waiting";
    case EventKind::kPaused:
      return "paused";
    case EventKind::kContinued:
      return "continued";
    case EventKind::kGoalBroken:
      return "goal_broken";
    case EventKind::kClearance:
      return "clearance";
    case EventKind::kRetry:
      return "retry";
    case EventKind::kEstimateInvalid:
      return "estimate_invalid";
    case EventKind::kSight:
      return "sight";
    case EventKind::kSafety:
      return "safety";
    case EventKind::kFault:
      return "fault";
    case EventKind::kRecovered:
      return "recovered";
    case EventKind::kFinished:
      return "finished";
    case EventKind::kFailed:
      return "failed";
  }
  return "unknown";
}

Value ToValue(const Event& event) {
  Value value = Value::Object();
  value.Set("time_s", event.time)
      .Set("kind", ToString(event.kind))
      .Set("step", event.step)
      .Set("text", event.text);
  return value;
}

}  // namespace tether::execution
