#pragma once

#include <cstdint>

#include "tether/bench/process_time.h"
#include "tether/common/document/value.h"

namespace tether::bench {

/// What `tether bench control` measures of the QP solver alone: 7 variables, 40 rows and bounds, as
/// qp::ControlSequence poses them. Every problem is written to the same place before it is solved, as a
/// controller does, and timed in several passes, of which its median counts: that leaves out interruptions by
/// other processes and keeps what the problem itself costs. The clock's own 20–30 ns are part of the times.
struct ControlBench {
  int variables = 7;
  int rows = 40;
  int problems = 5000;  ///< Of smooth sequences, and as many unrelated ones.
  int passes = 5;
  uint64_t seed = 1;

  Spread cold;             ///< Cold starts; all problems.
  Spread warm;             ///< From the last problem's active rows; smooth sequences.
  Spread warm_random;      ///< Warm starts from unrelated problems.
  double mean_active = 0;  ///< Active rows and bounds at the solution; all problems.
  double max_kkt = 0;      ///< Largest relative residual, as in qp::KktResidual; warm and cold.
  int unsolved = 0;
};

/// Measures; the options are the fields of `bench` that precede the results.
ControlBench BenchmarkControl(ControlBench bench = {});

/// Format `tether.bench/1`, name `control`. Times in s.
Value WriteControlBench(const ControlBench& bench);

}  // namespace tether::bench
