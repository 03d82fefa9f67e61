#pragma once

#include <string>

#include "tether/evaluation/check.h"
#include "tether/evaluation/judge.h"
#include "tether/evaluation/log/run_log.h"

namespace tether::evaluation {

/// Judges the goal of a logged run again, from the poses and contacts in its samples and the scenario in it:
/// by the same rules as a run, which reads every tick, while a log has twenty samples a second and one at
/// each change. Throws InputError if the scenario in the log can't be read.
Judgement JudgeLog(const RunLog& log);

/// Judges a logged run: it must have reached its goal, by its samples and by its own report, and the log must
/// hold the run to its end. Throws InputError as ReadRunLog() and JudgeLog() do.
void CheckRunLog(const std::string& file, FileCheck& check);

}  // namespace tether::evaluation
