#pragma once

#include <string>

#include "tether/evaluation/log/run_log.h"

namespace tether::evaluation {

/// A logged run as a page: how it ended and why, goal, plan, margins, what happened, and the figure.
std::string WriteRunPage(const RunLog& log);

}  // namespace tether::evaluation
