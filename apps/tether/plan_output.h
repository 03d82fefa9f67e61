#pragma once

#include <cstdint>
#include <string>

#include "tether/common/document/value.h"
#include "apps/tether/terminal.h"
#include "tether/planning/plan/report.h"

namespace tether::app {

/// {format, tether, seed}: how every output begins.
Value OutputHeader(const std::string& format, uint64_t seed);

/// The report of `tether plan` in format `tether.plan_report/1`. Times in s, lengths in m, angles in rad.
Value WritePlanReport(const planning::PlanReport& report, const std::string& scenario, uint64_t seed);

/// Cost and violation per iteration of every candidate, format `tether.trace/1` (Paper A, Fig. 5).
Value WriteTrace(const planning::PlanReport& report, uint64_t seed);

/// One line for a candidate as it is found, `number` counting from 1.
std::string CandidateLine(const planning::CandidateReport& candidate, int number, const Terminal& terminal);

/// The table of all candidates, best first, and how planning ended.
std::string PlanTable(const planning::PlanReport& report, const Terminal& terminal);

}  // namespace tether::app
