#pragma once

#include <vector>

#include "tether/evaluation/margins/margins.h"
#include "tether/evaluation/margins/torque_margins.h"
#include "tether/evaluation/margins/vacate.h"
#include "tether/execution/sequencer/plan_runner.h"
#include "tether/scenario/scenario.h"
#include "tether/sim/world.h"

namespace tether::evaluation {

/// Everything that is measured of a run while its plan is executed, from the simulation's true state and at
/// the control rate: margins of constraints and limits, of torques, and unintended forces.
class RunMargins {
 public:
  RunMargins(const scenario::Scenario& scenario, const scene::Scene& scene,
             const execution::PlanRunner& runner, double period);

  void Observe(const sim::World& world, const scene::WorldEstimate& truth,
               const robot::Observations& observations, const robot::Commands& commands,
               const execution::PlanRunner& runner);
  /// All margins, those of torques first; verbs' own constraints are added at the end as they begin.
  const std::vector<Margin>& margins();
  /// Begins a new interval of the log: the margins' `last` is the least within it.
  void ForgetLast();
  const ForceSummary& forces() const { return torques_.forces(); }

 private:
  void FindUnintended(const sim::World& world, const execution::PlanRunner& runner);

  scene::Scene scene_;
  std::string robot_;
  bool uses_torques_;
  MarginMonitor monitor_;
  TorqueMargins torques_;
  VacateMonitor vacate_;
  std::vector<PairForce> unintended_;
  std::vector<Margin> all_;
};

}  // namespace tether::evaluation
