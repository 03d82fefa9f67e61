#pragma once

#include <algorithm>
#include <chrono>

#include "tether/common/limits.h"
#include "tether/planning/plan/problem.h"

namespace tether::planning {

/// The limits that all parts of one planning run share; its clock starts when it is made.
class Limits : public tether::Limits {
 public:
  explicit Limits(const SearchOptions& options) : begin_(Clock::now()) {
    interrupted = options.stop;
    memory = options.memory_limit;
    SetTimeLimit(options.time_limit_s);
  }

  bool Stopped() const { return interruption_requested(); }
  /// Seconds left: always above zero, so that it can be another's limit.
  double Remaining() const {
    return deadline ? std::max(1e-9, std::chrono::duration<double>(*deadline - Clock::now()).count()) : 1e9;
  }
  bool Over() const { return Reached().has_value(); }
  double Elapsed() const { return std::chrono::duration<double>(Clock::now() - begin_).count(); }

 private:
  using Clock = std::chrono::steady_clock;
  Clock::time_point begin_;
};

}  // namespace tether::planning
