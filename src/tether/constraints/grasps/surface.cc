#include "tether/constraints/grasps/surface.h"

#include <algorithm>

#include "tether/geometry/hull/polytope.h"
#include "tether/geometry/input_tolerance.h"

namespace tether::constraints {
namespace {

// Faces whose normals have less than this cosine are different sides, however small they are.
constexpr double kSameSide = 0.98;

}  // namespace

using Eigen::Vector3d;

std::vector<FaceEdge> EdgesOf(const geometry::FlatFacet& face) {
  std::vector<FaceEdge> edges;
  for (const geometry::HalfPlane& edge : geometry::EdgeHalfPlanes(face.polygon)) {
    edges.push_back({edge.normal.x() * face.axis_x + edge.normal.y() * face.axis_y, edge.offset});
  }
  return edges;
}

std::vector<FlatSide> FlatSides(const geometry::Part& part) {
  std::vector<FlatSide> sides;
  const auto add = [&](const Vector3d& normal_P, double offset_P, const std::string& name) -> FlatSide& {
    const Vector3d normal = part.X_SP.R * normal_P;
    return sides.emplace_back(FlatSide{normal, offset_P + normal.dot(part.X_SP.p), {}, name});
  };
  if (const auto* box = std::get_if<geometry::Box>(&part.primitive)) {
    for (int axis = 0; axis < 3; ++axis) {
      for (const int sign : {1, -1}) {
        FlatSide& side = add(sign * Vector3d::Unit(axis), 0.5 * box->size[axis],
                             std::string(sign > 0 ? "+" : "-") + "xyz"[axis]);
        const int u = (axis + 1) % 3, v = (axis + 2) % 3;
        for (const auto& [along_u, along_v] : {std::pair{1, 1}, {-1, 1}, {-1, -1}, {1, -1}}) {
          Vector3d corner;
          corner[axis] = 0.5 * sign * box->size[axis];
          corner[u] = 0.5 * along_u * box->size[u];
          corner[v] = 0.5 * sign * along_v * box->size[v];
          side.corners.push_back(part.X_SP * corner);
        }
      }
    }
  } else if (const auto* hull = std::get_if<geometry::Hull>(&part.primitive)) {
    const geometry::Polytope& polytope = *hull->polytope;
    std::vector<bool> taken(polytope.faces.size(), false);
    for (size_t i = 0; i < polytope.faces.size(); ++i) {
      if (taken[i]) continue;
      const geometry::Polytope::Face& face = polytope.faces[i];
      FlatSide& side = add(face.normal, face.offset, std::to_string(sides.size() + 1));
      // Faces that are one side but for the rounding of its corners.
      bool merged = false;
      for (size_t j = i + 1; j < polytope.faces.size(); ++j) {
        if (taken[j] || polytope.faces[j].normal.dot(face.normal) < kSameSide) continue;
        const std::vector<int>& others = polytope.faces[j].corners;
        taken[j] = std::all_of(others.begin(), others.end(), [&](int corner) {
          return face.normal.dot(polytope.vertices[corner]) >= face.offset - geometry::kInputLength;
        });
        if (!taken[j]) continue;
        merged = true;
      }
      if (merged) {
        const geometry::FlatFacet flat =
            geometry::SupportPolygon(geometry::Shape(std::vector<geometry::Part>{part}), side.normal);
        side.corners = flat.points;
        continue;
      }
      for (const int corner : face.corners) side.corners.push_back(part.X_SP * polytope.vertices[corner]);
    }
  }
  return sides;
}

Extent ExtentAlong(const FlatSide& side, const Vector3d& direction) {
  Extent extent{direction.dot(side.corners.front()), direction.dot(side.corners.front())};
  for (const Vector3d& corner : side.corners) {
    extent.low = std::min(extent.low, direction.dot(corner));
    extent.high = std::max(extent.high, direction.dot(corner));
  }
  return extent;
}

Vector3d CentroidOf(const geometry::FlatFacet& face) { return face.Lift(geometry::Centroid(face.polygon)); }

double InradiusOf(const geometry::FlatFacet& face) {
  return std::max(0.0, geometry::ContainmentMargin(face.polygon, geometry::Centroid(face.polygon)));
}

double PartSupport(const geometry::Part& part, const Vector3d& direction) {
  return geometry::Support(part.primitive, part.X_SP.R.transpose() * direction) + direction.dot(part.X_SP.p);
}

}  // namespace tether::constraints
