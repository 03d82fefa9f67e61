#pragma once

#include "tether/common/document/value.h"

namespace tether::bench {

/// How well a hand follows a circle, and what that takes.
struct TrackingFigures {
  double error = 0;  ///< Mean distance from the target, m.
  double worst = 0;  ///< The largest, m.
  double work = 0;   ///< ∫ |τ · q̇| dt, J.
};

/// A circle of 10 cm radius at 0.2 m/s in the air, where no row is active, once with paper A's controller and
/// once under constraints, each behind the limiter, in the simulation.
struct TrackingBench {
  TrackingFigures operational_space, constrained;
  int active_rows = 0;  ///< Ticks in which a constraint kept the arm from accelerating.
  double error_ratio() const { return constrained.error / operational_space.error; }
  double work_ratio() const { return constrained.work / operational_space.work; }
};

/// `robot`: a shipped robot driven by torques; `seconds`: of tracking, after two turns that don't count.
TrackingBench BenchmarkTracking(const char* robot = "panda", double seconds = 12);

Value WriteTrackingBench(const TrackingBench& bench);

}  // namespace tether::bench
