#pragma once

#include <array>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "tether/common/random.h"
#include "tether/nlp/program.h"
#include "tether/planning/ik/ik_search.h"
#include "tether/planning/program/clearances.h"
#include "tether/planning/program/step_context.h"
#include "tether/planning/skeleton/skeleton_binding.h"

namespace tether::planning {

/// The arm's joints at one key pose as variables of a program.
struct JointBlock {
  int step;
  int vector;  ///< Index of the block.
  bool far;    ///< Of the far end of the step's approach or retreat.
  /// Pairs that have a row: solid and part of the arm; then, of the scene or of the arm, solid and part.
  std::set<std::array<int, 5>> rows;
};

/// The program of one candidate in one variant (a mode assignment).
struct KeyPoseProgram {
  FrameTree tree;
  nlp::Program program;
  nlp::Point guess;                  ///< One pose per step: of its control frame in its target.
  std::vector<ChoicePoint> choices;  ///< In the order in which they were met.
  /// Why no poses are looked for in this variant; empty if they are.
  std::vector<std::string> refutations;
  /// The action that fails whatever the variant; −1: none.
  int refuted_action = -1;
  /// Of that action: why it fails, whether that is a proof (else it is not modelled), and whether it fails
  /// whatever comes before it.
  std::string refuted_reason = {};
  bool refuted_proved = false, refuted_anywhere = false;
  /// A row is broken by the poses of the start before any choice is met: every mode assignment breaks it.
  bool constant_proof = false;
  std::optional<Clearances> clearances;  ///< Of the program; none if it has no rows.
  /// Per key pose, at the poses of the last solve; empty without an arm.
  std::vector<IkSolution> ik_solutions = {};
  /// Where optimising the poses alone left a key pose without an IK solution: the steps whose joints are
  /// variables of the program.
  std::vector<JointBlock> joints = {};
};

/// Pairs of parts within this of their clearance get a row at once, m.
inline constexpr double kNear = 0.05;

/// How the start of a program differs from the plain one.
struct ProgramStart {
  double noise = 0;    ///< Random displacement of the guess: 1 is about 12 cm and 0.2 rad.
  bool tight = false;  ///< Carried objects keep only the hand's clearance.
  Random random{0};    ///< What the displacement is drawn from.
  std::vector<math::Pose> beginning = {};  ///< Key poses of so many first steps, in place of guesses.
  /// Key poses of some steps, by their index, in place of guesses.
  std::map<int, math::Pose> placed = {};
  /// Pairs of parts that are further apart than their clearance by this much at the guess get no row, m.
  double near = std::numeric_limits<double>::infinity();
  bool guess_only = false;  ///< The guess, the choices and the refutations, but no rows.
};

/// Builds paper A's program (3)–(5) for a bound skeleton: variables are the poses of each step's control
/// frame in its target; the cost is (4); rows come from the steps' constraints, from every near pair of
/// solids (17), and from the arm's reach.
KeyPoseProgram BuildProgram(const SceneFacts& facts, const std::vector<BoundStep>& steps,
                            const Variant& variant = {}, const ProgramStart& start = {});

/// If a pair without a row is nearer than its clearance at `poses`, adds rows for all pairs that are within
/// `near` of theirs, makes `poses` the guess, and returns true.
bool AddMissingClearances(const SceneFacts& facts, const std::vector<BoundStep>& steps,
                          const std::vector<math::Pose>& poses, double near, KeyPoseProgram& key_poses);

}  // namespace tether::planning
