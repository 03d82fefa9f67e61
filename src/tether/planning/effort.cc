#include "tether/planning/effort.h"

namespace tether::planning {

Effort EffortOf(const ProgramOptions& options) {
  if (options.max_iterations) {
    const int most = *options.max_iterations;
    return {most, most, most, most};
  }
  switch (options.backend) {
    case nlp::Backend::kNative:
      break;
    case nlp::Backend::kIpopt:
      return {60, 80, 200, 1000};
    case nlp::Backend::kNlopt:
      return {8'000, 4'000, 16'000, 50'000};
  }
  return {15, 20, 50, 1000};
}

}  // namespace tether::planning
