#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "tether/common/document/value.h"

namespace tether::bench {

/// Times of whole control ticks: kinematics, all rows for all links and what is held, and the QP.
struct TickBench {
  std::string robot;
  int ticks = 0;
  double median = 0, p99 = 0, p9999 = 0, max = 0;  ///< s per tick
  double over_1ms = 0;      ///< Share of ticks above 1 ms of wall-clock time, preemption included.
  double cpu_over_1ms = 0;  ///< The same by the thread's own time …
  double cpu_max = 0;       ///< … and its longest tick, s.
  double mean_rows = 0;
  int max_rows = 0;
  int relaxed = 0;          ///< Ticks in which rows conflicted.
  int faults = 0;           ///< Ticks without a solution.
  double worst_m = 0;       ///< The most that a distance fell below its safe value, m.
  double region_rows = 0;   ///< Rows of the region that the hand goes to.
  double mean_qp_rows = 0;  ///< Torques: rows that may matter in a tick and so are in its QP.
  int max_iterations = 0;   ///< Torques: of the QP in one tick.
  int conflicts = 0;  ///< Torques: ticks in which rows conflicted, accelerations' and jerks' among them.
};

/// The form of the region that the held object is brought to.
enum class BenchRegion { kDisc, kRectangle };

/// A robot of this name with an object in its hand between a table, two walls and things upon the table. The
/// hand goes to random places at 200 Hz, the object to regions on the table between them, while one thing
/// moves about.
TickBench BenchmarkTicks(const std::string& robot, BenchRegion region, int ticks, uint64_t seed);

/// Called before and after what is measured of each tick; may be empty.
struct TickHooks {
  std::function<void()> begin, end;
};

/// The same with torques, at 1 kHz, on the arm's own equations of motion: kinematics, dynamics, all rows and
/// the QP. Times are the thread's own, `over_1ms` and `max` those on the clock.
TickBench BenchmarkTorqueTicks(const std::string& robot, BenchRegion region, int ticks, uint64_t seed,
                               const TickHooks& hooks = {});

/// The measurements as a map: times in s, distances in m.
Value WriteTickBench(const TickBench& bench);

}  // namespace tether::bench
