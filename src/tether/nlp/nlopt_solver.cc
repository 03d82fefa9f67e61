#include <cmath>
#include <exception>
#include <limits>

#include <nlopt.hpp>

#include "tether/nlp/backends.h"

namespace tether::nlp {
namespace {

/// What NLopt's callbacks see.
struct Callbacks {
  VectorView& view;
  Monitor& monitor;
  nlopt::opt* inner;
};

class NloptSolver : public Solver {
 public:
  Result Solve(const Program& program, const Point& guess, const Options& options) const override {
    options.Validate();
    if (std::optional<Result> trivial = SolveTrivial(program, guess, options)) return *trivial;
    Monitor monitor(program, options);
    return monitor.Finish(guess, Status::kFailed, "", 0, 0);
  }
};

}  // namespace

std::unique_ptr<Solver> MakeNloptSolver() { return std::make_unique<NloptSolver>(); }

}  // namespace tether::nlp
