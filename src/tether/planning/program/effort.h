#pragma once

#include "tether/planning/plan/problem.h"

namespace tether::planning {

/// The most iterations of one solve of a candidate's key poses, in the backend's own unit: steps of the
/// native solver and of IPOPT, evaluations of the gradient by NLopt.
struct Effort {
  int first;      ///< From a mode assignment's own guess: solves that converge do so within this.
  int beginning;  ///< Of the first actions alone.
  int restart;    ///< From another start.
  int again;      ///< Of a warm start after objects have moved; and of all rounds of one solve together.
  int more_starts =
      0;  ///< Besides ProgramOptions::starts, after solves that end in an infeasible local minimum.
};

/// ProgramOptions::max_iterations where it is set, else what the backend needs to converge.
Effort EffortOf(const ProgramOptions& options);

}  // namespace tether::planning
