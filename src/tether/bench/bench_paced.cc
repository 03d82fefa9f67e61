#include "tether/bench/bench_paced.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <csignal>
#include <thread>

#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include "tether/bench/bench_tick.h"

namespace tether::bench {
namespace {

using Clock = std::chrono::steady_clock;

constexpr double kPeriod = 0.001;  // s

/// A process that does nothing but compute, until this is gone.
class BusyProcess {
 public:
  BusyProcess() : process_(fork()) {
    if (process_ != 0) return;
    // It ends with the process that started it, whatever ends that.
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    volatile double x = 1;
    for (;;) x = std::sqrt(x + 1);
  }
  ~BusyProcess() {
    if (process_ <= 0) return;
    kill(process_, SIGKILL);
    waitpid(process_, nullptr, 0);
  }
  BusyProcess(const BusyProcess&) = delete;
  BusyProcess& operator=(const BusyProcess&) = delete;
  bool runs() const { return process_ > 0; }

 private:
  pid_t process_;
};

}  // namespace

PacedBench BenchmarkPaced(PacedBench bench) {
  BusyProcess load;
  bench.loaded = load.runs() && std::thread::hardware_concurrency() > 1;
  const auto period = std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(kPeriod));
  Clock::time_point due = Clock::now() + period, began;
  const auto seconds = [](Clock::duration d) { return std::chrono::duration<double>(d).count(); };
  TickHooks hooks;
  hooks.begin = [&] {
    std::this_thread::sleep_until(due);
    began = Clock::now();
    bench.latest_start = std::max(bench.latest_start, seconds(began - due));
  };
  hooks.end = [&] {
    const Clock::time_point now = Clock::now();
    bench.longest = std::max(bench.longest, seconds(now - began));
    ++bench.ticks;
    due += period;
    if (now > due) ++bench.over;
  };
  BenchmarkTorqueTicks(bench.robot, BenchRegion::kRectangle, static_cast<int>(bench.seconds / kPeriod), 1,
                       hooks);
  return bench;
}

Value WritePacedBench(const PacedBench& bench) {
  return Value::Object()
      .Set("robot", bench.robot)
      .Set("seconds", bench.seconds)
      .Set("loaded", bench.loaded)
      .Set("ticks", bench.ticks)
      .Set("over", bench.over)
      .Set("share_over", bench.share_over())
      .Set("latest_start_s", bench.latest_start)
      .Set("longest_s", bench.longest);
}

}  // namespace tether::bench
