#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace tether::geometry {

/// How the distances of one pair of kinds compare with SlowDistance.
struct PairReport {
  std::string kind_a;
  std::string kind_b;
  bool iterative = false;        ///< Whether SignedDistance iterates for this pair; its bound is then 1e-5 m.
  int pairs = 0;                 ///< Pose pairs compared.
  int overlapping = 0;           ///< Of these, penetrating.
  double max_error = 0;          ///< Largest |SignedDistance − SlowDistance|, m.
  double max_witness_error = 0;  ///< Largest of |p_B − p_A − distance · n| and the witness points' misses, m.
  double max_uncertainty = 0;  ///< Largest uncertainty that the reference admits, m.
  double time_per_query = 0;   ///< s, of SignedDistance over all pairs; wall clock.
  double bound() const { return iterative ? 1e-5 : 1e-6; }
};

/// Compares all fifteen pairs of kinds on `pairs_per_kind` pose pairs each: random sizes from millimetres to
/// metres, random poses apart and overlapping, one in five aligned, touching or with coincident centres.
/// Everything but the times is a function of the seed. About 1 ms of computation per pose pair.
std::vector<PairReport> BenchmarkDistances(int pairs_per_kind, uint64_t seed);

}  // namespace tether::geometry
