#include "tether/common/limits.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <cmath>

namespace tether {
namespace {

using Clock = std::chrono::steady_clock;

constexpr Clock::duration kBetweenLooksAtMemory = std::chrono::milliseconds(2);

/// The memory in use at the last look.
size_t RecentMemoryInUse(Clock::time_point now) {
  static std::atomic<Clock::rep> looked{0};
  static std::atomic<size_t> in_use{0};
  const Clock::rep ticks = now.time_since_epoch().count();
  if (const Clock::rep last = looked.load(); last == 0 || ticks - last >= kBetweenLooksAtMemory.count()) {
    in_use = MemoryInUse();
    looked = ticks;
  }
  return in_use;
}

thread_local const Limits* scope_limits = nullptr;
thread_local uint32_t scope_ticks = 0;

}  // namespace

LimitsScope::LimitsScope(const Limits& limits) : before_(scope_limits) { scope_limits = &limits; }
LimitsScope::~LimitsScope() { scope_limits = before_; }

void PollLimits() {
  if (scope_limits != nullptr && ++scope_ticks % 64 == 0) scope_limits->Poll();
}

void PollLimitsNow() {
  if (scope_limits != nullptr) scope_limits->Poll();
}

std::string_view Describe(Limit limit) {
  switch (limit) {
    case Limit::kTime:
      return "the time limit was reached";
    case Limit::kMemory:
      return "the memory limit was reached";
    case Limit::kInterrupted:
      return "interrupted";
  }
  return "";
}

size_t MemoryInUse() {
  static const int file = open("/proc/self/statm", O_RDONLY | O_CLOEXEC);
  static const auto page = static_cast<size_t>(sysconf(_SC_PAGESIZE));
  char text[128];
  const ssize_t length = file < 0 ? -1 : pread(file, text, sizeof text, 0);
  if (length <= 0) return 0;
  // "total resident …", in pages.
  const char* const end = text + length;
  const char* at = std::find(static_cast<const char*>(text), end, ' ');
  size_t pages = 0;
  if (at != end) std::from_chars(at + 1, end, pages);
  return pages * page;
}

void Limits::SetTimeLimit(double seconds) {
  deadline.reset();
  if (seconds <= 0) return;
  constexpr double kForever = 1e9;  // More would overflow the clock's ticks.
  deadline = Clock::now() + std::chrono::duration_cast<Clock::duration>(
                                std::chrono::duration<double>(std::min(seconds, kForever)));
}

std::optional<Limit> Limits::Reached() const {
  if (interruption_requested()) return Limit::kInterrupted;
  if (!deadline && memory == 0) return std::nullopt;
  const Clock::time_point now = Clock::now();
  if (deadline && now >= *deadline) return Limit::kTime;
  if (memory > 0 && RecentMemoryInUse(now) > memory) return Limit::kMemory;
  return std::nullopt;
}

std::optional<size_t> ParseMemorySize(std::string_view text) {
  double number = 0;
  const auto [rest, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || !std::isfinite(number) || number < 0) return std::nullopt;
  std::string unit;
  for (const char* c = rest; c != text.data() + text.size(); ++c) {
    if (*c == ' ' && unit.empty()) continue;
    unit += static_cast<char>(*c >= 'A' && *c <= 'Z' ? *c - 'A' + 'a' : *c);
  }
  constexpr std::string_view kUnits = "kmgt";
  size_t power = 2;
  if (!unit.empty()) {
    power = kUnits.find(unit.front()) + 1;
    const std::string_view tail = std::string_view(unit).substr(1);
    if (power == 0 || !(tail.empty() || tail == "b" || tail == "ib")) return std::nullopt;
  }
  const double bytes = std::ldexp(number, static_cast<int>(10 * power));
  constexpr double kMost = 9e18;
  if (bytes > kMost) return std::nullopt;
  return static_cast<size_t>(bytes);
}

}  // namespace tether
