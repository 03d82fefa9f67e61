#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "tether/planning/replan/optimum.h"

namespace tether::planning {

/// What became of a candidate, and what the task search can learn from it.
struct Verdict {
  CandidateReport report;
  /// So many of its first actions fail already, whatever comes after them; 0: that is not known.
  size_t failing_actions = 0;
  bool failing_anywhere = false;  ///< The last of these fails by itself, whatever comes before it.
  /// If not empty, the last of these fails as long as nothing moves one of these objects.
  std::vector<std::string> unmoved;
  std::shared_ptr<Optimum> optimum;  ///< What a feasible one is, ready to be optimised again; else null.
};

/// Optimises one candidate over its key poses. Ways to make its discrete choices are tried in the order of
/// their scores, but where the first ones turn the hand much or are out of reach, several are compared by
/// what their guesses cost. The first that the checker accepts counts, unless another promises to cost less.
/// If none is accepted from its guess, the most promising ones get other starts; if that fails too, it is
/// found out which first actions fail already.
///
/// `index` is the candidate's number, for the log. Random starts are the same for all candidates: which other
/// candidates there are changes nothing.
Verdict OptimizeCandidate(const SceneFacts& facts, const std::vector<std::string>& actions, int index,
                          const Limits& limits);

}  // namespace tether::planning
