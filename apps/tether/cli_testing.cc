#include "apps/tether/cli_testing.h"

#include <sys/wait.h>

#include <cstdio>

namespace tether {

Outcome Tether(const std::string& arguments, const std::string& prefix) {
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

}  // namespace tether
