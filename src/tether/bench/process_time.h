#pragma once

#include <string>
#include <vector>

namespace tether::bench {

/// The value below which a share of the values lies, by nearest rank; 0 where there are none.
double Quantile(std::vector<double> values, double share);

/// Median and tail of some times, s.
struct Spread {
  double median = 0;
  double p99 = 0;
};
Spread SpreadOf(std::vector<double> values);

/// Measured times, one per repetition, s.
struct Samples {
  std::vector<double> wall;  ///< Wall-clock time.
  std::vector<double> cpu;   ///< CPU time of the thread, or of the process.

  void Add(double wall_s, double cpu_s) {
    wall.push_back(wall_s);
    cpu.push_back(cpu_s);
  }
};

/// Time since it was made, on the clock and of this thread.
class Stopwatch {
 public:
  Stopwatch();
  double wall_s() const;
  double cpu_s() const;  ///< Of the thread that asks, which has to be the one that made it.
  void AddTo(Samples& samples) const { samples.Add(wall_s(), cpu_s()); }

 private:
  double wall_begin_, cpu_begin_;
};

/// Runs a program to its end, with its output thrown away, and adds its times from start to exit. Returns its
/// exit code; 128 + the signal that ended it. Throws InputError if it can't be started.
int TimeProcess(const std::vector<std::string>& command, Samples& samples);

}  // namespace tether::bench
