#pragma once

#include <vector>

#include "tether/planning/program/program_builder.h"

namespace tether::planning {

/// Whether key poses need IK solutions: the problem has an arm that constrains the plan.
bool NeedsIkSolutions(const Problem& problem);

/// Finds IK solutions for the key poses `x`, and stores them in `key_poses.ik_solutions`. Without an arm it
/// does nothing.
void FindIkSolutions(const SceneFacts& facts, const std::vector<BoundStep>& steps, const nlp::Point& x,
                     KeyPoseProgram& key_poses);

/// The same. Where a key pose has none, its joints become variables of the program, with rows for the hand's
/// pose and for the clearance of links that are near something. True if rows were added: the guess is then
/// `x` with the best joints found.
bool AddMissingIkSolutions(const SceneFacts& facts, const std::vector<BoundStep>& steps, const nlp::Point& x,
                           KeyPoseProgram& key_poses);

/// Every key pose has an IK solution with free approach and retreat, or none is needed.
bool AllHaveIkSolutions(const SceneFacts& facts, const KeyPoseProgram& key_poses);

}  // namespace tether::planning
