#include "tether/motion/path_shortening.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "tether/common/random.h"

namespace tether::motion {
namespace {

using Eigen::VectorXd;

// Pieces that would save less than this share are not worth a check.
constexpr double kLeastGain = 0.02;
// A corner is cut at this share of the shorter of its two sides.
constexpr double kCut = 0.25;

/// From each corner on to the furthest that a free line leads to.
void SkipCorners(LineChecker& checker, std::vector<VectorXd>& path) {
  std::vector<VectorXd> kept{path.front()};
  for (size_t i = 0; i + 1 < path.size();) {
    size_t next = path.size() - 1;
    while (next > i + 1 && !checker.IsFree(path[i], path[next])) --next;
    kept.push_back(path[next]);
    i = next;
  }
  path = std::move(kept);
}

/// A place on a path: on the line from corner `corner` on.
struct Place {
  size_t corner = 0;
  VectorXd q;
};

Place At(const std::vector<VectorXd>& path, double along) {
  for (size_t i = 0; i + 1 < path.size(); ++i) {
    const double length = (path[i + 1] - path[i]).norm();
    if (along <= length && length > 0) return {i, path[i] + (path[i + 1] - path[i]) * (along / length)};
    along -= length;
  }
  return {path.size() - 2, path.back()};
}

}  // namespace

void ShortenPath(const PathProblem& problem, LineChecker& checker, std::vector<VectorXd>& path) {
  SkipCorners(checker, path);
  Random random = Random(problem.seed).Split("shortcuts");
  for (int i = 0; i < problem.shortcuts && path.size() > 2; ++i) {
    const double length = PathLength(path);
    double from = random.Uniform(0, length), to = random.Uniform(0, length);
    if (from > to) std::swap(from, to);
    const Place a = At(path, from), b = At(path, to);
    if (a.corner == b.corner || (to - from) - (b.q - a.q).norm() < kLeastGain * length) continue;
    if (!checker.IsFree(a.q, b.q)) continue;
    std::vector<VectorXd> shorter(path.begin(), path.begin() + static_cast<std::ptrdiff_t>(a.corner) + 1);
    shorter.push_back(a.q);
    shorter.push_back(b.q);
    shorter.insert(shorter.end(), path.begin() + static_cast<std::ptrdiff_t>(b.corner) + 1, path.end());
    path = std::move(shorter);
  }
}

void SmoothPath(int rounds, LineChecker& checker, std::vector<VectorXd>& path) {
  for (int round = 0; round < rounds; ++round) {
    std::vector<VectorXd> smooth{path.front()};
    for (size_t i = 1; i + 1 < path.size(); ++i) {
      const VectorXd before = path[i - 1] - path[i], after = path[i + 1] - path[i];
      const double cut = kCut * std::min(before.norm(), after.norm());
      const VectorXd a = path[i] + before.normalized() * cut, b = path[i] + after.normalized() * cut;
      if (cut > 0 && checker.IsFree(a, b)) {
        smooth.push_back(a);
        smooth.push_back(b);
      } else {
        smooth.push_back(path[i]);
      }
    }
    smooth.push_back(path.back());
    path = std::move(smooth);
  }
}

}  // namespace tether::motion
