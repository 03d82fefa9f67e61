#include "tether/planning/plan/step_mode.h"

#include <array>
#include <utility>
#include <variant>

#include "tether/planning/plan/plan.h"

namespace tether::planning {
namespace {

constexpr const char* kHand = "hand";
constexpr std::array<std::pair<StepMode, std::string_view>, 5> kNames = {{
    {StepMode::kFree, "free"},
    {StepMode::kGrasp, "grasp"},
    {StepMode::kPlace, "place"},
    {StepMode::kPush, "push"},
    {StepMode::kRegion, "region"},
}};

/// What the verbs of a step do with the gripper: the last object that it closes on, and whether it opens.
struct Gripping {
  std::string closes_on;
  bool opens = false;
  bool changes = false;
};

Gripping GrippingOf(const PlanStep& step) {
  Gripping gripping;
  for (const Verb& verb : step.execute) {
    const auto* gripper = std::get_if<GripperVerb>(&verb);
    if (gripper == nullptr) continue;
    gripping.changes = true;
    gripping.closes_on = gripper->close_on;
    gripping.opens = gripping.opens || gripper->close_on.empty();
  }
  return gripping;
}

StepMode ModeOf(const PlanStep& step, const Gripping& gripping) {
  if (step.target_is_region) return StepMode::kRegion;
  if (step.control != kHand && step.control != step.held) return StepMode::kPush;
  if (!gripping.closes_on.empty()) return StepMode::kGrasp;
  if (step.control == step.held && !step.held.empty() && gripping.opens) return StepMode::kPlace;
  return StepMode::kFree;
}

}  // namespace

std::string_view ToString(StepMode mode) {
  for (const auto& [one, name] : kNames) {
    if (one == mode) return name;
  }
  return "unknown";
}

std::optional<StepMode> FindStepMode(std::string_view name) {
  for (const auto& [mode, known] : kNames) {
    if (known == name) return mode;
  }
  return std::nullopt;
}

std::vector<std::string> StepModeNames() {
  std::vector<std::string> names;
  for (const auto& entry : kNames) names.emplace_back(entry.second);
  return names;
}

void SetModes(Plan* plan) {
  std::string held = plan->held;
  int grasp_step = -1;
  for (size_t i = 0; i < plan->steps.size(); ++i) {
    PlanStep& step = plan->steps[i];
    const Gripping gripping = GrippingOf(step);
    step.held = held;
    step.grasp_step = grasp_step;
    step.mode = ModeOf(step, gripping);
    step.tool = step.control;
    step.X_CTool.reset();
    if (step.mode == StepMode::kPush) {
      step.tool = held.empty() ? std::string(kHand) : held;
      // Where the tool touches what it pushes is the key pose of the latest step that brought it there.
      for (size_t j = i; j-- > 0 && !step.X_CTool;) {
        const PlanStep& before = plan->steps[j];
        if (before.control == step.tool && before.target == step.control) step.X_CTool = before.X_TC;
      }
    }
    if (!gripping.changes) continue;
    held = gripping.closes_on;
    grasp_step = held.empty() ? -1 : static_cast<int>(i);
  }
}

}  // namespace tether::planning
