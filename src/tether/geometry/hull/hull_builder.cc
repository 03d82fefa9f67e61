#include "tether/geometry/hull/hull_builder.h"

#include <algorithm>
#include <map>
#include <utility>

#include <Eigen/Geometry>

namespace tether::geometry::internal {
namespace {

using Eigen::Vector3d;

struct Facet {
  HullTriangle corners;
  Vector3d normal;
  double offset = 0;
  bool alive = true;
  std::vector<int> outside;  // points above it
};

class Builder {
 public:
  Builder(const std::vector<Vector3d>& points, double tolerance) : points_(points), tolerance_(tolerance) {
    for (const Vector3d& p : points) middle_ += p / static_cast<double>(points.size());
  }

  bool StartWithTetrahedron() {
    std::vector<int> all(points_.size());
    for (size_t i = 0; i < all.size(); ++i) all[i] = static_cast<int>(i);
    const int a = Farthest(all, [&](int i) { return (points_[i] - middle_).norm(); });
    const int b = Farthest(all, [&](int i) { return (points_[i] - points_[a]).norm(); });
    const Vector3d along = (points_[b] - points_[a]).normalized();
    const int c = Farthest(all, [&](int i) { return (points_[i] - points_[a]).cross(along).norm(); });
    const Vector3d normal = (points_[b] - points_[a]).cross(points_[c] - points_[a]).normalized();
    const int d = Farthest(all, [&](int i) { return std::abs(normal.dot(points_[i] - points_[a])); });
    const double height = normal.dot(points_[d] - points_[a]);
    if (!(std::abs(height) > tolerance_)) return false;
    const HullTriangle base = height < 0 ? HullTriangle{a, b, c} : HullTriangle{a, c, b};
    AddFacet(base);
    for (int i = 0; i < 3; ++i) AddFacet({base[(i + 1) % 3], base[i], d});
    for (const int i : all) Assign(i, 0);
    vertices_ = 4;
    return true;
  }

  /// Returns how far out the farthest point is that is not a corner yet; adds it if that is too far.
  double Grow(bool add) {
    double farthest = 0;
    for (const Facet& facet : facets_) {
      for (const int i : facet.outside) farthest = std::max(farthest, Height(facet, i));
    }
    if (!(farthest > tolerance_) || !add) return farthest;
    // Of those that are as far out, the one farthest from the middle: a true corner, never within an edge.
    int chosen = -1, from = -1;
    double reach = -1;
    for (size_t f = 0; f < facets_.size(); ++f) {
      for (const int i : facets_[f].outside) {
        if (Height(facets_[f], i) < farthest - 0.01 * tolerance_) continue;
        if ((points_[i] - middle_).norm() <= reach) continue;
        reach = (points_[i] - middle_).norm();
        chosen = i;
        from = static_cast<int>(f);
      }
    }
    AddPoint(chosen, from);
    return farthest;
  }

  int vertices() const { return vertices_; }

  std::vector<HullTriangle> Triangles() const {
    std::vector<HullTriangle> triangles;
    for (const Facet& facet : facets_) triangles.push_back(facet.corners);
    return triangles;
  }

 private:
  template <class Measure>
  int Farthest(const std::vector<int>& candidates, const Measure& measure) const {
    double most = -1;
    for (const int i : candidates) most = std::max(most, measure(i));
    int best = candidates.front();
    double reach = -1;
    for (const int i : candidates) {
      if (measure(i) < most - 0.01 * tolerance_) continue;
      if ((points_[i] - middle_).norm() <= reach) continue;
      reach = (points_[i] - middle_).norm();
      best = i;
    }
    return best;
  }

  double Height(const Facet& facet, int i) const { return facet.normal.dot(points_[i]) - facet.offset; }

  void AddFacet(const HullTriangle& corners) {
    Facet facet;
    facet.corners = corners;
    const Vector3d& a = points_[corners[0]];
    facet.normal = (points_[corners[1]] - a).cross(points_[corners[2]] - a).normalized();
    facet.offset = (facet.normal.dot(a) + facet.normal.dot(points_[corners[1]]) +
                    facet.normal.dot(points_[corners[2]])) /
                   3;
    for (int i = 0; i < 3; ++i) {
      across_[{corners[i], corners[(i + 1) % 3]}] = static_cast<int>(facets_.size());
    }
    facets_.push_back(std::move(facet));
  }

  /// Gives a point to the facet, of those from `first` on, that it is farthest above.
  void Assign(int i, size_t first) {
    int best = -1;
    double most = 0.01 * tolerance_;
    for (size_t f = first; f < facets_.size(); ++f) {
      const double height = Height(facets_[f], i);
      if (height <= most) continue;
      most = height;
      best = static_cast<int>(f);
    }
    if (best >= 0) facets_[best].outside.push_back(i);
  }

  void AddPoint(int point, int from) {
    // The facets that the point sees, spreading from the first, and the edges around them.
    std::vector<int> seen = {from};
    std::vector<std::pair<int, int>> horizon;
    facets_[from].alive = false;
    for (size_t k = 0; k < seen.size(); ++k) {
      const HullTriangle corners = facets_[seen[k]].corners;
      for (int i = 0; i < 3; ++i) {
        const std::pair<int, int> edge(corners[i], corners[(i + 1) % 3]);
        const int other = across_.at({edge.second, edge.first});
        if (!facets_[other].alive) continue;
        if (Height(facets_[other], point) > 0.01 * tolerance_) {
          facets_[other].alive = false;
          seen.push_back(other);
        } else {
          horizon.push_back(edge);
        }
      }
    }
    // A facet found later may have been an edge's other side before.
    std::erase_if(horizon, [&](const auto& edge) {
      return !facets_[across_.at({edge.second, edge.first})].alive;
    });
    std::vector<int> orphans;
    for (const int f : seen) {
      for (const int i : facets_[f].outside) {
        if (i != point) orphans.push_back(i);
      }
      for (int i = 0; i < 3; ++i) across_.erase({facets_[f].corners[i], facets_[f].corners[(i + 1) % 3]});
    }
    const size_t first = facets_.size();
    for (const auto& [a, b] : horizon) AddFacet({a, b, point});
    for (const int i : orphans) Assign(i, first);
    Compact();
    vertices_ = CountVertices();
  }

  void Compact() {
    std::vector<Facet> kept;
    across_.clear();
    for (Facet& facet : facets_) {
      if (!facet.alive) continue;
      for (int i = 0; i < 3; ++i) {
        across_[{facet.corners[i], facet.corners[(i + 1) % 3]}] = static_cast<int>(kept.size());
      }
      kept.push_back(std::move(facet));
    }
    facets_ = std::move(kept);
  }

  int CountVertices() const { return static_cast<int>(facets_.size()) / 2 + 2; }  // Euler

  const std::vector<Vector3d>& points_;
  double tolerance_;
  Vector3d middle_ = Vector3d::Zero();
  std::vector<Facet> facets_;
  std::map<std::pair<int, int>, int> across_;  // directed edge → facet to its left
  int vertices_ = 0;
};

}  // namespace

TriangulatedHull TriangulateHull(const std::vector<Vector3d>& points, double tolerance, int max_vertices) {
  TriangulatedHull hull;
  if (points.size() < 4) return hull;
  Builder builder(points, tolerance);
  if (!builder.StartWithTetrahedron()) return hull;
  do {
    hull.left_out = builder.Grow(builder.vertices() < max_vertices);
  } while (hull.left_out > tolerance && builder.vertices() < max_vertices);
  hull.left_out = builder.Grow(false);
  hull.triangles = builder.Triangles();
  return hull;
}

}  // namespace tether::geometry::internal
