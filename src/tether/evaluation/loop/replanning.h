#pragma once

#include <atomic>
#include <memory>

#include "tether/execution/monitor/replanning.h"
#include "tether/scenario/scenario.h"

namespace tether::evaluation {

/// Plans for the goal of the scenario's PDDL problem from an observed state: poses and joints are the
/// requested ones, and so is the initial state; what `within_reach` names is worked out anew. The scenario
/// and the scene must outlive what is returned. `stop` may be null.
execution::PlanAnew MakePlanAnew(const scenario::Scenario& scenario, const scene::Scene& scene,
                                 const std::atomic<bool>* stop);

}  // namespace tether::evaluation
