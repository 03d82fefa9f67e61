#pragma once

#include <vector>

#include "tether/planning/program/program_builder.h"

namespace tether::planning {

/// Key poses are to be taken by an arm, with joints as evidence.
bool NeedsIkSolutions(const Problem& problem);

/// Finds the arm's configurations at the key poses that `x` is, and keeps them in `key_poses.witnesses`.
/// Without an arm it does nothing.
void FindIkSolutions(const SceneFacts& facts, const std::vector<BoundStep>& steps, const nlp::Point& x,
                     KeyPoseProgram& key_poses);

/// The same. Where a key pose has none, the joints there become variables of the program: the hand that they
/// give is where the key pose has it, and links that are near something are kept clear. True if rows were
/// added: `x`, with the best joints that were met, is then the guess.
bool AddMissingIkSolutions(const SceneFacts& facts, const std::vector<BoundStep>& steps, const nlp::Point& x,
                           KeyPoseProgram& key_poses);

/// Every key pose has a witness, and the ways to and from it are free, or there is no arm to ask for one.
bool AllHaveIkSolutions(const SceneFacts& facts, const KeyPoseProgram& key_poses);

}  // namespace tether::planning
