#pragma once

#include "tether/evaluation/run.h"
#include "tether/planning/plan/report.h"
#include "tether/scenario/scenario.h"

namespace tether::evaluation {

struct PlannedRun {
  planning::PlanReport planning;
  RunReport run;  ///< Of the best plan; not called if there is none.
};

/// Plans and runs a scenario as the command line does, from the start that the options' seed perturbs.
PlannedRun PlanAndRun(const scenario::Scenario& scenario, const RunOptions& options);

}  // namespace tether::evaluation
