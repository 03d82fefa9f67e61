#pragma once

#include <atomic>
#include <memory>
#include <string>
#include <vector>

#include "tether/nlp/program.h"

namespace tether::nlp {

struct Options {
  int max_iterations = 1000;
  double time_limit_s = 60;                 ///< Wall clock, for one solve.
  double constraint_tolerance = 1e-6;       ///< Aim, m and rad; the caller decides what counts as feasible.
  double cost_tolerance = 1e-6;             ///< Relative optimality aim.
  bool trace = false;                       ///< Record every iteration (Paper A, Fig. 5).
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

/// The multipliers at the end of an earlier solve of a similar program. A term's entry belongs to the term of
/// Program::terms() with the same index; where terms came or went, the caller moves the entries along. An
/// entry that is missing or of another size counts as zero.
struct WarmStart {
  /// Per term one multiplier y for each row, so that the gradient of the cost + Σ y · row vanishes; ≥ 0 for
  /// inequalities, empty for costs.
  std::vector<Eigen::VectorXd> terms;
  /// Per vector one for each entry: positive at its upper bound, negative at its lower one.
  std::vector<Eigen::VectorXd> bounds;
  double penalty = 0;  ///< On violations, in the merit function; 0: the solver's own choice.
  bool empty() const { return terms.empty() && bounds.empty() && penalty == 0; }
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
  // Parts of solve_s. IPOPT and NLopt report only the first, the time in their callbacks.
  double evaluation_s = 0;      ///< In residuals and their derivatives.
  double assembly_s = 0;        ///< Putting the subproblems' matrices together.
  double linear_algebra_s = 0;  ///< Factorising them, solving with them, and the rest of the subproblems.
  std::string message;
  std::vector<IterationRecord> trace;
  /// For another solve from here; empty where the backend does not know multipliers.
  WarmStart warm_start;
  /// Where the end is not feasible: the conflicting terms, by index in Program::terms(), those with the
  /// largest weight first. They are the violated terms and, if the native backend ends as kLocallyInfeasible,
  /// those that prevent them from being satisfied.
  std::vector<int> blocking_terms;

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
  /// Whether it was built: IPOPT and NLopt may be missing.
  virtual bool available() const { return true; }
  /// Why it can't take any program, and what to install; empty if it is available.
  virtual std::string WhyNot() const { return ""; }
  /// Solves from `guess`, which has a value for every block. Never throws for a hard program: the outcome is
  /// in the result. Throws InputError if the solver is not available. `warm`, if given, speeds up the native
  /// backend where the solution is near; the others ignore it.
  Result Solve(const Program& program, const Point& guess, const Options& options,
               const WarmStart* warm = nullptr) const;

 protected:
  /// `warm` is never null; the options are valid and there is something to solve.
  virtual Result DoSolve(const Program& program, const Point& guess, const Options& options,
                         const WarmStart& warm) const = 0;
};
/// A solver that may not be available.
std::unique_ptr<Solver> MakeSolver(Backend backend);

}  // namespace tether::nlp
