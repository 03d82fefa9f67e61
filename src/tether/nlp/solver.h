#pragma once

#include <atomic>
#include <memory>
#include <string>
#include <vector>

#include "tether/nlp/program.h"

namespace tether::nlp {

struct Options {
  int max_iterations = 1000;
  double time_limit_s = 60;            ///< Wall clock, for one solve.
  double constraint_tolerance = 1e-6;  ///< Aim, m and rad; what counts as feasible is the caller's business.
  double cost_tolerance = 1e-6;        ///< Relative optimality aim.
  bool trace = false;                  ///< Record every iteration (Paper A, Fig. 5).
  const std::atomic<bool>* stop = nullptr;  ///< Ends the solve soon after it becomes true.
  /// Throws InputError naming the field that is out of range.
  void Validate() const;
};

enum class Status {
  kNotCalled,
  kSolved,             ///< Converged to a point that the solver holds to be feasible and locally optimal.
  kLocallyInfeasible,  ///< Converged to a point where the violation cannot be lowered locally. No proof of
                       ///< anything.
  kIterationLimit,
  kTimeLimit,
  kInterrupted,
  kFailed,  ///< The solver broke down; `message` says how.
};
std::string ToString(Status status);

struct IterationRecord {
  int iteration;
  double cost;
  double violation_m;
  double violation_rad;
  double time_s;  ///< Since the solve began.
};

struct Result {
  Status status = Status::kNotCalled;
  Point x;
  double cost = 0;
  double max_violation_m = 0;
  double max_violation_rad = 0;
  int iterations = 0;
  int evaluations = 0;  ///< Of the whole program.
  double solve_s = 0;
  std::string message;
  std::vector<IterationRecord> trace;

  bool ok() const { return status == Status::kSolved; }
  /// One line for people.
  std::string Summary() const;
};

/// The closed set of solvers.
enum class Backend { kNative, kIpopt, kNlopt };
std::string ToString(Backend backend);
/// Throws InputError listing the names accepted.
Backend ParseBackend(const std::string& name);

class Solver {
 public:
  virtual ~Solver() = default;
  /// Solves from `guess`, which has a value for every block. Never throws for a hard program: the outcome is
  /// in the result.
  virtual Result Solve(const Program& program, const Point& guess, const Options& options) const = 0;
};
std::unique_ptr<Solver> MakeSolver(Backend backend);

}  // namespace tether::nlp
