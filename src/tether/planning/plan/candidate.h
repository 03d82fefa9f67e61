#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "tether/planning/replan/optimum.h"

namespace tether::planning {

/// The outcome of a candidate, and what the task search can learn from it.
struct Verdict {
  CandidateReport report;
  /// This many of its first actions fail already, whatever comes after them; 0: not known.
  size_t failing_actions = 0;
  bool failing_anywhere = false;  ///< The last of these fails by itself, whatever comes before it.
  /// If not empty, the last of these fails as long as nothing moves one of these objects.
  std::vector<FrameId> unmoved;
  std::shared_ptr<Optimum>
      optimum;  ///< Of a feasible one, the optimum, ready to be optimised again; else null.
};

/// Optimises the key poses of one candidate. Its mode assignments are tried in the order of their scores, but
/// where the first ones turn the hand much or are out of reach, several are compared by the cost of their
/// guesses. The first that the checker accepts counts, unless another has a lower predicted cost. If none is
/// accepted from its guess, the best ones get other starts; if that fails too, the shortest failing prefix of
/// the actions is determined.
///
/// `index` is the candidate's number, for the log. Random starts are the same for all candidates, so the
/// result does not depend on the other candidates.
Verdict OptimizeCandidate(const SceneFacts& facts, const Skeleton& skeleton, int index, const Limits& limits);
/// The same for actions that are bound here. Throws InputError as SkeletonBinder::Bind().
Verdict OptimizeCandidate(const SceneFacts& facts, const std::vector<std::string>& actions, int index,
                          const Limits& limits);

}  // namespace tether::planning
