#include "tether/geometry/distance/geometry_bench.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numbers>

#include <Eigen/Geometry>

#include "tether/common/random.h"
#include "tether/geometry/distance/distance.h"
#include "tether/geometry/distance/query.h"
#include "tether/geometry/hull/polytope.h"
#include "tether/geometry/polygon/support.h"
#include "tether/math/infinity.h"

namespace tether::geometry {
namespace {

using Eigen::Vector3d;

double RandomSize(Random& random) {
  // Mostly the size of things on a table, sometimes thin or large.
  if (random.Index(8) == 0) return random.Index(2) == 0 ? 0.005 : 2.0;
  return random.Uniform(0.02, 0.3);
}

Vector3d RandomDirection(Random& random) {
  return Vector3d(random.Normal(), random.Normal(), random.Normal()).normalized();
}

/// Four to sixty corners: a cloud of points in a ball, a prism or pyramid, or a box with a corner cut off.
Primitive RandomHull(const Vector3d& size, Random& random) {
  const int form = random.Index(4);
  const int corners = form == 0 ? 4 + random.Index(57) : 3 + random.Index(28);
  for (;;) {
    std::vector<Vector3d> points;
    for (int i = 0; i < corners; ++i) {
      const double angle = 2 * std::numbers::pi * i / corners;
      const Vector3d rim(0.5 * std::cos(angle), 0.5 * std::sin(angle), 0.5);
      if (form == 0) points.push_back(0.5 * RandomDirection(random));
      if (form == 1) points.insert(points.end(), {rim, rim - Vector3d::UnitZ()});
      if (form == 2) points.insert(points.end(), {rim, {0.1, 0.2, -0.5}});
    }
    if (form == 3) {
      for (int i = 0; i < 7; ++i) {
        points.emplace_back(0.5 - (i & 1), 0.5 - ((i >> 1) & 1), 0.5 - ((i >> 2) & 1));
      }
      points.insert(points.end(), {{-0.2, -0.5, -0.5}, {-0.5, -0.3, -0.5}, {-0.5, -0.5, 0.1}});
    }
    for (Vector3d& p : points) p = p.cwiseProduct(size);
    if (const HullResult made = MakeHull(points); made.hull) return *made.hull;
  }
}

Primitive RandomPrimitive(int kind, Random& random) {
  const double a = RandomSize(random);
  const double b = RandomSize(random);
  const double c = RandomSize(random);
  switch (kind) {
    case 0:
      return Box{Vector3d(a, b, c)};
    case 1:
      return Sphere{0.5 * a};
    case 2:
      return Capsule{0.5 * a, b};
    case 3:
      return Cylinder{0.5 * a, b};
    default:
      return RandomHull({a, b, c}, random);
  }
}

Eigen::Matrix3d RandomRotation(Random& random) {
  return Eigen::Quaterniond(random.Normal(), random.Normal(), random.Normal(), random.Normal())
      .normalized()
      .toRotationMatrix();
}

/// A rotation by a multiple of a quarter turn about a random axis of the frame.
Eigen::Matrix3d QuarterTurn(Random& random) {
  return Eigen::AngleAxisd(0.5 * std::numbers::pi * random.Index(4), Vector3d::Unit(random.Index(3)))
      .toRotationMatrix();
}

PosedPair RandomPair(int kind_a, int kind_b, Random& random) {
  PosedPair c{RandomPrimitive(kind_a, random), RandomPrimitive(kind_b, random), {}, {}};
  c.X_WA = {RandomRotation(random), RandomDirection(random) * random.Uniform(0, 1)};
  c.X_WB.R = RandomRotation(random);
  const bool special = random.Index(5) == 0;
  if (special) {
    if (random.Index(2) == 0) c.X_WA.R = QuarterTurn(random);
    c.X_WB.R = c.X_WA.R * QuarterTurn(random);
    if (random.Index(3) == 0) c.X_WB.R = c.X_WB.R * math::RotationFromRpy({0, 0, random.Uniform(-3, 3)});
  }
  // B lies in direction n from A so that the supports along n are `clearance` apart.
  Vector3d n = RandomDirection(random);
  if (special) n = c.X_WA.R * Vector3d::Unit(random.Index(3)) * (random.Index(2) == 0 ? 1.0 : -1.0);
  const double reach = Support(c.a, c.X_WA.R.transpose() * n) + Support(c.b, -(c.X_WB.R.transpose() * n));
  double along = reach + random.Uniform(-0.9, 0.5) * std::min(reach, 0.5);
  if (special) {
    const int how = random.Index(4);
    if (how == 0) along = reach;  // touching
    if (how == 1) along = 0;      // coincident centres
    if (how == 2) along = reach + random.Uniform(-1e-3, 1e-3);
  }
  c.X_WB.p = c.X_WA.p + along * n;
  if (special && random.Index(2) == 0) {
    c.X_WB.p += c.X_WA.R * Vector3d::Unit(random.Index(3)) * random.Uniform(-0.2, 0.2);
  }
  return c;
}

/// How far the solids are apart along the unit vector n, from A to B, m; negative where they overlap.
double Separation(const PosedPair& pair, const Vector3d& n) {
  return n.dot(pair.X_WB.p - pair.X_WA.p) - Support(pair.a, pair.X_WA.R.transpose() * n) -
         Support(pair.b, -(pair.X_WB.R.transpose() * n));
}

/// The greatest separation along the axes of both frames, and across pairs of them.
double BestSeparation(const PosedPair& pair) {
  double best = -math::kInfinity;
  const auto look_along = [&](const Vector3d& n) {
    if (n.norm() < 0.5) return;
    best = std::max({best, Separation(pair, n), Separation(pair, -n)});
  };
  for (int i = 0; i < 3; ++i) {
    look_along(pair.X_WA.R.col(i));
    look_along(pair.X_WB.R.col(i));
    for (int j = 0; j < 3; ++j) look_along(pair.X_WA.R.col(i).cross(pair.X_WB.R.col(j)).normalized());
  }
  return best;
}

double ErrorOf(const PosedPair& pair, const Distance& d) {
  const double of_normal = std::abs(d.distance - Separation(pair, d.n_W));
  const double of_others = BestSeparation(pair) - d.distance;
  const double shown = std::max(of_normal, of_others);
  if (d.distance <= 0) return shown;
  const double off_the_surfaces = std::abs(DistanceToPoint(pair.a, pair.X_WA, d.p_WA).distance) +
                                  std::abs(DistanceToPoint(pair.b, pair.X_WB, d.p_WB).distance);
  return std::max(shown, (d.p_WB - d.p_WA).norm() + off_the_surfaces - d.distance);
}

}  // namespace

std::vector<PosedPair> RandomPairs(int kind_a, int kind_b, int count, uint64_t seed) {
  Random random(seed + 16 * kind_a + kind_b);
  std::vector<PosedPair> pairs;
  pairs.reserve(count);
  for (int i = 0; i < count; ++i) pairs.push_back(RandomPair(kind_a, kind_b, random));
  return pairs;
}

// Of the kinds that meet a cylinder only the sphere does so in closed form.
bool IsIterative(int kind_a, int kind_b) { return (kind_a == 3 || kind_b == 3) && kind_a != 1; }

double DistanceError(const PosedPair& pair) {
  return ErrorOf(pair, SignedDistance(pair.a, pair.X_WA, pair.b, pair.X_WB));
}

std::vector<PairReport> BenchmarkDistances(int pairs_per_kind, uint64_t seed) {
  std::vector<PairReport> reports;
  for (int kind_a = 0; kind_a < kPrimitiveKinds; ++kind_a) {
    for (int kind_b = kind_a; kind_b < kPrimitiveKinds; ++kind_b) {
      const std::vector<PosedPair> pairs = RandomPairs(kind_a, kind_b, pairs_per_kind, seed);
      PairReport report;
      report.pairs = pairs_per_kind;
      if (!pairs.empty()) {
        report.kind_a = KindName(pairs[0].a);
        report.kind_b = KindName(pairs[0].b);
      }
      report.iterative = IsIterative(kind_a, kind_b);

      std::vector<Distance> distances(pairs.size());
      const auto start = std::chrono::steady_clock::now();
      for (size_t i = 0; i < pairs.size(); ++i) {
        distances[i] = SignedDistance(pairs[i].a, pairs[i].X_WA, pairs[i].b, pairs[i].X_WB);
      }
      const std::chrono::duration<double> spent = std::chrono::steady_clock::now() - start;
      report.time_per_query = pairs.empty() ? 0 : spent.count() / static_cast<double>(pairs.size());

      for (size_t i = 0; i < pairs.size(); ++i) {
        if (distances[i].distance < 0) ++report.overlapping;
        report.max_error = std::max(report.max_error, ErrorOf(pairs[i], distances[i]));
      }
      reports.push_back(report);
    }
  }
  return reports;
}

}  // namespace tether::geometry
