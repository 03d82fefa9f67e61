#include "tether/constraints/kinds/contact_patch.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "tether/geometry/input_tolerance.h"

namespace tether::constraints {
namespace {

using Eigen::Vector3d;
using geometry::FlatFacet;
using geometry::HalfPlane;
using geometry::Polygon;

/// What the parts of a shape have on the plane with this normal, one facet per part that reaches it.
std::vector<FlatFacet> Patches(const geometry::Shape& shape, const Vector3d& normal, double offset) {
  std::vector<FlatFacet> patches;
  for (const geometry::Part& part : shape.parts) {
    FlatFacet facet = geometry::SupportPolygon(geometry::Shape(std::vector<geometry::Part>{part}), normal);
    if (std::abs(facet.offset - offset) <= geometry::kInputLength) patches.push_back(std::move(facet));
  }
  return patches;
}

}  // namespace

double FilledShare(const geometry::Shape& shape, const FlatFacet& face) {
  const double whole = geometry::Area(face.polygon);
  if (!(whole > 0)) return 1;
  const std::vector<FlatFacet> patches = Patches(shape, face.normal, face.offset);
  double filled = 0;
  for (size_t i = 0; i < patches.size(); ++i) {
    // What the earlier ones leave of it, in convex pieces.
    std::vector<Polygon> pieces{patches[i].polygon};
    for (size_t j = 0; j < i; ++j) {
      if (patches[j].polygon.size() < 3) continue;
      std::vector<Polygon> left;
      for (Polygon& piece : pieces) {
        for (const HalfPlane& edge : geometry::EdgeHalfPlanes(patches[j].polygon)) {
          Polygon outside = geometry::Cut(piece, {-edge.normal, -edge.offset});
          if (outside.size() >= 3) left.push_back(std::move(outside));
          piece = geometry::Cut(piece, edge);
          if (piece.size() < 3) break;
        }
      }
      pieces = std::move(left);
    }
    for (const Polygon& piece : pieces) filled += piece.size() < 3 ? 0 : geometry::Area(piece);
  }
  return std::min(1.0, filled / whole);
}

Polygon ContactHull(const geometry::Shape& a, const Vector3d& down_A, const math::Pose& X_BA,
                    const geometry::Shape& b, const FlatFacet& level) {
  const std::vector<FlatFacet> carriers = Patches(b, level.normal, level.offset);
  std::vector<Eigen::Vector2d> points;
  std::vector<Eigen::Vector2d> foot;
  for (const Vector3d& p : geometry::SupportPolygon(a, down_A).points)
    foot.push_back(level.Project(X_BA * p));
  const Polygon polygon = geometry::ConvexHull(std::move(foot));
  for (const FlatFacet& carrier : carriers) {
    if (carrier.polygon.size() < 3) continue;
    Polygon common = polygon;
    for (const HalfPlane& edge : geometry::EdgeHalfPlanes(carrier.polygon))
      common = geometry::Cut(common, edge);
    points.insert(points.end(), common.begin(), common.end());
  }
  return geometry::ConvexHull(std::move(points));
}

}  // namespace tether::constraints
