#include "tether/constraints/grasps/opposite_sides.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include <Eigen/Geometry>

#include "tether/geometry/polygon/polygon.h"
#include "tether/math/so3.h"

namespace tether::constraints {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

// Sides with less overlap than this across the approach (m) hold only what is not narrower when turned by a
// little (rad).
constexpr double kFirm = 0.005;
constexpr double kLittleTurn = 0.35;
// Less overlap than this is a line, m.
constexpr double kLeast = 5e-4;

double WidthOf(const geometry::Part& part, const Vector3d& n) {
  return PartSupport(part, n) + PartSupport(part, -n);
}

/// The corners of a side seen along `closing`, in the coordinates (across, up), counter-clockwise.
geometry::Polygon Outline(const FlatSide& side, const Vector3d& across, const Vector3d& up) {
  std::vector<Vector2d> points;
  for (const Vector3d& p : side.corners) points.emplace_back(across.dot(p), up.dot(p));
  return geometry::ConvexHull(std::move(points));
}

std::optional<OppositeSides> Match(const geometry::Part& part, const FlatSide& a, const FlatSide& b,
                                   const Vector3d& approach, double finger) {
  const double least_cosine = std::cos(kNearlyParallel);
  Vector3d closing = a.normal - b.normal;
  closing -= approach * approach.dot(closing);
  if (!(closing.norm() > 1)) return std::nullopt;  // 2 where they are opposite
  closing.normalize();
  if (a.normal.dot(closing) < least_cosine || -b.normal.dot(closing) < least_cosine) return std::nullopt;

  const Vector3d up = -approach, across = closing.cross(approach);
  geometry::Polygon common = Outline(a, across, up);
  for (const geometry::HalfPlane& edge : geometry::EdgeHalfPlanes(Outline(b, across, up)))
    common = geometry::Cut(common, edge);
  if (common.size() < 3) return std::nullopt;
  const Vector2d middle = geometry::Centroid(common);
  const double inradius = geometry::ContainmentMargin(common, middle);
  if (!(inradius > 0.5 * kLeast)) return std::nullopt;

  OppositeSides sides;
  sides.closing = closing;
  sides.width = WidthOf(part, closing);
  double left = common[0].x(), right = left;
  for (const Vector2d& p : common) {
    left = std::min(left, p.x());
    right = std::max(right, p.x());
  }
  if (right - left < kFirm) {
    for (const double turn : {kLittleTurn, -kLittleTurn}) {
      if (WidthOf(part, math::ExpSO3(approach * turn) * closing) < sides.width - kLeast) return std::nullopt;
    }
  }
  sides.centre = across * middle.x() + up * middle.y() +
                 closing * (0.5 * (PartSupport(part, closing) - PartSupport(part, -closing)));
  const double inset = std::min(finger, 0.5 * inradius);
  for (const geometry::HalfPlane& edge : geometry::EdgeHalfPlanes(common))
    sides.bounds.push_back({edge.normal.x() * across + edge.normal.y() * up, edge.offset - inset});
  sides.name = "sides " + a.name + " and " + b.name;
  return sides;
}

}  // namespace

std::vector<OppositeSides> FindOppositeSides(const geometry::Part& part, const Vector3d& approach,
                                             double finger) {
  std::vector<FlatSide> level;
  for (FlatSide& side : FlatSides(part)) {
    if (std::abs(side.normal.dot(approach)) < std::sin(kNearlyParallel)) level.push_back(std::move(side));
  }
  struct Pair {
    double cosine;  // −1: exactly opposite
    size_t i, j;
    OppositeSides sides;
  };
  std::vector<Pair> pairs;
  for (size_t i = 0; i < level.size(); ++i) {
    for (size_t j = i + 1; j < level.size(); ++j) {
      if (auto sides = Match(part, level[i], level[j], approach, finger))
        pairs.push_back({level[i].normal.dot(level[j].normal), i, j, std::move(*sides)});
    }
  }
  // Of a finely tessellated rod, neighbours of the opposite side would do as well: each side has one partner.
  const auto rounded = [](double cosine) { return std::round(1e9 * cosine); };
  std::stable_sort(pairs.begin(), pairs.end(),
                   [&](const Pair& a, const Pair& b) { return rounded(a.cosine) < rounded(b.cosine); });
  std::vector<bool> taken(level.size(), false);
  std::vector<OppositeSides> all;
  for (Pair& pair : pairs) {
    if (taken[pair.i] || taken[pair.j]) continue;
    taken[pair.i] = taken[pair.j] = true;
    all.push_back(std::move(pair.sides));
  }
  return all;
}

}  // namespace tether::constraints
