#pragma once

#include <string>

#include "tether/common/document/value.h"

namespace tether::bench {

/// Ticks of the torque controller at 1 kHz by the clock on the wall, as `tether run --realtime` has them,
/// while a second process keeps other cores busy.
struct PacedBench {
  std::string robot = "panda";
  double seconds = 60;
  bool loaded = true;  ///< A second process that only computes runs meanwhile.
  int ticks = 0;
  /// Ticks that were not done when the next one was due: started late, or took too long.
  int over = 0;
  double latest_start = 0;  ///< s after it was due
  double longest = 0;       ///< s of computing, on the clock
  double share_over() const { return ticks == 0 ? 0 : static_cast<double>(over) / ticks; }
};

/// Runs for `bench.seconds`. Without a second processor, or where no process can be started, nothing loads
/// it: `loaded` says so.
PacedBench BenchmarkPaced(PacedBench bench);

Value WritePacedBench(const PacedBench& bench);

}  // namespace tether::bench
