#include <vector>

#include <benchmark/benchmark.h>

#include "tether/common/random.h"
#include "tether/geometry/distance.h"

namespace tether::geometry {
namespace {

using Eigen::Vector3d;

const Primitive kSolids[] = {Box{{0.2, 0.15, 0.1}}, Sphere{0.08}, Capsule{0.04, 0.2}, Cylinder{0.06, 0.15}};

/// Arguments: the kinds' indices, and 1 for overlapping poses, 0 for poses apart.
void BM_SignedDistance(benchmark::State& state) {
  const Primitive& a = kSolids[state.range(0)];
  const Primitive& b = kSolids[state.range(1)];
  Random random(1);
  std::vector<math::Pose> poses;
  while (poses.size() < 64) {
    const math::Pose X_AB(math::ExpSO3({random.Normal(), random.Normal(), random.Normal()}),
                          0.2 * Vector3d(random.Normal(), random.Normal(), random.Normal()));
    const double distance = SignedDistance(a, math::Pose(), b, X_AB).distance;
    if ((distance < 0) == (state.range(2) == 1)) poses.push_back(X_AB);
  }
  size_t i = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(SignedDistance(a, math::Pose(), b, poses[i++ % poses.size()]));
  }
  state.SetLabel(KindName(a) + " " + KindName(b) + (state.range(2) == 1 ? ", overlapping" : ", apart"));
}
BENCHMARK(BM_SignedDistance)->Apply([](benchmark::internal::Benchmark* benchmark) {
  for (int a = 0; a < 4; ++a) {
    for (int b = a; b < 4; ++b) {
      benchmark->Args({a, b, 0});
      benchmark->Args({a, b, 1});
    }
  }
});

}  // namespace
}  // namespace tether::geometry
