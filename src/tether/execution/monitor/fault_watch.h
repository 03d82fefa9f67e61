#pragma once

#include <algorithm>

#include "tether/robot/sensing.h"

namespace tether::execution {

/// When the arm is stopped because something is not measured, and when it goes on.
struct FaultOptions {
  double silence = 0.02;      ///< A robot's measurements lack for so long (or three ticks), s.
  double pose_silence = 0.5;  ///< … poses of objects for so long, s.
  double steady = 0.05;       ///< All has been well again for so long, s.
  double lasting = 2;         ///< A fault that lasts so long fails the run, s.
};

/// How long poses may lack where sensors take them that seldom and deliver them that late, s.
inline double PoseSilence(const robot::Sensing& sensing) {
  const double usual = sensing.pose_delay + (sensing.pose_rate > 0 ? 2 / sensing.pose_rate : 0);
  return std::max(usual, FaultOptions().pose_silence);
}

/// Follows whether something is wrong: for some time that is borne, then the arm is to be stopped; once all
/// has been well for some time it may go on. Allocates nothing.
class FaultWatch {
 public:
  explicit FaultWatch(const FaultOptions& options) : options_(options) {}

  /// One tick at `time`, s. `patience`: what is wrong is borne for so long, s.
  void Update(double time, bool wrong, double patience) {
    const bool before = stopped_;
    first_ = wrong && since_ < 0;
    if (wrong) {
      if (since_ < 0) since_ = time;
      last_ = time;
      stopped_ = stopped_ || time >= since_ + patience;
    } else if (since_ >= 0 && (!stopped_ || time >= last_ + options_.steady)) {
      lasted_ = time - since_;
      since_ = -1;
      stopped_ = false;
    }
    began_ = stopped_ && !before;
    ended_ = before && !stopped_;
    lasts_ = stopped_ && wrong && time >= since_ + options_.lasting;
  }
  bool stopped() const { return stopped_; }  ///< The arm is to stand.
  bool first() const { return first_; }      ///< Something went wrong in this tick.
  bool began() const { return began_; }      ///< The arm is to stand from this tick on.
  bool ended() const { return ended_; }      ///< It goes on from this tick on.
  bool lasts() const { return lasts_; }      ///< For too long.
  double lasted() const { return lasted_; }  ///< What has ended, s.

 private:
  FaultOptions options_;
  bool stopped_ = false, first_ = false, began_ = false, ended_ = false, lasts_ = false;
  double since_ = -1, last_ = -1, lasted_ = 0;
};

}  // namespace tether::execution
