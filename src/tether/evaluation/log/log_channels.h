#pragma once

#include <vector>

#include "tether/evaluation/log/log_stream.h"

namespace tether::evaluation {

/// The format of a run's log, as its metadata record names it.
inline constexpr const char* kLogFormat = "tether.log/2";
/// The name of that record.
inline constexpr const char* kLogMetadata = "tether";

/// The channels of a run's log, by their places in LogChannels(); docs/logs.md says what each holds.
enum LogTopic : int {
  kTransforms,
  kStaticTransforms,
  kSceneUpdate,
  kJoints,
  kCommands,
  kContacts,
  kMargins,
  kState,
  kEvents,
  kMessages,
  kMarks,
  kPlans,
  kCamera,
  kRobots,
  kResult,
};

/// The channels with their schemas: those of Foxglove as it publishes them, without the explanations, and
/// ours.
std::vector<LogChannel> LogChannels();

}  // namespace tether::evaluation
