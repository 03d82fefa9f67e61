#pragma once

#include <string>

#include "testing/common/scratch_folder.h"
#include "tether/common/file.h"

namespace tether {

inline const std::string kSource = TETHER_SOURCE_DIR;

struct Outcome {
  int exit_code = -1;
  std::string out;
  std::string err;
};

/// Runs the program with these arguments, as a user would.
Outcome Tether(const std::string& arguments, const std::string& prefix = "");

inline std::string Scenario(const std::string& name) {
  return "'" + kSource + "/scenarios/" + name + ".yaml'";
}

}  // namespace tether
