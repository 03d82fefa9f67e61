#pragma once

#include <chrono>

#include "tether/planning/problem.h"

namespace tether::planning {

/// The time and stop limits that all parts of one planning run share; its clock starts when it is made.
class Limits {
 public:
  explicit Limits(const SearchOptions& options) : options_(options), begin_(Clock::now()) {}

  bool Stopped() const { return options_.stop != nullptr && options_.stop->load(); }
  /// Seconds left.
  double Remaining() const { return options_.time_limit_s > 0 ? options_.time_limit_s - Elapsed() : 1e9; }
  bool Over() const { return Stopped() || Remaining() <= 0; }
  double Elapsed() const { return std::chrono::duration<double>(Clock::now() - begin_).count(); }

 private:
  using Clock = std::chrono::steady_clock;
  const SearchOptions& options_;
  Clock::time_point begin_;
};

}  // namespace tether::planning
