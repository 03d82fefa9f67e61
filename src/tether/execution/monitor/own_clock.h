#pragma once

#include <cmath>

namespace tether::execution {

/// Makes of the stamps of a clock that may jump times that do not. Allocates nothing.
class OwnClock {
 public:
  /// `slack`: a stamp that is further ahead than what has passed and this has jumped, s.
  explicit OwnClock(double slack) : slack_(slack) {}

  /// One tick of `period` s. Whether the clock has jumped, back or ahead: from here on its times go on from
  /// what they were.
  bool Take(double stamp, double period) {
    elapsed_ += period;
    news_ = false;
    if (!std::isfinite(stamp)) return false;
    const double step = stamp - last_;
    if (started_ && step <= 0 && step > -kOutOfOrder) return false;
    news_ = true;
    const bool jumped = started_ && (step < 0 || step > elapsed_ + slack_);
    if (jumped) {
      jump_ = step - elapsed_;
      offset_ = time_ + elapsed_ - stamp;
    }
    last_ = stamp;
    time_ = stamp + offset_;
    elapsed_ = 0;
    started_ = true;
    return jumped;
  }
  /// What was stamped last has come in this tick.
  bool news() const { return news_; }
  /// Of what was stamped last, s.
  double time() const { return time_; }
  /// How far it has jumped last, s.
  double jump() const { return jump_; }

 private:
  // What was stamped a little before the last one was only overtaken by it, s.
  static constexpr double kOutOfOrder = 1e-3;

  double slack_;
  bool started_ = false, news_ = false;
  double last_ = 0, time_ = 0, offset_ = 0, elapsed_ = 0, jump_ = 0;
};

}  // namespace tether::execution
