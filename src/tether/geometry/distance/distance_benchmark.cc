#include <iterator>
#include <optional>
#include <vector>

#include <benchmark/benchmark.h>

#include "tether/common/random.h"
#include "tether/geometry/distance/distance.h"

namespace tether::geometry {
namespace {

using Eigen::Vector3d;

const Primitive kSolids[] = {Box{{0.2, 0.15, 0.1}}, Sphere{0.08}, Capsule{0.04, 0.2}, Cylinder{0.06, 0.15}};

enum Placement { kApart, kOverlapping, kStanding };
const char* const kPlacements[] = {"apart", "overlapping", "standing"};

/// A random pose of B of this placement; none if the draw does not fit it. `kStanding` has B upright on top
/// of A, touching, as most objects of a scene are.
std::optional<math::Pose> DrawPose(const Primitive& a, const Primitive& b, Placement placement,
                                   Random& random) {
  if (placement == kStanding) {
    const math::Pose X_AB(math::ExpSO3({0, 0, random.Normal()}),
                          {0.01 * random.Normal(), 0.01 * random.Normal(), 1});
    const double gap = SignedDistance(a, math::Pose(), b, X_AB).distance;
    return math::Pose(Vector3d(0, 0, -gap)) * X_AB;
  }
  const math::Pose X_AB(math::ExpSO3({random.Normal(), random.Normal(), random.Normal()}),
                        0.2 * Vector3d(random.Normal(), random.Normal(), random.Normal()));
  const bool overlapping = SignedDistance(a, math::Pose(), b, X_AB).distance < 0;
  return overlapping == (placement == kOverlapping) ? std::optional(X_AB) : std::nullopt;
}

/// Arguments: the kinds' indices and the placement.
void BM_SignedDistance(benchmark::State& state) {
  const Primitive& a = kSolids[state.range(0)];
  const Primitive& b = kSolids[state.range(1)];
  Random random(1);
  const auto placement = static_cast<Placement>(state.range(2));
  std::vector<math::Pose> poses;
  while (poses.size() < 64) {
    if (const auto X_AB = DrawPose(a, b, placement, random)) poses.push_back(*X_AB);
  }
  size_t i = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(SignedDistance(a, math::Pose(), b, poses[i++ % poses.size()]));
  }
  state.SetLabel(KindName(a) + " " + KindName(b) + ", " + kPlacements[placement]);
}
BENCHMARK(BM_SignedDistance)->Apply([](benchmark::internal::Benchmark* benchmark) {
  const int kinds = static_cast<int>(std::size(kSolids));
  for (int a = 0; a < kinds; ++a) {
    for (int b = a; b < kinds; ++b) {
      for (int placement : {kApart, kOverlapping, kStanding}) benchmark->Args({a, b, placement});
    }
  }
});

/// The near pairs of parts of two compounds, such as a hand and a hook: the query of a program's clearance.
void BM_PartDistances(benchmark::State& state) {
  const auto compound = [](int parts) {
    std::vector<Part> list;
    for (int i = 0; i < parts; ++i)
      list.push_back({kSolids[i % std::size(kSolids)], math::Pose(Vector3d(0.1 * i, 0, 0))});
    return Shape(list);
  };
  const Shape a = compound(static_cast<int>(state.range(0))), b = compound(static_cast<int>(state.range(1)));
  const math::Pose X_WB(math::ExpSO3({0.3, -0.2, 0.5}), Vector3d(0, 0, 0.3));
  for (auto _ : state) benchmark::DoNotOptimize(PartDistances(a, math::Pose(), b, X_WB, 0.1));
}
BENCHMARK(BM_PartDistances)->Args({1, 1})->Args({3, 2})->Args({3, 4});

void BM_DifferentiateDistance(benchmark::State& state) {
  const math::Pose X_WB(math::ExpSO3({0.3, -0.2, 0.5}), Vector3d(0, 0, 0.3));
  const Distance distance = SignedDistance(kSolids[0], math::Pose(), kSolids[3], X_WB);
  for (auto _ : state) benchmark::DoNotOptimize(DifferentiateDistance(distance, math::Pose(), X_WB));
}
BENCHMARK(BM_DifferentiateDistance);

}  // namespace
}  // namespace tether::geometry
