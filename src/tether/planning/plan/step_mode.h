#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace tether::planning {

/// What a step of a plan does with its control frame.
enum class StepMode {
  kFree,    ///< The hand, or what it holds, is brought somewhere.
  kGrasp,   ///< The hand is brought to its target, and closes on an object.
  kPlace,   ///< What is held is brought to its target, and released.
  kPush,    ///< What is not held is moved by a tool: what the hand holds, or the hand.
  kRegion,  ///< Brought anywhere into a region, or above it.
};

/// "free", "grasp", "place", "push", "region": the mode's name in files.
std::string_view ToString(StepMode mode);
std::optional<StepMode> FindStepMode(std::string_view name);
std::vector<std::string> StepModeNames();

struct Plan;

/// Says of each step of a plan what it is: its mode, what is held, by which step, and what pushes. Follows
/// from what the steps' verbs close on; done once, when a plan is made or read.
void SetModes(Plan* plan);

}  // namespace tether::planning
