#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include <nlopt.h>

#include "tether/nlp/backends.h"

namespace tether::nlp {
namespace {

struct Destroy {
  void operator()(nlopt_opt_s* optimizer) const { nlopt_destroy(optimizer); }
};
using Optimizer = std::unique_ptr<nlopt_opt_s, Destroy>;

/// The program in NLopt's terms. An iteration is a point at which it asks for the gradient.
class NloptProgram {
 public:
  NloptProgram(VectorView& view, Monitor& monitor, nlopt_opt optimizer)
      : view_(view), monitor_(monitor), optimizer_(optimizer) {}

  int iterations() const { return iterations_; }

  static double Cost(unsigned n, const double* x, double* gradient, void* self) {
    return static_cast<NloptProgram*>(self)->EvaluateCost(n, x, gradient);
  }
  static void Equalities(unsigned m, double* values, unsigned n, const double* x, double* gradient,
                         void* self) {
    static_cast<NloptProgram*>(self)->EvaluateRows(0, m, values, n, x, gradient);
  }
  static void Inequalities(unsigned m, double* values, unsigned n, const double* x, double* gradient,
                           void* self) {
    auto* program = static_cast<NloptProgram*>(self);
    program->EvaluateRows(program->view_.num_equalities(), m, values, n, x, gradient);
  }

 private:
  double EvaluateCost(unsigned n, const double* x, double* gradient) {
    if (gradient != nullptr) {
      if (iterations_ >= monitor_.max_iterations() && !monitor_.ReasonToEnd())
        monitor_.End(Status::kIterationLimit);
      std::fill_n(gradient, n, 0.0);
    }
    if (!At(x, gradient != nullptr)) return HUGE_VAL;
    if (gradient != nullptr) {
      Eigen::VectorXd::Map(gradient, view_.num_variables()) = view_.gradient();
      monitor_.Record(iterations_++, view_, Eigen::VectorXd::Map(x, view_.num_variables()));
    }
    return view_.cost();
  }

  void EvaluateRows(int first, unsigned m, double* values, unsigned n, const double* x, double* gradient) {
    std::fill_n(values, m, 0.0);
    if (gradient != nullptr) std::fill_n(gradient, size_t{m} * n, 0.0);
    if (!At(x, gradient != nullptr)) return;
    Eigen::VectorXd::Map(values, m) = view_.constraints().segment(first, m);
    if (gradient == nullptr) return;
    const std::vector<VectorView::Entry>& entries = view_.jacobian_entries();
    for (size_t k = 0; k < entries.size(); ++k) {
      const int row = entries[k].row - first;
      if (row < 0 || row >= static_cast<int>(m)) continue;
      gradient[static_cast<size_t>(row) * n + static_cast<size_t>(entries[k].column)] =
          view_.jacobian_values()[k];
    }
  }

  bool At(const double* x, bool derivatives) {
    const Stopwatch watch(monitor_.evaluation_s());
    if (!monitor_.ReasonToEnd()) {
      const Eigen::VectorXd point = Eigen::VectorXd::Map(x, view_.num_variables());
      if (derivatives ? view_.EvaluateDerivatives(point) : view_.EvaluateValues(point)) return true;
      monitor_.FailNotFinite(view_.not_finite());
    }
    nlopt_force_stop(optimizer_);
    return false;
  }

  VectorView& view_;
  Monitor& monitor_;
  nlopt_opt optimizer_;
  int iterations_ = 0;
};

constexpr int kMostForSlsqp = 400;  // variables; a step then needs some 50 ms
// The multipliers are only as accurate as the minimum at which they are computed.
constexpr double kInnerTolerance = 1e-2;

}  // namespace

/// See PluginSolve.
extern "C" void TetherSolve(VectorView& view, Monitor& monitor, const Options& options,
                            PluginOutcome& result) {
  // NLopt refuses more equalities than variables. Extra variables that appear nowhere satisfy it.
  const int padded = std::max(view.num_variables(), view.num_equalities());
  const auto n = static_cast<unsigned>(padded);
  const auto pad = [&](const Eigen::VectorXd& values, double fill) {
    Eigen::VectorXd all = Eigen::VectorXd::Constant(padded, fill);
    all.head(values.size()) = values;
    return all;
  };
  const bool constrained = view.num_constraints() > 0;
  const double tolerance = kInnerTolerance * options.cost_tolerance;
  // SLSQP's own steps are dense and can't be interrupted: on large programs one would outlast any limit.
  const bool large = padded > kMostForSlsqp;
  const Optimizer inner(nlopt_create(large ? NLOPT_LD_LBFGS : NLOPT_LD_SLSQP, n));
  const Optimizer outer(nlopt_create(constrained ? NLOPT_LD_AUGLAG
                                     : large     ? NLOPT_LD_LBFGS
                                                 : NLOPT_LD_SLSQP,
                                     n));
  NloptProgram callbacks(view, monitor, outer.get());
  bool accepted = true;
  const auto check = [&](nlopt_result code) { accepted = accepted && code > 0; };
  for (nlopt_opt optimizer : {inner.get(), outer.get()}) {
    check(nlopt_set_ftol_rel(optimizer, tolerance));
    check(nlopt_set_xtol_rel(optimizer, tolerance));
  }
  if (constrained) check(nlopt_set_local_optimizer(outer.get(), inner.get()));
  check(nlopt_set_min_objective(outer.get(), NloptProgram::Cost, &callbacks));
  check(nlopt_set_lower_bounds(outer.get(), pad(view.lower(), -HUGE_VAL).data()));
  check(nlopt_set_upper_bounds(outer.get(), pad(view.upper(), HUGE_VAL).data()));
  check(nlopt_set_maxtime(outer.get(), monitor.SecondsLeft()));
  const std::vector<double> tolerances(view.num_constraints(), options.constraint_tolerance);
  if (view.num_equalities() > 0) {
    check(nlopt_add_equality_mconstraint(outer.get(), static_cast<unsigned>(view.num_equalities()),
                                         NloptProgram::Equalities, &callbacks, tolerances.data()));
  }
  if (view.num_inequalities() > 0) {
    check(nlopt_add_inequality_mconstraint(outer.get(), static_cast<unsigned>(view.num_inequalities()),
                                           NloptProgram::Inequalities, &callbacks, tolerances.data()));
  }
  if (!accepted) {
    result = {Status::kFailed, "NLopt refused the program", 0, view.start()};
    return;
  }

  Eigen::VectorXd x = pad(view.start(), 0);
  double cost = 0;
  const nlopt_result code = nlopt_optimize(outer.get(), x.data(), &cost);
  if (!x.allFinite()) x = pad(view.start(), 0);
  Status status = Status::kFailed;
  std::string message;
  if (code == NLOPT_MAXTIME_REACHED) {
    status = Status::kTimeLimit;
  } else if (code > 0) {
    status = Status::kSolved;
  } else {
    message = std::string("NLopt: ") + nlopt_result_to_string(code);
  }
  result = {status, message, callbacks.iterations(), x.head(view.num_variables())};
}

}  // namespace tether::nlp
