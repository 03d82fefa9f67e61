#pragma once

#include <string>
#include <vector>

#include "tether/common/document/value.h"

namespace tether::evaluation {

/// Two that touch, and the sum of the normal forces between them.
struct PairForce {
  std::string a, b;
  double force = 0;   ///< N
  bool fast = false;  ///< `b` moves into `a` faster than 0.1 m/s.
};

/// What was pressed on over a run that no step intends. Forces are those of a pair, averaged over 10 ms. Of a
/// pair that came together because the other body moved into the arm faster than 0.1 m/s, only what lasts
/// counts: more than 40 N, from when that body rests.
struct ForceSummary {
  double most = 0;         ///< N
  double most_time = 0;    ///< s
  std::string most_pair;   ///< "panda and bench"
  double longest_50 = 0;   ///< Longest stretch of more than 50 N, s …
  double longest_40 = 0;   ///< … and of more than 40 N.
  double struck_most = 0;  ///< The most of what moved into the arm, N.
};

Value WriteForces(const ForceSummary& forces);

/// Makes a ForceSummary from the contacts of each tick.
class ForceRecord {
 public:
  explicit ForceRecord(double period);
  /// One tick: the contacts that no step intends. Returns the largest mean force of those that count, N, and
  /// its pair's index in `pairs` (−1: none) in `which`.
  double Observe(double time, const std::vector<PairForce>& pairs, int* which);
  const ForceSummary& summary() const { return summary_; }

 private:
  struct Window {
    std::string a, b;
    std::vector<double> forces;  ///< Of the last 10 ms, as a ring.
    size_t next = 0;
    double sum = 0;
    bool struck = false;  ///< The other body moved into the arm; until they part.
    double over_50 = 0, over_40 = 0;
  };
  Window& Find(const PairForce& pair);

  double period_;
  size_t ticks_;
  std::vector<Window> windows_;
  ForceSummary summary_;
};

}  // namespace tether::evaluation
