#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "tether/bench/process_time.h"
#include "tether/common/document/value.h"
#include "tether/nlp/solver.h"
#include "tether/planning/plan/report.h"

namespace tether::bench {

/// Options of `tether bench planning`.
struct PlanningBenchOptions {
  std::vector<std::string> scenarios;  ///< Files; empty: the four that ship.
  std::vector<std::string> solvers;    ///< Names; empty: all.
  /// Of the native solver. IPOPT gets a tenth of them and NLopt a fiftieth, each at least one.
  int repetitions = 50;
  bool no_robot = false;  ///< Without the arm's reach.
  std::string program;    ///< Path of `tether`, to time whole processes with; empty: they are not timed.
  const std::atomic<bool>* stop = nullptr;

  /// Throws InputError naming the option that is out of range, or a solver that is not known.
  void Validate() const;
};

/// One program, solved by one solver from the scene's own start.
struct ProgramMeasurement {
  std::vector<std::string> actions;  ///< Of the candidate whose program it is.
  nlp::Result result;                ///< The last one; every repetition gives the same, times apart.
  Samples solve;
};

/// Files to plan with one solver in one thread, all candidates.
struct WholePlanning {
  planning::PlanStatus status = planning::PlanStatus::kNotCalled;
  int feasible = 0;                      ///< Candidates.
  double cost = 0;                       ///< Of the best one.
  double max_violation_m = 0;            ///< Of the feasible ones, by the independent checker.
  double max_violation_rad = 0;          ///< The same.
  Samples total;                         ///< Reading files, search, optimisation.
  Samples optimize;                      ///< All candidates: building, solving, checking.
  std::vector<double> read_s, search_s;  ///< Wall clock.
};

/// One solver on the programs of one problem.
struct SolverMeasurement {
  nlp::Backend backend = nlp::Backend::kNative;
  std::vector<ProgramMeasurement> programs;
  Samples optimize;  ///< All programs, one sample per repetition.
  // Sums over programs and repetitions, s.
  double solve_s = 0, evaluation_s = 0, assembly_s = 0, linear_algebra_s = 0;
  WholePlanning planning;

  int iterations() const;              ///< Of all programs.
  int evaluations() const;             ///< Of all programs.
  double max_violation_m() const;      ///< Of the programs that were solved.
  double max_violation_rad() const;    ///< The same.
  std::optional<double> cost() const;  ///< Of the best program that was solved.
};

/// The measurements of one scenario, with all solvers.
struct ProblemMeasurement {
  std::string title;
  std::string path;
  uint64_t seed = 0;
  int candidates = 0;  ///< Some of them may have no program, because they are refuted.
  int key_poses = 0, variables = 0, rows = 0;  ///< Of the largest program.
  Samples build;                               ///< All programs.
  Samples check;                               ///< The independent checker, all candidates' plans.
  Samples process;    ///< `tether plan` with the native solver in one thread, from start to exit.
  int exit_code = 0;  ///< Of that.
  std::vector<SolverMeasurement> solvers;

  const SolverMeasurement* native() const;  ///< Null if it was not asked for.
  /// The largest relative excess of a program's cost over the least that any solver found for the same
  /// program; infinite if one was not solved here but elsewhere.
  double CostExcess(const SolverMeasurement& solver) const;
};

struct PlanningBench {
  std::vector<ProblemMeasurement> problems;
  int repetitions = 0;
  bool no_robot = false;
  bool interrupted = false;  ///< `problems` holds those that were finished.
};

/// The number of repetitions with a backend.
int Repetitions(nlp::Backend backend, int repetitions);

/// Measures every solver on the same programs, one per candidate, in one thread; the repetitions of the
/// solvers alternate, so that other load of the machine affects all of them. Then planning as a whole with
/// each, and processes. Calls `on_problem` after each problem. Throws InputError for options and files.
PlanningBench BenchmarkPlanning(const PlanningBenchOptions& options,
                                const std::function<void(const ProblemMeasurement&)>& on_problem = {});

/// Format `tether.bench/1`, name `planning`: a row per problem and solver. Times in s, lengths in m.
Value WritePlanningBench(const PlanningBench& bench);
/// The same for people; times in ms.
std::string PlanningBenchTable(const ProblemMeasurement& problem);

}  // namespace tether::bench
