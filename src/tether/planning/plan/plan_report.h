#pragma once

#include <cstdint>
#include <string>

#include "tether/common/document/value.h"
#include "tether/planning/plan/report.h"

namespace tether::planning {

/// The report of `tether plan` in format `tether.plan_report/1`. Times in s, lengths in m, angles in rad.
Value WritePlanReport(const PlanReport& report, const std::string& scenario, uint64_t seed);

/// Cost and violation per iteration of every candidate, format `tether.trace/1` (Paper A, Fig. 5).
Value WriteTrace(const PlanReport& report, uint64_t seed);

}  // namespace tether::planning
