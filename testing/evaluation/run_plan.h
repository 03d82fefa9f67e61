#pragma once

#include <functional>
#include <string>
#include <vector>

#include "tether/execution/sequencer/executive.h"
#include "tether/planning/plan/plan.h"
#include "tether/scene/scene.h"
#include "tether/sim/world.h"

namespace tether::execution {

/// The outcome of a run, judged by the truth.
struct RunResult {
  ExecutiveStatus status;
  double time = 0;
  std::vector<Event> events;
  std::vector<StepRecord> records;
  int retries = 0;
  scene::WorldEstimate truth;  ///< After the end of the run, when the objects are at rest.

  int Count(EventKind kind) const;
  std::string Log() const;
};

/// Called before each tick.
using Disturbance = std::function<void(sim::World&, const Executive&)>;

/// What scenarios have by default: torques under constraints.
ExecutiveOptions DefaultOptions();

/// Runs the plan in physics until it ends or `limit` seconds have passed.
RunResult RunPlan(const scene::Scene& scene, const planning::Plan& plan, const Disturbance& disturb = {},
                  const ExecutiveOptions& options = DefaultOptions(), double limit = 120);

}  // namespace tether::execution
