#include <algorithm>
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "tether/common/random.h"
#include "tether/geometry/polygon/polygon.h"

namespace tether::geometry {
namespace {

using Eigen::Vector2d;
using std::numbers::pi;

/// The slow oracles: every yaw in turn, with nothing ruled out.
std::optional<Fit> SlowFitsInside(const Polygon& inner, const Polygon& outer, double yaw) {
  if (inner.empty() || outer.size() < 3) return std::nullopt;
  const Polygon turned = Transform(inner, yaw, Vector2d::Zero());
  double reach = 0;
  for (const Vector2d& p : turned) reach = std::max(reach, p.norm());
  for (const Vector2d& p : outer) reach = std::max(reach, p.norm());
  reach *= 3;
  Polygon translations = {{-reach, -reach}, {reach, -reach}, {reach, reach}, {-reach, reach}};
  for (HalfPlane half_plane : EdgeHalfPlanes(outer)) {
    double farthest = -1e300;
    for (const Vector2d& p : turned) farthest = std::max(farthest, half_plane.normal.dot(p));
    half_plane.offset += 1e-9 - farthest;
    translations = Cut(translations, half_plane);
    if (translations.empty()) return std::nullopt;
  }
  return Fit{yaw, Centroid(translations)};
}

std::optional<Fit> SlowFitsInside(const Polygon& inner, const Polygon& outer) {
  const auto angle = [](const Polygon& polygon, size_t i) {
    const Vector2d d = polygon[(i + 1) % polygon.size()] - polygon[i];
    return std::atan2(d.y(), d.x());
  };
  std::vector<double> yaws;
  for (size_t i = 0; i < inner.size() && inner.size() > 1; ++i) {
    for (size_t j = 0; j < outer.size(); ++j) {
      yaws.push_back(std::remainder(angle(outer, j) - angle(inner, i), 2 * pi));
    }
  }
  std::stable_sort(yaws.begin(), yaws.end(), [](double a, double b) { return std::abs(a) < std::abs(b); });
  for (int i = 0; i < 720; ++i) yaws.push_back((i % 2 == 0 ? 1 : -1) * ((i + 1) / 2) * pi / 360);
  for (const double yaw : yaws) {
    if (const std::optional<Fit> fit = SlowFitsInside(inner, outer, yaw)) return fit;
  }
  return std::nullopt;
}

Polygon RandomPolygon(Random& random) {
  const int count = random.Index(6);
  const double scale = std::pow(10.0, random.Uniform(-2, 0));
  const Vector2d at = scale * Vector2d(random.Normal(), random.Normal());
  std::vector<Vector2d> points;
  switch (random.Index(5)) {
    case 0: {  // rectangle
      const double x = scale * random.Uniform(0.1, 2), y = scale * random.Uniform(0.1, 2);
      return {at, at + Vector2d(x, 0), at + Vector2d(x, y), at + Vector2d(0, y)};
    }
    case 1: {  // disc
      for (int i = 0; i < 32; ++i) {
        points.push_back(at + scale * Vector2d(std::cos(2 * pi * i / 32), std::sin(2 * pi * i / 32)));
      }
      break;
    }
    case 2:  // sliver, with sharp corners
      for (int i = 0; i < 4; ++i)
        points.emplace_back(scale * random.Normal(), 1e-4 * scale * random.Normal());
      break;
    case 3:  // segment or point
      for (int i = 0; i < 1 + count % 2; ++i) points.emplace_back(scale * random.Normal(), 0.2);
      break;
    default:
      for (int i = 0; i < 3 + count; ++i) {
        points.push_back(at + scale * Vector2d(random.Normal(), random.Normal()));
      }
  }
  return ConvexHull(points);
}

void ExpectSame(const Polygon& inner, const Polygon& outer) {
  const std::optional<Fit> fast = FitsInside(inner, outer);
  const std::optional<Fit> slow = SlowFitsInside(inner, outer);
  ASSERT_EQ(fast.has_value(), slow.has_value());
  if (!fast) return;
  EXPECT_EQ(fast->yaw, slow->yaw);
  EXPECT_EQ(fast->translation, slow->translation);
}

TEST(FitsInsideTest, AgreesExactlyWithTryingEveryYaw) {
  Random random(6);
  int fits = 0;
  for (int i = 0; i < 1500; ++i) {
    const Polygon inner = RandomPolygon(random);
    const Polygon outer = RandomPolygon(random);
    ExpectSame(inner, outer);
    if (outer.size() >= 3) fits += SlowFitsInside(inner, outer, 0).has_value();
    if (testing::Test::HasFailure()) FAIL() << "case " << i;
  }
  EXPECT_GT(fits, 100);
}

TEST(FitsInsideTest, AgreesWhereItFitsByAHair) {
  Random random(7);
  int fits = 0;
  const int count = 1500;
  for (int i = 0; i < count; ++i) {
    const Polygon outer = RandomPolygon(random);
    if (outer.size() < 3) continue;
    const double hair = random.Uniform(-1, 1) * std::pow(10.0, random.Uniform(-16, -4));
    const double yaw =
        random.Index(2) == 0 ? random.Uniform(-pi, pi) : (random.Index(720) - 360.0) * pi / 360;
    Polygon inner = Transform(outer, yaw, {random.Normal(), random.Normal()});
    const Vector2d centre = Centroid(inner);
    for (Vector2d& p : inner) p += hair * (p - centre);
    ExpectSame(inner, outer);
    fits += FitsInside(inner, outer).has_value();
    if (testing::Test::HasFailure()) FAIL() << "case " << i;
  }
  EXPECT_GT(fits, count / 4);
  EXPECT_LT(fits, 3 * count / 4);
}

TEST(FitsInsideTest, FindsTheDiagonalThatEveryWidthAllows) {
  const Polygon square = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  for (const double length : {1.0, 1.2, 1.3, 1.35, 1.4, 1.42}) {
    ExpectSame({{0, 0}, {length, 0}, {length, 0.05}, {0, 0.05}}, square);
  }
}

}  // namespace
}  // namespace tether::geometry
