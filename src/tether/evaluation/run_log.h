#pragma once

#include <string>
#include <vector>

#include "tether/common/document/value.h"

namespace tether::evaluation {

/// The format of a run's log.
inline constexpr const char* kLogFormat = "tether.log/1";

/// One quantity over a run.
struct LogSeries {
  std::string name;
  std::string unit;             ///< "m", "rad" or "rad/s"
  std::string panel;            ///< Name of the panel in which it is drawn.
  std::vector<double> values;   ///< One per time; not finite: not measured then.
  double lower = 0, upper = 0;  ///< Limits to draw; both 0: none.
};

/// What a run measured, sample by sample: `tether run --log`, and what `tether report` draws.
struct RunLog {
  std::string scenario;
  uint64_t seed = 0;
  std::vector<double> times;  ///< s
  std::vector<LogSeries> series;
  std::vector<std::pair<double, std::string>> marks;  ///< Grasps and releases: time (s), text.
};

/// The log in format `tether.log/1`.
Value WriteRunLog(const RunLog& log);
/// Throws InputError with what is wrong and where.
RunLog ReadRunLog(const Value& document);

/// The log as a figure: one panel under the other, as in paper B, figures 9–11; dotted lines where something
/// is grasped or released.
std::string DrawRunLog(const RunLog& log);

}  // namespace tether::evaluation
