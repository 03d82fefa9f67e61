#pragma once

#include "tether/planning/plan/problem.h"

namespace tether::planning {

/// The most iterations of one solve of a candidate's key poses, in the backend's own unit: steps of the
/// native solver and of IPOPT, evaluations of the gradient by NLopt.
struct Effort {
  int first;            ///< From a way's own guess: what converges does so within that.
  int beginning;        ///< Of the first actions alone.
  int restart;          ///< From another start.
  int again;            ///< Of what was solved before and has moved; and of all rounds of one solve together.
  int more_starts = 0;  ///< Besides ProgramOptions::starts, for what comes to rest where it is not feasible.
};

/// What the problem allows (ProgramOptions::max_iterations), or what the backend needs for what converges.
Effort EffortOf(const ProgramOptions& options);

}  // namespace tether::planning
