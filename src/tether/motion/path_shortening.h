#pragma once

#include <vector>

#include "tether/motion/path_search.h"

namespace tether::motion {

/// Leaves out corners and pieces of a free path where the straight line is free. Deterministic by the
/// problem's seed.
void ShortenPath(const PathProblem& problem, LineChecker& checker, std::vector<Eigen::VectorXd>& path);

/// Replaces corners by two gentler ones where what is cut off is free: after `rounds`, turns are at most a
/// 2^rounds-th, but for those that something is close to.
void SmoothPath(int rounds, LineChecker& checker, std::vector<Eigen::VectorXd>& path);

}  // namespace tether::motion
