#pragma once

#include <cstdint>
#include <string_view>

namespace tether {

/// A seeded generator (xoshiro256++), the same on every platform. One seed drives a whole run: parts get
/// their own generator by Split(), so that an additional draw in one part never changes another.
class Random {
 public:
  explicit Random(uint64_t seed);

  uint64_t Next();
  /// Uniform in [lower, upper).
  double Uniform(double lower, double upper);
  /// Uniform in {0, …, count − 1}; `count` must be positive.
  int Index(int count);
  /// Standard normal.
  double Normal();
  /// An independent generator for the part called `name`; does not advance this one.
  Random Split(std::string_view name) const;

 private:
  uint64_t state_[4];
};

}  // namespace tether
