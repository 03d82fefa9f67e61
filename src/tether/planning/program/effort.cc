#include "tether/planning/program/effort.h"

namespace tether::planning {
namespace {

// The native solver rarely ends short of a local minimum; the others do so from up to every second start.
constexpr int kMoreStarts = 3;

}  // namespace

Effort EffortOf(const ProgramOptions& options) {
  if (options.max_iterations) {
    const int most = *options.max_iterations;
    return {most, most, most, most, options.backend == nlp::Backend::kNative ? 0 : kMoreStarts};
  }
  switch (options.backend) {
    case nlp::Backend::kNative:
      break;
    case nlp::Backend::kIpopt:
      return {60, 80, 200, 1000, kMoreStarts};
    case nlp::Backend::kNlopt:
      return {8'000, 4'000, 16'000, 50'000, kMoreStarts};
  }
  return {15, 20, 50, 1000};
}

}  // namespace tether::planning
