#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "tether/common/document/value.h"

namespace tether::bench {

struct MotionBenchOptions {
  std::string problems;  ///< A folder of MotionBenchMaker's scenes and requests.
  std::string robot = "panda_flange";
  uint64_t seed = 1;
  const std::atomic<bool>* stop = nullptr;
};

enum class MotionOutcome {
  kSolved,
  kInvalid,   ///< The start or every goal touches something or is beyond a limit.
  kNotRead,   ///< Files that are malformed, or a shape that we do not have.
  kUnsolved,  ///< No path within the limit.
  kCollides,  ///< The exact check refutes the path.
};

struct MotionMeasurement {
  std::string name;
  MotionOutcome outcome = MotionOutcome::kUnsolved;
  std::string reason;  ///< Unless it is solved.
  double build_s = 0;  ///< Compiling the scene, CPU time.
  double plan_s = 0;   ///< Path and shortcuts, CPU time of one core.
  int64_t checks = 0, exact_checks = 0;
  double length_rad = 0;
  std::vector<std::string> unknown;  ///< Shapes that we do not have.
};

/// Configurations checked per second of CPU time, along the same random lines in the problems' scenes.
struct CheckRates {
  double simd = 0, plain = 0, geometry = 0;
};

struct MotionBench {
  MotionBenchOptions options;
  std::vector<MotionMeasurement> rows;
  CheckRates rates;
  bool interrupted = false;
  int collisions() const;  ///< Paths that the exact check refutes.
};

/// Plans each problem, on one thread, and verifies each path by exact distances at steps of at most 1e-3 rad.
/// Calls `on_row` for each as soon as it is known. Throws InputError if there are no problems or no such
/// robot.
MotionBench BenchmarkMotion(const MotionBenchOptions& options,
                            const std::function<void(const MotionMeasurement&)>& on_row);

/// Lines for people.
std::string MotionBenchText(const MotionBench& bench);
/// Format `tether.bench/1`.
Value WriteMotionBench(const MotionBench& bench);

}  // namespace tether::bench
