#include "tether/geometry/hull/polytope.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include <Eigen/Geometry>

#include "tether/common/overloaded.h"
#include "tether/geometry/hull/hull_builder.h"
#include "tether/geometry/polygon/polygon.h"
#include "tether/math/infinity.h"

namespace tether::geometry {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// Less than this is as good as flat, relative to the extent.
constexpr double kFlat = 1e-6;
constexpr double kLeastExtent = 1e-5;
constexpr double kGreatestExtent = 1e4;

/// The vertices within `tolerance` of the triangle's plane, in order around it; without those on a straight
/// edge.
std::vector<int> CornersInPlane(const std::vector<Vector3d>& points, const std::vector<int>& candidates,
                                const internal::HullTriangle& triangle, double tolerance) {
  const Vector3d& a = points[triangle[0]];
  const Vector3d n = (points[triangle[1]] - a).cross(points[triangle[2]] - a).normalized();
  const Vector3d u = n.unitOrthogonal();
  const Vector3d v = n.cross(u);
  std::vector<int> near;
  std::vector<Eigen::Vector2d> flat;
  for (const int i : candidates) {
    if (std::abs(n.dot(points[i] - a)) > tolerance) continue;
    near.push_back(i);
    flat.emplace_back(u.dot(points[i] - a), v.dot(points[i] - a));
  }
  std::vector<int> corners;
  for (const Eigen::Vector2d& p : ConvexHull(flat, tolerance)) {
    for (size_t k = 0; k < flat.size(); ++k) {
      if (flat[k] == p) {
        corners.push_back(near[k]);
        break;
      }
    }
  }
  return corners;
}

/// Joins triangles in one plane to faces; empty if the outcome does not close.
std::vector<std::vector<int>> JoinTriangles(const std::vector<Vector3d>& points,
                                            std::vector<internal::HullTriangle> triangles, double tolerance) {
  const auto doubled_area = [&](const internal::HullTriangle& t) {
    return (points[t[1]] - points[t[0]]).cross(points[t[2]] - points[t[0]]).norm();
  };
  std::stable_sort(triangles.begin(), triangles.end(),
                   [&](const auto& s, const auto& t) { return doubled_area(s) > doubled_area(t); });
  std::vector<int> candidates;
  for (const auto& triangle : triangles)
    candidates.insert(candidates.end(), triangle.begin(), triangle.end());
  std::sort(candidates.begin(), candidates.end());
  candidates.erase(std::unique(candidates.begin(), candidates.end()), candidates.end());

  std::vector<std::vector<int>> faces;
  std::vector<bool> joined(triangles.size(), false);
  for (size_t t = 0; t < triangles.size(); ++t) {
    if (joined[t]) continue;
    const Vector3d& a = points[triangles[t][0]];
    const Vector3d n = (points[triangles[t][1]] - a).cross(points[triangles[t][2]] - a).normalized();
    const std::vector<int> corners = CornersInPlane(points, candidates, triangles[t], tolerance);
    if (corners.size() < 3) return {};
    for (size_t s = t; s < triangles.size(); ++s) {
      const bool within = std::all_of(triangles[s].begin(), triangles[s].end(),
                                      [&](int i) { return std::abs(n.dot(points[i] - a)) <= tolerance; });
      joined[s] = joined[s] || within;
    }
    faces.push_back(corners);
  }
  // Closed: every edge occurs once in each direction, and the numbers of faces, edges and corners are those
  // of a sphere.
  std::map<std::pair<int, int>, int> seen;
  std::vector<int> used;
  for (const std::vector<int>& face : faces) {
    for (size_t i = 0; i < face.size(); ++i) ++seen[{face[i], face[(i + 1) % face.size()]}];
    used.insert(used.end(), face.begin(), face.end());
  }
  std::sort(used.begin(), used.end());
  used.erase(std::unique(used.begin(), used.end()), used.end());
  for (const auto& [edge, count] : seen) {
    if (count != 1 || !seen.contains({edge.second, edge.first})) return {};
  }
  return used.size() + faces.size() == seen.size() / 2 + 2 ? faces : std::vector<std::vector<int>>{};
}

void AddEdges(Polytope* polytope) {
  std::map<std::pair<int, int>, int> left_of;
  for (size_t f = 0; f < polytope->faces.size(); ++f) {
    const std::vector<int>& corners = polytope->faces[f].corners;
    for (size_t i = 0; i < corners.size(); ++i) {
      left_of[{corners[i], corners[(i + 1) % corners.size()]}] = static_cast<int>(f);
    }
  }
  for (const auto& [ends, left] : left_of) {
    if (ends.first > ends.second) continue;
    Polytope::Edge edge;
    edge.from = ends.first;
    edge.to = ends.second;
    edge.left = left;
    edge.right = left_of.at({ends.second, ends.first});
    edge.along = (polytope->vertices[edge.to] - polytope->vertices[edge.from]).normalized();
    const Vector3d& n = polytope->faces[edge.left].normal;
    const Vector3d& m = polytope->faces[edge.right].normal;
    edge.turn = std::atan2(n.cross(m).norm(), n.dot(m));
    polytope->edges.push_back(edge);
  }
}

void AddMass(Polytope* polytope) {
  const Vector3d o = polytope->vertices[0];
  double volume = 0;
  Vector3d moment = Vector3d::Zero();
  Matrix3d second = Matrix3d::Zero();
  for (const Polytope::Face& face : polytope->faces) {
    for (size_t i = 1; i + 1 < face.corners.size(); ++i) {
      const Vector3d a = polytope->vertices[face.corners[0]] - o;
      const Vector3d b = polytope->vertices[face.corners[i]] - o;
      const Vector3d c = polytope->vertices[face.corners[i + 1]] - o;
      const double det = a.dot(b.cross(c));
      const Vector3d sum = a + b + c;
      volume += det / 6;
      moment += det / 24 * sum;
      second +=
          det / 120 * (a * a.transpose() + b * b.transpose() + c * c.transpose() + sum * sum.transpose());
    }
  }
  const Vector3d mean = moment / volume;
  polytope->volume = volume;
  polytope->centroid = o + mean;
  polytope->second_moment = second / volume - mean * mean.transpose();
}

std::shared_ptr<const Polytope> Finish(const std::vector<Vector3d>& points,
                                       const std::vector<std::vector<int>>& faces) {
  auto polytope = std::make_shared<Polytope>();
  std::map<int, int> index;
  for (const std::vector<int>& face : faces) {
    for (const int i : face) index.emplace(i, 0);
  }
  for (auto& [point, vertex] : index) {
    vertex = static_cast<int>(polytope->vertices.size());
    polytope->vertices.push_back(points[point]);
    polytope->radius = std::max(polytope->radius, points[point].norm());
  }
  for (const std::vector<int>& corners : faces) {
    Polytope::Face face;
    Vector3d area = Vector3d::Zero();
    const Vector3d& a = points[corners[0]];
    for (size_t i = 1; i + 1 < corners.size(); ++i) {
      area += (points[corners[i]] - a).cross(points[corners[i + 1]] - a);
    }
    face.normal = area.normalized();
    for (const int i : corners) face.corners.push_back(index.at(i));
    face.offset = -math::kInfinity;
    for (const Vector3d& p : polytope->vertices) face.offset = std::max(face.offset, face.normal.dot(p));
    polytope->faces.push_back(std::move(face));
  }
  AddEdges(polytope.get());
  AddMass(polytope.get());
  return polytope;
}

}  // namespace

