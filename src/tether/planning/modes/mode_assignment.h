#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "tether/planning/plan/limits.h"
#include "tether/planning/program/program_builder.h"

namespace tether::planning {

/// A way to make a skeleton's discrete choices, and what its guess says of it.
struct ModeAssignment {
  Variant variant;
  std::vector<ChoicePoint> choices;  ///< That were met, with what was chosen.
  /// What the guess costs (paper A, eq. (4)), and a charge for how far it is out of the arm's reach.
  double predicted_cost = 0;
  bool likely_best = true;  ///< Little turning, nothing far out of reach: likely to be the best way.
  std::vector<std::string> refutations;  ///< Why no pose is looked for in this way; else empty.
  int refuted_action = -1;               ///< This and what follows as in KeyPoseProgram.
  std::string refuted_reason = {};
  bool refuted_proved = false, refuted_anywhere = false, constant_proof = false;
};

/// What the guess of a program says of the way that it was built in.
ModeAssignment DescribeModeAssignment(const SceneFacts& facts, const Variant& variant,
                                      const KeyPoseProgram& key_poses);

/// The part of the way that the first `actions` actions see.
Variant FirstChoices(const ModeAssignment& way, size_t actions);

/// The ways that were looked at.
struct ModeAssignments {
  std::vector<ModeAssignment> open;     ///< Not refuted, the most promising first.
  std::vector<ModeAssignment> refuted;  ///< In the order in which they were met.
};

/// Searches among the ways, best first: from one way to those that differ from it in one choice, later
/// choices being made anew from there. Looks at about `most` ways, and at no more once a limit is reached.
/// Ends at once if a way is refuted whatever the choices (refuted_action).
ModeAssignments FindModeAssignments(const SceneFacts& facts, const std::vector<BoundStep>& steps, size_t most,
                                    const Limits& limits);

/// The ways that differ from `way` in one choice and promise about as much, the most promising first. Looks
/// at those options only whose score says that they might.
std::vector<ModeAssignment> FindAlternatives(const SceneFacts& facts, const std::vector<BoundStep>& steps,
                                             const ModeAssignment& way, const Limits& limits);

}  // namespace tether::planning
