#pragma once

#include <string>
#include <string_view>

#include "tether/common/document/value.h"

namespace tether::execution {

/// What happened during execution.
enum class EventKind {
  kActionStarted,  ///< `text` is the action: "pick(box)".
  kStepStarted,
  kStepFinished,
  kContact,    ///< The contact that a verb waited for.
  kNoContact,  ///< A verb that waited for contact ended at its pose without.
  kGrasped,
  kReleased,
  kGraspMissed,      ///< The gripper closed on nothing.
  kGraspLost,        ///< The object no longer moves with the hand.
  kPlaceMissed,      ///< What was put down is not in its region.
  kPushSlipped,      ///< The pushed object is not where it was pushed to.
  kStalled,          ///< A verb made no progress.
  kDetour,           ///< The arm follows a path in joint space around what stopped it.
  kTransit,          ///< The whole arm follows a path to where the step begins.
  kResumed,          ///< The plan goes on from one of its actions, with new key poses.
  kReplanned,        ///< The plan goes on with other actions, or another place, than it had.
  kWaiting,          ///< There is no plan from here; it is waited for one.
  kPaused,           ///< The arm was told to stand still …
  kContinued,        ///< … and to go on.
  kGoalBroken,       ///< A part of a temporal goal that nothing can make true any more.
  kClearance,        ///< The hand could not rise to a safe height, and went on below it.
  kRetry,            ///< Execution resumes at `step`.
  kEstimateInvalid,  ///< An object's pose was not finite: the last one is used.
  kSight,            ///< An object is not seen any more, or seen again.
  kSafety,           ///< The controller kept the arm from something: see `text`.
  kFault,            ///< Something is not measured, or does not answer; the arm is stopped.
  kRecovered,        ///< … and the arm goes on.
  kFinished,
  kFailed,
};

/// "step_started", …: the kind's name in files.
std::string_view ToString(EventKind kind);

struct Event {
  double time = 0;  ///< s
  EventKind kind = EventKind::kStepStarted;
  int step = 0;      ///< Index into the plan's steps.
  std::string text;  ///< For people.
};

/// {time_s, kind, step, text}.
Value ToValue(const Event& event);

}  // namespace tether::execution
