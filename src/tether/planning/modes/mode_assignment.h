#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "tether/planning/plan/limits.h"
#include "tether/planning/program/program_builder.h"

namespace tether::planning {

/// A mode assignment of a skeleton (one option per discrete choice), and what its guess shows.
struct ModeAssignment {
  Variant variant;
  std::vector<ChoicePoint> choices;  ///< That were met, with what was chosen.
  /// Cost of the guess (paper A, eq. (4)), plus a penalty for its distance out of the arm's reach.
  double predicted_cost = 0;
  bool likely_best = true;  ///< Little turning, nothing far out of reach: likely to be the best one.
  std::vector<std::string> refutations;  ///< Why no pose is looked for with these modes; else empty.
  int refuted_action = -1;               ///< This and what follows as in KeyPoseProgram.
  std::string refuted_reason = {};
  bool refuted_proved = false, refuted_anywhere = false, constant_proof = false;
};

/// The mode assignment that a program was built with, judged by the program's guess.
ModeAssignment DescribeModeAssignment(const SceneFacts& facts, const Variant& variant,
                                      const KeyPoseProgram& key_poses);

/// The choices that concern the first `actions` actions.
Variant FirstChoices(const ModeAssignment& modes, size_t actions);

/// The mode assignments that were examined.
struct ModeAssignments {
  std::vector<ModeAssignment> open;     ///< Not refuted, by predicted cost.
  std::vector<ModeAssignment> refuted;  ///< In the order in which they were met.
};

/// Searches the mode assignments, cheapest first: from one to those that differ from it in one choice, with
/// later choices made anew. Examines about `most` of them, and no more once a limit is reached. Ends at once
/// if one is refuted whatever the choices (refuted_action).
ModeAssignments FindModeAssignments(const SceneFacts& facts, const std::vector<BoundStep>& steps, size_t most,
                                    const Limits& limits);

/// The mode assignments that differ from `modes` in one choice and have about the same predicted cost, the
/// cheapest first. Examines only options with a good score.
std::vector<ModeAssignment> FindAlternatives(const SceneFacts& facts, const std::vector<BoundStep>& steps,
                                             const ModeAssignment& modes, const Limits& limits);

}  // namespace tether::planning
