#include "tether/evaluation/margins/force_record.h"

#include <algorithm>
#include <cmath>

namespace tether::evaluation {
namespace {

constexpr double kWindow = 0.01;              // s
constexpr double kPressing = 50, kHeld = 40;  // N
// A mean below this is no contact, N.
constexpr double kApart = 0.5;

}  // namespace

Value WriteForces(const ForceSummary& forces) {
  return Value::Object()
      .Set("most_n", forces.most)
      .Set("time_s", forces.most_time)
      .Set("what", forces.most_pair)
      .Set("longest_above_50n_s", forces.longest_50)
      .Set("longest_above_40n_s", forces.longest_40)
      .Set("most_of_what_moved_into_the_arm_n", forces.struck_most);
}

ForceRecord::ForceRecord(double period)
    : period_(period), ticks_(std::max<size_t>(1, static_cast<size_t>(std::lround(kWindow / period)))) {}

ForceRecord::Window& ForceRecord::Find(const PairForce& pair) {
  const auto known = std::find_if(windows_.begin(), windows_.end(),
                                  [&](const Window& w) { return w.a == pair.a && w.b == pair.b; });
  if (known != windows_.end()) return *known;
  windows_.push_back({pair.a, pair.b, std::vector<double>(ticks_, 0.0)});
  return windows_.back();
}

double ForceRecord::Observe(double time, const std::vector<PairForce>& pairs, int* which) {
  for (const PairForce& pair : pairs) {
    if (pair.force > 0) Find(pair);
  }
  double most = 0;
  *which = -1;
  for (Window& window : windows_) {
    double force = 0;
    bool fast = false;
    int index = -1;
    for (size_t i = 0; i < pairs.size(); ++i) {
      if (pairs[i].a != window.a || pairs[i].b != window.b) continue;
      force = pairs[i].force;
      fast = pairs[i].fast && force > 0;
      index = static_cast<int>(i);
    }
    window.sum += force - window.forces[window.next];
    window.forces[window.next] = force;
    window.next = (window.next + 1) % window.forces.size();
    const double mean = window.sum / static_cast<double>(window.forces.size());
    if (mean < kApart && !fast) window.struck = false;
    window.struck = window.struck || fast;
    window.over_40 = mean > kHeld && !fast ? window.over_40 + period_ : 0;
    window.over_50 = mean > kPressing && !window.struck ? window.over_50 + period_ : 0;
    summary_.longest_40 = std::max(summary_.longest_40, window.over_40);
    summary_.longest_50 = std::max(summary_.longest_50, window.over_50);
    if (window.struck) {
      summary_.struck_most = std::max(summary_.struck_most, mean);
      continue;
    }
    if (mean > summary_.most) {
      summary_.most = mean;
      summary_.most_time = time;
      summary_.most_pair = window.a + " and " + window.b;
    }
    if (mean > most) {
      most = mean;
      *which = index;
    }
  }
  return most;
}

}  // namespace tether::evaluation
