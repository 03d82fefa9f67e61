#pragma once

#include <algorithm>
#include <chrono>

#include "tether/planning/problem.h"

namespace tether::planning {

/// The time and stop limits that all parts of one planning run share; its clock starts when it is made.
class Limits {
 public:
  explicit Limits(const SearchOptions& options) : options_(options), begin_(Clock::now()) {}

  bool Stopped() const { return options_.stop != nullptr && options_.stop->load(); }
  /// Seconds left: always more than nothing, so that it can be another's limit.
  double Remaining() const { return HasLimit() ? std::max(1e-9, options_.time_limit_s - Elapsed()) : 1e9; }
  bool Over() const { return Stopped() || (HasLimit() && Elapsed() >= options_.time_limit_s); }
  double Elapsed() const { return std::chrono::duration<double>(Clock::now() - begin_).count(); }

 private:
  bool HasLimit() const { return options_.time_limit_s > 0; }

  using Clock = std::chrono::steady_clock;
  const SearchOptions& options_;
  Clock::time_point begin_;
};

}  // namespace tether::planning
