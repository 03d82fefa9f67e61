#pragma once

#include <map>
#include <string>
#include <vector>

#include "tether/common/random.h"
#include "tether/nlp/program.h"
#include "tether/planning/skeleton_binding.h"
#include "tether/planning/step_context.h"

namespace tether::planning {

/// The program of one candidate in one variant (a way to make its discrete choices).
struct KeyPoseProgram {
  FrameTree tree;
  nlp::Program program;
  nlp::Point guess;                      ///< One pose per step: of its control frame in its target.
  std::vector<ChoicePoint> choices;      ///< In the order in which they were met.
  std::vector<std::string> refutations;  ///< Why no pose can do; empty unless proved impossible.
  /// The first action that is impossible after those before it, whatever the variant; −1: none.
  int refuted_action = -1;
};

/// Which way to take at each choice, by its key; the best one where a key is missing.
using Variant = std::map<std::string, int>;

/// How the start of a program differs from the plain one.
struct ProgramStart {
  double noise = 0;    ///< Random displacement of the guess: 1 is about 12 cm and 0.2 rad.
  bool tight = false;  ///< Carried objects need to keep only the hand's clearance.
  Random random{0};    ///< What the displacement is drawn from.
};

/// Builds paper A's program (3)–(5) for a bound skeleton: variables are the poses of each step's control
/// frame in its target; the cost is (4); rows come from the steps' constraints, from every near pair of
/// solids (17), and from the arm's reach.
KeyPoseProgram BuildProgram(const SceneFacts& facts, const std::vector<BoundStep>& steps,
                            const Variant& variant = {}, const ProgramStart& start = {});

/// What moves at a step: the control frame, everything that hangs on it, and the hand.
std::vector<std::string> MovedSolids(const SceneFacts& facts, const FrameTree& tree,
                                     const std::string& control, int step);

}  // namespace tether::planning
