#pragma once

#include <chrono>
#include <memory>
#include <optional>

#include "tether/nlp/solver.h"
#include "tether/nlp/vector_view.h"

namespace tether::nlp {

/// Shared by the backends; not for users of the room.

/// One solver per backend; stateless between solves.
std::unique_ptr<Solver> MakeNativeSolver();
/// IPOPT or NLopt, by loading the plugin of that name at the first solve.
std::unique_ptr<Solver> MakePluginSolver(Backend backend);

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

/// Watches one solve: its limits, its trace and its verdict. The clock starts when it is made. Functions are
/// virtual as those of VectorView.
class Monitor {
 public:
  /// Both must outlive the monitor.
  Monitor(const Program& program, const Options& options);
  virtual ~Monitor() = default;

  double Seconds() const;
  /// The reason to end now, if there is one: stopped, out of time, or a residual that was not finite. Once
  /// there is one it stays.
  virtual std::optional<Status> ReasonToEnd();
  /// Ends the solve because the residual called `name` was not finite.
  virtual void FailNotFinite(const std::string& name);
  /// Ends the solve for a limit that the backend keeps itself.
  void End(Status status) { reason_ = status; }
  /// Adds to the trace, if there is one. Iterations count from 0; a repeated number is ignored.
  virtual void Record(int iteration, VectorView& view, const Eigen::VectorXd& x);
  /// The same for a backend that knows the figures.
  void Record(int iteration, double cost, double violation_m, double violation_rad);
  bool WantsRecord(int iteration) const {
    return options_.trace && (trace_.empty() || iteration > trace_.back().iteration);
  }

  int max_iterations() const { return options_.max_iterations; }
  double constraint_tolerance() const { return options_.constraint_tolerance; }
  double cost_tolerance() const { return options_.cost_tolerance; }
  virtual double SecondsLeft() const;
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

/// What a plugin returns of a solve.
struct PluginOutcome {
  Status status = Status::kFailed;
  std::string message;
  int iterations = 0;
  Eigen::VectorXd x;  ///< In the coordinates of the view.
};
/// What a plugin exports as "TetherSolve", with C linkage.
using PluginSolve = void(VectorView& view, Monitor& monitor, const Options& options, PluginOutcome& outcome);

/// The outcome where there is nothing to solve: no variable, or every one fixed by its bounds. Empty
/// otherwise.
std::optional<Result> SolveTrivial(const Program& program, const Point& guess, const Options& options);

}  // namespace tether::nlp
