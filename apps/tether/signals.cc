#include "apps/tether/signals.h"

#include <signal.h>  // NOLINT: sigaction() and timers are POSIX
#include <time.h>    // NOLINT
#include <unistd.h>

#include "tether/common/file.h"

namespace {

constexpr int kInterrupted = 130;
constexpr long kGraceNs = 300'000'000;
constexpr long kWaitNs = 20'000'000;  // Between looks at whether files are whole.
constexpr int kMostWaits = 500;       // Looks without progress of a file on the disk.
constexpr int kMostStalled = 25;      // Looks without progress of results that nobody reads.

std::atomic<bool> stop_requested{false}, finished{false}, pause_requested{false};
std::atomic<long> first_s{0};
std::atomic<int> waits{0};  // Looks since the last progress of results.
std::atomic<uint64_t> written{0};
std::atomic<bool> has_timer{false};
timer_t timer;

void SetTimer(long nanoseconds) {
  itimerspec spec{};
  spec.it_value.tv_nsec = nanoseconds;
  timer_settime(timer, 0, &spec, nullptr);
}

void End() {
  tether::RemoveUnfinishedFiles();
  if (!finished && !tether::IsReported()) {
    constexpr char kText[] = "interrupted: ended before a report could be written in time\n";
    if (write(STDERR_FILENO, kText, sizeof kText - 1) < 0) _exit(kInterrupted);
  }
  _exit(kInterrupted);
}

extern "C" void EndNow(int) {
  const uint64_t pieces = tether::WritingProgress();
  waits = written.exchange(pieces) == pieces ? waits + 1 : 0;
  const int most = tether::IsWriting() ? kMostWaits : tether::IsReporting() ? kMostStalled : 0;
  if (waits < most && !finished) {
    SetTimer(kWaitNs);
    return;
  }
  End();
}

extern "C" void RequestStop(int) {
  if (finished) _exit(kInterrupted);
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  if (!stop_requested.exchange(true)) {
    first_s = now.tv_sec;
    if (has_timer) SetTimer(kGraceNs);
  } else if (now.tv_sec - first_s > 1) {
    End();
  }
}

extern "C" void RequestPause(int signal) { pause_requested = signal == SIGUSR1; }

void Handle(int signal, void (*handler)(int)) {
  struct sigaction action {};
  action.sa_handler = handler;
  action.sa_flags = SA_RESTART;
  sigaction(signal, &action, nullptr);
}

/// Before the constructors of the shared libraries, which need most of the time until main().
void Install() {
  sigevent event{};
  event.sigev_notify = SIGEV_SIGNAL;
  event.sigev_signo = SIGALRM;
  has_timer = timer_create(CLOCK_MONOTONIC, &event, &timer) == 0;
  Handle(SIGALRM, EndNow);
  Handle(SIGINT, RequestStop);
  Handle(SIGTERM, RequestStop);
  Handle(SIGUSR1, RequestPause);
  Handle(SIGUSR2, RequestPause);
  Handle(SIGXFSZ, SIG_IGN);  // A limit on the size of files is an error of writing, not the end.
}
[[gnu::used, gnu::section(".preinit_array")]] void (*const install_early)() = Install;

}  // namespace

const std::atomic<bool>& StopRequested() { return stop_requested; }
const std::atomic<bool>& PauseRequested() { return pause_requested; }
void FinishSignals() { finished = true; }