HullResult MakeHull(const std::vector<Vector3d>& points, int max_vertices) {
  HullResult result;
  const auto refuse = [&](std::string problem) {
    result.problem = std::move(problem);
    return result;
  };
  if (points.size() < 4) return refuse("are fewer than four");
  if (!std::all_of(points.begin(), points.end(), [](const Vector3d& p) { return p.allFinite(); })) {
    return refuse("are not all finite");
  }
  Vector3d lower = points[0], upper = points[0];
  for (const Vector3d& p : points) {
    lower = lower.cwiseMin(p);
    upper = upper.cwiseMax(p);
  }
  const double extent = (upper - lower).norm();
  if (!(extent >= kLeastExtent)) return refuse("are within a hundredth of a millimetre");
  if (!(std::max(upper.norm(), lower.norm()) <= kGreatestExtent)) return refuse("reach farther than 10 km");
  const internal::TriangulatedHull hull =
      internal::TriangulateHull(points, kHullTolerance * extent, std::min(max_vertices, kMaxHullVertices));
  if (hull.triangles.empty()) return refuse("lie in one plane");

  std::vector<std::vector<int>> faces;
  for (const double tolerance : {2 * kHullTolerance, 1e-9}) {
    if (faces.empty()) faces = JoinTriangles(points, hull.triangles, tolerance * extent);
  }
  if (faces.empty()) {
    for (const internal::HullTriangle& triangle : hull.triangles) {
      faces.emplace_back(triangle.begin(), triangle.end());
    }
  }
  const std::shared_ptr<const Polytope> polytope = Finish(points, faces);
  // The thickness is the least width across a face: a hull as thin as this has no usable inside.
  for (const Polytope::Face& face : polytope->faces) {
    double width = 0;
    for (const Vector3d& p : polytope->vertices) width = std::max(width, face.offset - face.normal.dot(p));
    if (!(width > kFlat * extent)) return refuse("lie in one plane");
  }
  result.hull = Hull{polytope};
  result.left_out = hull.left_out;
  return result;
}

Part CentredPart(const Hull& hull, const math::Pose& X_SP) {
  auto centred = std::make_shared<Polytope>(*hull.polytope);
  const Vector3d shift = centred->centroid;
  centred->radius = 0;
  for (Vector3d& p : centred->vertices) {
    p -= shift;
    centred->radius = std::max(centred->radius, p.norm());
  }
  for (Polytope::Face& face : centred->faces) face.offset -= face.normal.dot(shift);
  centred->centroid.setZero();
  return {Hull{std::move(centred)}, {X_SP.R, X_SP * shift}};
}

Matrix3d UnitInertia(const Primitive& primitive) {
  const auto from_moment = [](const Matrix3d& second) -> Matrix3d {
    return second.trace() * Matrix3d::Identity() - second;
  };
  const auto round = [&](double across, double along) {
    return from_moment(Vector3d(across, across, along).asDiagonal());
  };
  return std::visit(
      Overloaded{
          [&](const Box& box) { return from_moment((box.size.cwiseAbs2() / 12).asDiagonal()); },
          [&](const Sphere& sphere) {
            const double moment = sphere.radius * sphere.radius / 5;
            return round(moment, moment);
          },
          [&](const Capsule& capsule) {
            const double r = capsule.radius, l = capsule.length;
            const double ends = 4.0 / 3 * r / (l + 4.0 / 3 * r);  // the share of the two half balls
            const double along = 0.25 * l * l + 0.375 * l * r + 0.2 * r * r;
            return round((1 - ends) * r * r / 4 + ends * r * r / 5, (1 - ends) * l * l / 12 + ends * along);
          },
          [&](const Cylinder& cylinder) {
            return round(0.25 * cylinder.radius * cylinder.radius, cylinder.length * cylinder.length / 12);
          },
          [&](const Hull& hull) { return from_moment(hull.polytope->second_moment); }},
      primitive);
}

}  // namespace tether::geometry
