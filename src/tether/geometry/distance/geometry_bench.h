#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "tether/geometry/shape.h"

namespace tether::geometry {

/// Two solids, posed in the world.
struct PosedPair {
  Primitive a, b;
  math::Pose X_WA, X_WB;
};

/// The number of kinds of primitives: box, sphere, capsule, cylinder, hull.
inline constexpr int kPrimitiveKinds = 5;

/// `count` random pairs of two kinds, by number: sizes from millimetres to metres, apart and overlapping, one
/// in five aligned, touching or with coincident centres. A function of its arguments.
std::vector<PosedPair> RandomPairs(int kind_a, int kind_b, int count, uint64_t seed);

/// SignedDistance() iterates for this pair of kinds: its error may then be 1e-5 m, else 1e-6 m.
bool IsIterative(int kind_a, int kind_b);

/// The distances of one pair of kinds, judged by themselves.
struct PairReport {
  std::string kind_a;
  std::string kind_b;
  bool iterative = false;     ///< As IsIterative().
  int pairs = 0;              ///< Pose pairs measured.
  int overlapping = 0;        ///< Of these, penetrating.
  double max_error = 0;       ///< Largest DistanceError(), m.
  double time_per_query = 0;  ///< s, of SignedDistance over all pairs; wall clock.
  double bound() const { return iterative ? 1e-5 : 1e-6; }
};

/// The error of SignedDistance() as far as its own answer and support functions show it, m. Apart, a bound
/// that is proved: the witness points bound the distance from above, the separation along the normal from
/// below. Overlapping, what the separation along the normal, and along other likely directions, shows; that
/// no other direction separates more is not proved.
double DistanceError(const PosedPair& pair);

/// All fifteen pairs of kinds, `pairs_per_kind` of each. Everything but the times is a function of the seed.
std::vector<PairReport> BenchmarkDistances(int pairs_per_kind, uint64_t seed);

}  // namespace tether::geometry
