#pragma once

#include <chrono>
#include <memory>
#include <optional>

#include "tether/nlp/solver.h"
#include "tether/nlp/vector_view.h"

namespace tether::nlp {

/// Shared by the backends; not for users of the room.

std::unique_ptr<Solver> MakeIpoptSolver();
std::unique_ptr<Solver> MakeNloptSolver();
std::unique_ptr<Solver> MakeNativeSolver();

/// Adds the seconds of its life to a sum.
class Stopwatch {
 public:
  explicit Stopwatch(double& sum) : sum_(sum), begin_(Clock::now()) {}
  ~Stopwatch() { sum_ += std::chrono::duration<double>(Clock::now() - begin_).count(); }
  Stopwatch(const Stopwatch&) = delete;
  Stopwatch& operator=(const Stopwatch&) = delete;

 private:
  using Clock = std::chrono::steady_clock;
  double& sum_;
  Clock::time_point begin_;
};

/// Watches one solve: its limits, its trace and its verdict. The clock starts when it is made.
class Monitor {
 public:
  /// Both must outlive the monitor.
  Monitor(const Program& program, const Options& options);

  double Seconds() const;
  /// The reason to end now, if there is one: stopped, out of time, or a residual that was not finite. Once
  /// there is one it stays.
  std::optional<Status> ReasonToEnd();
  /// Ends the solve because the residual called `name` was not finite.
  void FailNotFinite(const std::string& name);
  /// Ends the solve for a limit that the backend keeps itself.
  void End(Status status) { reason_ = status; }
  /// Adds to the trace, if there is one. Iterations count from 0; a repeated number is ignored.
  void Record(int iteration, VectorView& view, const Eigen::VectorXd& x);
  /// The same for a backend that knows the figures.
  void Record(int iteration, double cost, double violation_m, double violation_rad);
  bool WantsRecord(int iteration) const {
    return options_.trace && (trace_.empty() || iteration > trace_.back().iteration);
  }

  int max_iterations() const { return options_.max_iterations; }
  double constraint_tolerance() const { return options_.constraint_tolerance; }
  double cost_tolerance() const { return options_.cost_tolerance; }
  double SecondsLeft() const;
  /// The time spent in residuals, for a Stopwatch to add to.
  double& evaluation_s() { return evaluation_s_; }

  /// The result at x: judged by Assess, in the program's own terms. `status` and `message` are the backend's;
  /// a reason to end overrides them, and "solved" at a point that is not feasible becomes "failed".
  Result Finish(Point x, Status status, std::string message, int iterations, int evaluations);

 private:
  const Program& program_;
  const Options& options_;
  std::chrono::steady_clock::time_point begin_;
  std::optional<Status> reason_;
  std::string not_finite_;
  double evaluation_s_ = 0;
  std::vector<IterationRecord> trace_;
};

/// The outcome where there is nothing to solve: no variable, or every one fixed by its bounds. Empty
/// otherwise.
std::optional<Result> SolveTrivial(const Program& program, const Point& guess, const Options& options);

}  // namespace tether::nlp
