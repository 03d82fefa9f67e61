#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "tether/common/document/value.h"
#include "tether/planning/plan/plan.h"
#include "tether/planning/skeleton/action.h"
#include "tether/scene/scene.h"

namespace tether::planning {

/// The `format` of a plan file.
inline constexpr const char* kPlanFormat = "tether.plan/1";

/// The origin of a plan, as its file gives it.
struct PlanOrigin {
  std::string tether;  ///< Version and build that made it.
  uint64_t seed = 0;
  std::string scenario_file;  ///< The scenario it was made for; may be empty.
};

/// What a plan and the scenario that it is used with must agree on: names and shapes of objects and regions,
/// robots and their models, actions. Poses, masses and friction may differ: the plan is tied to objects, not
/// to places.
Value Fingerprint(const scene::Scene& scene, const std::vector<ActionSchema>& actions);

/// One key pose: action, action_index, control, target, position (m) and quaternion_wxyz of control in
/// target; with its verbs under `execute` if asked for.
Value WriteStep(const PlanStep& step, bool with_execution);

/// The plan as a document in format `tether.plan/1`.
Value WritePlan(const Plan& plan, const PlanOrigin& origin, const scene::Scene& scene,
                const std::vector<ActionSchema>& actions);

/// Reads the origin of a plan file, for which its scenario is not needed.
PlanOrigin ReadPlanOrigin(const Value& document);

/// Reads a plan that is to be used with this scene and these actions. Mistakes go to `diagnostics` with their
/// places, among them each thing in which the scene differs from the one that the plan was made for.
Plan ParsePlan(const Value& document, const scene::Scene& scene, const std::vector<ActionSchema>& actions,
               Diagnostics& diagnostics);

/// The same for a file. Throws InputError with all its mistakes, or if it can't be read.
Plan ReadPlan(const std::string& path, const scene::Scene& scene, const std::vector<ActionSchema>& actions);

}  // namespace tether::planning
