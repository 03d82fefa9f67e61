#pragma once

#include <limits>
#include <string>
#include <utility>

#include "tether/execution/observer/event.h"

namespace tether::execution {

/// How a verb stands after a tick: an outcome that the sequencer acts on.
struct Progress {
  enum class State {
    kRunning,
    kDone,
    kRetry,   ///< It failed; execution resumes at the step `resume`, if the action may be tried again.
    kGiveUp,  ///< It failed, and trying the action again can't help: other actions may.
    kFailed,  ///< Nothing helps.
  };

  static Progress Running() { return {}; }
  static Progress Done() { return {.state = State::kDone}; }
  /// `open`: the hand opens before it tries again.
  static Progress Retry(EventKind kind, std::string reason, int resume, bool open) {
    return {State::kRetry, kind, std::move(reason), resume, open};
  }
  static Progress GiveUp(EventKind kind, std::string reason) {
    return {.state = State::kGiveUp, .kind = kind, .reason = std::move(reason)};
  }
  static Progress Failed(EventKind kind, std::string reason) {
    return {.state = State::kFailed, .kind = kind, .reason = std::move(reason)};
  }

  State state = State::kRunning;
  EventKind kind = EventKind::kFailed;  ///< What is recorded before; kFailed: nothing.
  std::string reason = {};
  int resume = 0;
  bool open = false;
  bool out_of_reach = false;  ///< As it lies there is no configuration for it: the same again can't help.
};

/// Tells motions that get nearer to their end from those that have stalled.
class ProgressWatch {
 public:
  struct Options {
    double least = 0.001;      ///< Getting nearer by this is progress: m, radians weighted.
    double stall_time = 1.5;   ///< A motion without progress for so long has stalled, s.
    double verb_timeout = 40;  ///< As has one that takes so long, s.
  };

  explicit ProgressWatch(const Options& options) : options_(options) {}

  /// The motion begins.
  void Start(double time) {
    start_ = progress_ = time;
    least_error_ = std::numeric_limits<double>::infinity();
  }
  /// Another stretch of it begins: the error may grow once.
  void NewStretch() { least_error_ = std::numeric_limits<double>::infinity(); }
  /// The clock of the stall begins anew.
  void Excuse(double time) { progress_ = time; }
  /// `moving`: counts as progress, whatever the error.
  void Observe(double error, double time, bool moving = false) {
    if (!moving && error >= least_error_ - options_.least) return;
    least_error_ = error < least_error_ ? error : least_error_;
    progress_ = time;
  }
  bool Late(double time) const { return time - start_ > options_.verb_timeout; }
  bool Stalled(double time) const { return time - progress_ >= options_.stall_time || Late(time); }
  double start() const { return start_; }
  /// How long there has been no progress, s.
  double quiet(double time) const { return time - progress_; }

 private:
  Options options_;
  double start_ = 0;
  double progress_ = 0;
  double least_error_ = std::numeric_limits<double>::infinity();
};

}  // namespace tether::execution
