#include "tether/bench/process_time.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <ctime>

#include <fcntl.h>
#include <spawn.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include "tether/common/error.h"

namespace tether::bench {
namespace {

double Read(clockid_t clock) {
  timespec now;
  clock_gettime(clock, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

double Seconds(const timeval& time) {
  return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
}

}  // namespace

double Quantile(std::vector<double> values, double share) {
  if (values.empty()) return 0;
  const double rank = std::max(1.0, std::ceil(share * static_cast<double>(values.size())));
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(rank) - 1;
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

Spread SpreadOf(std::vector<double> values) { return {Quantile(values, 0.5), Quantile(values, 0.99)}; }

Stopwatch::Stopwatch() : wall_begin_(Read(CLOCK_MONOTONIC)), cpu_begin_(Read(CLOCK_THREAD_CPUTIME_ID)) {}

double Stopwatch::wall_s() const { return Read(CLOCK_MONOTONIC) - wall_begin_; }

double Stopwatch::cpu_s() const { return Read(CLOCK_THREAD_CPUTIME_ID) - cpu_begin_; }

int TimeProcess(const std::vector<std::string>& command, Samples& samples) {
  std::vector<char*> arguments;
  for (const std::string& word : command) arguments.push_back(const_cast<char*>(word.c_str()));
  arguments.push_back(nullptr);
  posix_spawn_file_actions_t silence;
  posix_spawn_file_actions_init(&silence);
  for (int stream : {STDOUT_FILENO, STDERR_FILENO})
    posix_spawn_file_actions_addopen(&silence, stream, "/dev/null", O_WRONLY, 0);
  const Stopwatch watch;
  pid_t child = 0;
  const int error = posix_spawnp(&child, arguments[0], &silence, nullptr, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&silence);
  if (error != 0) throw InputError("cannot run " + command.front(), std::strerror(error));
  int status = 0;
  rusage usage{};
  while (wait4(child, &status, 0, &usage) < 0 && errno == EINTR) {
  }
  samples.Add(watch.wall_s(), Seconds(usage.ru_utime) + Seconds(usage.ru_stime));
  return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

}  // namespace tether::bench
