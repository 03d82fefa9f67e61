#pragma once

#include <sys/wait.h>

#include <cstdio>
#include <string>

#include "tether/common/file.h"
#include "tether/common/scratch_folder.h"

namespace tether {

inline const std::string kSource = TETHER_SOURCE_DIR;

struct Outcome {
  int exit_code = -1;
  std::string out;
  std::string err;
};

/// Runs the program with these arguments, as a user would.
inline Outcome Tether(const std::string& arguments, const std::string& prefix = "") {
  const ScratchFolder folder;
  const std::string err_file = folder.File("stderr");
  const std::string line = prefix + " '" + TETHER_BINARY + "' " + arguments + " 2>'" + err_file + "'";
  Outcome outcome;
  std::FILE* pipe = popen(line.c_str(), "r");
  char buffer[4096];
  for (size_t count; (count = std::fread(buffer, 1, sizeof buffer, pipe)) > 0;)
    outcome.out.append(buffer, count);
  const int status = pclose(pipe);
  outcome.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
  outcome.err = ReadFile(err_file);
  return outcome;
}

inline std::string Scenario(const std::string& name) {
  return "'" + kSource + "/scenarios/" + name + ".yaml'";
}

}  // namespace tether
