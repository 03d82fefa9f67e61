#include "tether/nlp/solver.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "tether/common/error.h"
#include "tether/common/stop.h"
#include "tether/common/text.h"
#include "tether/nlp/backends.h"

namespace tether::nlp {
namespace {

constexpr std::array<std::pair<Backend, const char*>, 3> kBackends{
    {{Backend::kNative, "native"}, {Backend::kIpopt, "ipopt"}, {Backend::kNlopt, "nlopt"}}};

std::string Format(const char* format, auto... values) {
  char text[256];
  FormatInto(text, sizeof(text), format, values...);
  return text;
}

double LargestViolation(const Assessment& assessment) {
  return std::max({assessment.max_violation_m, assessment.max_violation_rad, assessment.max_violation_other,
                   assessment.max_bound_violation});
}

}  // namespace

void Options::Validate() const {
  if (max_iterations < 1) {
    throw InputError("solver option max_iterations is " + std::to_string(max_iterations),
                     "an integer of at least 1");
  }
  const auto positive = [](const char* name, double value, const char* unit) {
    if (std::isfinite(value) && value > 0) return;
    throw InputError(Format("solver option %s is %g", name, value),
                     Format("a finite number above 0%s", unit));
  };
  positive("time_limit_s", time_limit_s, ", in seconds");
  positive("constraint_tolerance", constraint_tolerance, ", in metres and radians");
  positive("cost_tolerance", cost_tolerance, "");
}

std::string ToString(Status status) {
  switch (status) {
    case Status::kNotCalled:
      return "not called";
    case Status::kSolved:
      return "solved";
    case Status::kLocallyInfeasible:
      return "locally infeasible";
    case Status::kIterationLimit:
      return "iteration limit";
    case Status::kTimeLimit:
      return "time limit";
    case Status::kInterrupted:
      return "interrupted";
    case Status::kFailed:
      return "failed";
  }
  return "";
}

std::string Result::Summary() const {
  if (status == Status::kNotCalled) return "not called";
  std::string text =
      ToString(status) +
      Format(": cost %.6g, violation %.3g mm, %.3g mrad, %d iterations, %d evaluations, %.3f s", cost,
             1e3 * max_violation_m, 1e3 * max_violation_rad, iterations, evaluations, solve_s);
  if (!message.empty()) text += " (" + message + ")";
  return text;
}

std::string ToString(Backend backend) {
  for (const auto& [value, name] : kBackends) {
    if (value == backend) return name;
  }
  return "";
}

Backend ParseBackend(const std::string& name) {
  std::vector<std::string> names;
  for (const auto& [value, known] : kBackends) {
    if (name == known) return value;
    names.emplace_back(known);
  }
  const std::string nearest = NearestMatch(name, names);
  throw InputError(
      "unknown solver '" + name + "'" + (nearest.empty() ? "" : "; did you mean '" + nearest + "'?"),
      JoinAlternatives(names));
}

Result Solver::Solve(const Program& program, const Point& guess, const Options& options,
                     const WarmStart* warm) const {
  options.Validate();
  if (std::optional<Result> trivial = SolveTrivial(program, guess, options)) return *std::move(trivial);
  return DoSolve(program, guess, options, warm != nullptr ? *warm : WarmStart());
}

std::unique_ptr<Solver> MakeSolver(Backend backend) {
  return backend == Backend::kNative ? MakeNativeSolver() : MakePluginSolver(backend);
}

Monitor::Monitor(const Program& program, const Options& options)
    : program_(program), options_(options), begin_(std::chrono::steady_clock::now()) {}

double Monitor::Seconds() const {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin_).count();
}

double Monitor::SecondsLeft() const { return std::max(0.0, options_.time_limit_s - Seconds()); }

std::optional<Status> Monitor::ReasonToEnd() {
  if (reason_) return reason_;
  if (IsStopped(options_.stop)) {
    reason_ = Status::kInterrupted;
  } else if (Seconds() > options_.time_limit_s) {
    reason_ = Status::kTimeLimit;
  }
  return reason_;
}

void Monitor::FailNotFinite(const std::string& name) {
  if (reason_) return;
  not_finite_ = name;
  reason_ = Status::kFailed;
}

void Monitor::Record(int iteration, VectorView& view, const Eigen::VectorXd& x) {
  if (!WantsRecord(iteration) || !view.EvaluateValues(x)) return;
  Record(iteration, view.cost(), view.ViolationIn(Unit::kMetre), view.ViolationIn(Unit::kRadian));
}

void Monitor::Record(int iteration, double cost, double violation_m, double violation_rad) {
  if (!WantsRecord(iteration)) return;
  trace_.push_back({iteration, cost, violation_m, violation_rad, Seconds()});
}

Result Monitor::Finish(Point x, Status status, std::string message, int iterations, int evaluations) {
  Result result;
  result.evaluation_s = evaluation_s_;
  const Assessment assessment = Assess(program_, x);
  result.x = std::move(x);
  result.status = reason_.value_or(status);
  result.message = reason_ ? "" : std::move(message);
  if (!not_finite_.empty() || !assessment.finite) {
    result.status = Status::kFailed;
    result.message =
        "residual '" + (not_finite_.empty() ? assessment.not_finite : not_finite_) + "' is not finite";
  }
  // A backend judges its own scaled problem; its "solved" must hold in the program's units as well.
  const double violation = LargestViolation(assessment);
  if (result.status == Status::kSolved && violation > 10 * options_.constraint_tolerance) {
    result.status = Status::kFailed;
    result.message = Format("the solver stopped at a violation of %g, above the tolerance of %g", violation,
                            options_.constraint_tolerance);
  }
  if (violation > options_.constraint_tolerance) {
    for (const Assessment::Violation& found : assessment.violations) {
      const auto& terms = program_.terms();
      const auto term = std::find_if(terms.begin(), terms.end(),
                                     [&](const Term& t) { return t.residual.get() == found.residual; });
      const int index = static_cast<int>(term - terms.begin());
      auto& blocking = result.blocking_terms;
      if (found.amount > options_.constraint_tolerance &&
          std::find(blocking.begin(), blocking.end(), index) == blocking.end())
        blocking.push_back(index);
    }
  }
  result.cost = assessment.cost;
  result.max_violation_m = assessment.max_violation_m;
  result.max_violation_rad = assessment.max_violation_rad;
  result.iterations = iterations;
  result.evaluations = evaluations;
  result.solve_s = Seconds();
  result.trace = std::move(trace_);
  return result;
}

std::optional<Result> SolveTrivial(const Program& program, const Point& guess, const Options& options) {
  bool all_fixed = program.num_poses() == 0;
  for (int i = 0; i < program.num_vectors() && all_fixed; ++i)
    all_fixed = program.lower(i) == program.upper(i);
  if (!all_fixed) return std::nullopt;
  Monitor monitor(program, options);
  VectorView view(program, guess);
  monitor.Record(0, view, view.start());
  Point x = view.PointAt(view.start());
  const bool feasible = LargestViolation(Assess(program, x)) <= options.constraint_tolerance;
  return monitor.Finish(std::move(x), feasible ? Status::kSolved : Status::kLocallyInfeasible,
                        feasible ? "" : "every variable is fixed", 0, view.evaluations() + 1);
}

}  // namespace tether::nlp
