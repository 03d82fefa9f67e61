#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <optional>
#include <stop_token>
#include <string>
#include <string_view>

namespace tether {

/// Which limit ended a computation before it was done.
enum class Limit {
  kTime,
  kMemory,
  kInterrupted,  ///< A stop was requested.
};

/// "the time limit was reached", or the like.
std::string_view Describe(Limit limit);

/// Thrown by Limits::Poll() from deep inside a computation, and caught where the limits were set, where it
/// becomes an outcome: it is neither bad input nor a bug.
class LimitReached : public std::exception {
 public:
  explicit LimitReached(Limit limit) : limit_(limit) {}
  Limit limit() const { return limit_; }
  const char* what() const noexcept override { return Describe(limit_).data(); }

 private:
  Limit limit_;
};

/// Bytes of the computer's memory that the process occupies; 0 where the system does not say.
size_t MemoryInUse();

/// The limits of a long computation: passed down by value or reference, and polled from its inner loops. May
/// be read by several threads at once.
struct Limits {
  std::stop_token stop = {};
  const std::atomic<bool>* interrupted = nullptr;  ///< A request to stop where there is no token.
  std::optional<std::chrono::steady_clock::time_point> deadline = std::nullopt;
  size_t memory = 0;  ///< Bytes that the whole process may occupy; 0: no limit.

  /// The deadline is so many seconds from now; none if that is 0.
  void SetTimeLimit(double seconds);
  bool interruption_requested() const {
    return stop.stop_requested() || (interrupted != nullptr && interrupted->load(std::memory_order_relaxed));
  }
  /// The limit that is reached, if one is; an interruption before others. Costs some 30 ns: memory is checked
  /// every few milliseconds only.
  std::optional<Limit> Reached() const;
  /// Throws LimitReached if a limit is.
  void Poll() const {
    if (const auto limit = Reached()) throw LimitReached(*limit);
  }
};

/// Polls every 256th time that it is called, for loops whose turns cost less than a poll. One per thread.
class LimitPoller {
 public:
  /// `limits` must outlive the poller.
  explicit LimitPoller(const Limits& limits) : limits_(&limits) {}
  void Tick() {
    if (++ticks_ % 256 == 0) limits_->Poll();
  }

 private:
  const Limits* limits_;
  uint32_t ticks_ = 0;
};

/// While one exists, `limits` apply to all that this thread computes: for code that is too deep, or called
/// from too many places, to get them as an argument. Scopes nest; the inner one counts.
class LimitsScope {
 public:
  /// `limits` must outlive the scope.
  explicit LimitsScope(const Limits& limits);
  ~LimitsScope();
  LimitsScope(const LimitsScope&) = delete;
  LimitsScope& operator=(const LimitsScope&) = delete;

 private:
  const Limits* before_;
};

/// Polls the limits of this thread's scope, if there is one, every 64th time that it is called. Throws
/// LimitReached.
void PollLimits();
/// The same at every call: for loops whose turns take longer than a poll.
void PollLimitsNow();

/// The default of --memory-limit, in bytes.
constexpr size_t kDefaultMemoryLimit = size_t{2} << 30;

/// Reads "512", "512M", "1.5GiB": MiB without a unit, otherwise K, M, G or T, of which each is 1024 of the
/// one before, in any case, with or without "B" or "iB"; 0 is no limit. Nothing if the text is none of these.
std::optional<size_t> ParseMemorySize(std::string_view text);

}  // namespace tether
