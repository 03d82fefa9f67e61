#pragma once

#include <string>

#include "apps/tether/terminal.h"
#include "tether/planning/plan/report.h"

namespace tether::app {

/// One line for a candidate as it is found, `number` counting from 1.
std::string CandidateLine(const planning::CandidateReport& candidate, int number, const Terminal& terminal);

/// The table of all candidates, best first, and how planning ended.
std::string PlanTable(const planning::PlanReport& report, const Terminal& terminal);

}  // namespace tether::app
