#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "tether/planning/optimum.h"

namespace tether::planning {

/// What became of a candidate, and what the task search can learn from it.
struct Verdict {
  CandidateReport report;
  /// So many of its first actions fail already, whatever comes after them; 0: that is not known.
  size_t failing_actions = 0;
  std::shared_ptr<Optimum> optimum;  ///< What a feasible one is, ready to be optimised again; else null.
};

/// Optimises one candidate over its key poses: its variants in the order of their scores, each from a few
/// starts until the checker accepts one. While turning the hand is much of the cost, a few more variants are
/// tried, and the cheapest result counts. If none is accepted, finds out which first actions fail already.
///
/// `index` is the candidate's number and seeds its random starts.
Verdict OptimizeCandidate(const SceneFacts& facts, const std::vector<std::string>& actions, int index,
                          const Limits& limits);

}  // namespace tether::planning
