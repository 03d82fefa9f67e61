#include "tether/constraints/surface.h"

#include <algorithm>

namespace tether::constraints {

using Eigen::Vector3d;

std::vector<FaceEdge> EdgesOf(const geometry::FlatFacet& face) {
  std::vector<FaceEdge> edges;
  for (const geometry::HalfPlane& edge : geometry::EdgeHalfPlanes(face.polygon)) {
    edges.push_back({edge.normal.x() * face.axis_x + edge.normal.y() * face.axis_y, edge.offset});
  }
  return edges;
}

Vector3d CentroidOf(const geometry::FlatFacet& face) { return face.Lift(geometry::Centroid(face.polygon)); }

double InradiusOf(const geometry::FlatFacet& face) {
  return std::max(0.0, geometry::ContainmentMargin(face.polygon, geometry::Centroid(face.polygon)));
}

double PartSupport(const geometry::Part& part, const Vector3d& direction) {
  return geometry::Support(part.primitive, part.X_SP.R.transpose() * direction) + direction.dot(part.X_SP.p);
}

}  // namespace tether::constraints
