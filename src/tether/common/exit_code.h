#pragma once

namespace tether {

/// Exit codes of the program.
enum ExitCode {
  kExitSuccess = 0,
  kExitInternal = 1,
  kExitBadInput = 2,
  kExitImpossible = 3,
  kExitGaveUp = 4,
  kExitFailed = 5,
  kExitInterrupted = 130,
};

}  // namespace tether
