#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "tether/common/document/value.h"
#include "tether/evaluation/mcap/mcap_reader.h"
#include "tether/math/pose.h"
#include "tether/sim/world.h"

namespace tether::evaluation {

/// One quantity over a run.
struct LogSeries {
  std::string name;
  std::string unit;             ///< "m", "rad" or "rad/s"
  std::string panel;            ///< Name of the panel in which it is drawn.
  std::vector<double> times;    ///< s
  std::vector<double> values;   ///< One per time; not finite: not measured then.
  double lower = 0, upper = 0;  ///< Limits to draw; both 0: none.
};

struct LogEvent {
  double time = 0;  ///< s
  std::string kind;
  int step = -1;
  std::string action, text;
};

/// What a goal can be judged by at one moment.
struct LogSample {
  double time = 0;                            ///< s
  std::map<std::string, math::Pose> X_WO;     ///< Of all objects.
  std::map<std::string, math::Pose> X_WHand;  ///< By robot.
  std::vector<sim::Contact> contacts;
  int actions_done = 0;
  bool running = false;
  size_t plan = 0;  ///< Index into RunLog::plans.
};

/// What a log holds of a run.
struct RunLog {
  std::string file;
  std::map<std::string, std::string> metadata;
  std::map<std::string, std::string> files;  ///< What the run was made of, by path.
  std::optional<McapProblem> problem;        ///< Where reading ended, if that is not the file's end.
  double end = 0;                            ///< Time of the last message, s.
  std::vector<LogSeries> series;  ///< Least margins per interval, then joints as shares of their ranges.
  std::vector<std::pair<double, std::string>> marks;  ///< Grasps and releases: time (s), text.
  std::vector<LogEvent> events;
  std::vector<Value> plans;        ///< In format tether.plan/1: that of the start, then as it was changed.
  Value report;                    ///< Of the run, in format tether.run/1; null if the log ends before it.
  std::vector<LogSample> samples;  ///< If asked for.

  std::string Metadata(const std::string& key) const;
};

/// Reads a log as far as it goes. Throws InputError if it can't be read, is no log of a run (the log of an
/// earlier version among them, with what to do), or is of another version.
RunLog ReadRunLog(const std::string& path, bool with_samples = false);
/// The same for a file's bytes; `file` names them.
RunLog ParseRunLog(std::string_view bytes, const std::string& file, bool with_samples = false);

/// Whether a file's first bytes are those of MCAP.
bool IsMcap(std::string_view first_bytes);

}  // namespace tether::evaluation
