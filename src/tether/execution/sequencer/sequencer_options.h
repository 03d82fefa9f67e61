#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "tether/common/error.h"
#include "tether/execution/monitor/fault_watch.h"
#include "tether/execution/monitor/replanning.h"
#include "tether/execution/servo/progress.h"

namespace tether::execution {

/// Finds other actions that reach the goal from the present state of a plan, in place of `blocked` and those
/// after it; empty, with the reason, if there are none.
using Alternative = std::function<std::optional<std::vector<std::string>>(
    const std::vector<std::string>& done, const std::string& blocked, std::string& reason)>;

/// When fingers have come to rest.
struct GripperSettling {
  double change = 3e-4;       ///< A smaller change of their opening is none, m.
  double quiet = 0.1195;      ///< Without a change for so long (between two ticks), s …
  double least_time = 0.24;   ///< … and after this time at least, s.
  double timeout = 3;         ///< s
  double open_share = 1;      ///< An opening hand is done at this share of the opening that is wanted …
  double open_slack = 0.002;  ///< … less this, m.
};

/// What the sequencer does alike whatever moves the arm. The defaults are those of torques.
struct SequencerOptions {
  double period = 0.001;          ///< Time between ticks, s.
  double least_width = 0.002;     ///< Closed further than this, the gripper holds nothing, m.
  double slip_distance = 0.03;    ///< An object displaced further in the hand is lost, m …
  double slip_angle = 0.6;        ///< … or turned further, rad …
  double lost_time = 0.0485;      ///< … for so long (between two ticks), s.
  double least_progress = 0.001;  ///< See ProgressWatch.
  double stall_time = 1.5;        ///< A verb without progress for so long has stalled, s.
  double verb_timeout = 40;       ///< s
  int max_retries = 2;            ///< Per action.
  double retry_spacing = 1;       ///< No retry begins sooner after the last one, s; the arm rests meanwhile.
  bool filters_poses = true;      ///< The objects' poses are filtered, not just their velocities.
  GripperSettling gripper;
  FaultOptions faults;
  Alternative alternative;   ///< Asked when an action can't be done; none: the run fails then.
  int max_alternatives = 4;  ///< So often, per run.
  ReplanningOptions replanning;

  ProgressWatch::Options watch() const { return {least_progress, stall_time, verb_timeout}; }
  /// Reports every field that is not finite or not positive.
  void Check(Diagnostics* diagnostics) const;
};

}  // namespace tether::execution
