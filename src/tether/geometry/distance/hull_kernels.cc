#include <algorithm>

#include <Eigen/Geometry>

#include "tether/geometry/distance/core.h"
#include "tether/geometry/distance/gjk.h"
#include "tether/geometry/distance/normal_search.h"
#include "tether/geometry/hull/polytope.h"
#include "tether/math/infinity.h"

namespace tether::geometry::internal {
namespace {

using Eigen::Vector3d;

/// Below this the difference of two witness points does not define the normal accurately, m.
constexpr double kTouching = 1e-9;
constexpr int kMostFaces = 2 * kMaxHullVertices;

const Polytope& UnitBox() {
  static const Hull box = [] {
    std::vector<Vector3d> corners;
    for (int i = 0; i < 8; ++i) corners.emplace_back(i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1);
    return *MakeHull(corners).hull;
  }();
  return *box.polytope;
}

/// Faces and edges of a core in the frame of A. A box is the unit box, stretched: normals and directions
/// stay. A segment has no faces and one edge, with normals all round.
class Outline {
 public:
  Outline(const Core& core, const math::Pose& X) : X_(X) {
    if (core.kind == Core::Kind::kSegment) return;
    polytope_ = core.kind == Core::Kind::kHull ? core.hull : &UnitBox();
    if (core.kind == Core::Kind::kBox) stretch_ = core.half;
  }
  int faces() const { return polytope_ ? static_cast<int>(polytope_->faces.size()) : 0; }
  int edges() const { return polytope_ ? static_cast<int>(polytope_->edges.size()) : 1; }
  bool segment() const { return polytope_ == nullptr; }
  Vector3d normal(int face) const { return X_.R * polytope_->faces[face].normal; }
  const Polytope::Edge& edge(int i) const { return polytope_->edges[i]; }
  Vector3d along(int i) const { return segment() ? Vector3d(X_.R.col(2)) : Vector3d(X_.R * edge(i).along); }
  Vector3d point(int i) const {
    return segment() ? X_.p : X_ * polytope_->vertices[edge(i).from].cwiseProduct(stretch_);
  }

 private:
  const math::Pose& X_;
  const Polytope* polytope_ = nullptr;
  Vector3d stretch_ = Vector3d::Ones();
};

/// The outward normals of a core's faces, turned to point from A to B, with the support differences there.
struct FaceSamples {
  std::array<Vector3d, kMostFaces> n, g;

  void Take(const Query& query, const Outline& outline, double sign) {
    for (int f = 0; f < outline.faces(); ++f) {
      n[f] = sign * outline.normal(f);
      g[f] = SupportDifference(query, n[f]);
    }
  }
};

/// An edge that may hold the normal of greatest separation: its arc between the normals of its faces.
struct Arc {
  Vector3d from, to, along, point;
};
struct Arcs {
  std::array<Arc, 3 * kMaxHullVertices> list;
  int size = 0;

  /// Those on whose arcs the separation may be above `floor`.
  void Take(const Outline& outline, const FaceSamples& samples, double sign, double floor) {
    if (outline.segment()) return;
    for (int i = 0; i < outline.edges(); ++i) {
      const Polytope::Edge& edge = outline.edge(i);
      const Vector3d& from = samples.n[edge.left];
      const Vector3d& to = samples.n[edge.right];
      if (BoundOnArc(from, samples.g[edge.left], to, samples.g[edge.right], edge.turn) <= floor) continue;
      list[size++] = {from, to, sign * outline.along(i), outline.point(i)};
    }
  }
};

void TryFaces(const Outline& outline, const FaceSamples& samples, BestNormal* best) {
  for (int f = 0; f < outline.faces(); ++f) {
    if (samples.g[f].dot(samples.n[f]) > best->separation() - kTie) best->Try(samples.n[f], 0);
  }
}

/// The normal across two edges, where their arcs cross: only there do the edges make a face of the Minkowski
/// difference.
void TryCrossing(const Arc& a, const Arc& b, BestNormal* best) {
  const double a_from = a.from.dot(b.along), a_to = a.to.dot(b.along);
  if (a_from * a_to > 0) return;
  const double b_from = b.from.dot(a.along), b_to = b.to.dot(a.along);
  if (b_from * b_to > 0) return;
  Vector3d n = a.along.cross(b.along);
  const double sine = n.norm();
  if (!(sine > 10 * kParallel)) return;
  n /= n.dot(a.from + a.to) >= 0 ? sine : -sine;
  if (!(n.dot(b.from + b.to) > 0)) return;
  if (n.dot(b.point - a.point) > best->separation() - kTie) best->Try(n, 1);
}

/// The same for a segment, whose arc is a whole circle.
void TryCrossing(const Vector3d& along, const Vector3d& point, const Arc& b, BestNormal* best) {
  if (b.from.dot(along) * b.to.dot(along) > 0) return;
  Vector3d n = along.cross(b.along);
  const double sine = n.norm();
  if (!(sine > 10 * kParallel)) return;
  n /= n.dot(b.from + b.to) >= 0 ? sine : -sine;
  if (n.dot(b.point - point) > best->separation() - kTie) best->Try(n, 1);
}

/// Two polytopes that overlap or touch: the normal is that of a face of the Minkowski difference.
Gap Overlap(const Query& query, const Outline& a, const Outline& b) {
  BestNormal best(query);
  FaceSamples of_a, of_b;
  of_a.Take(query, a, 1);
  of_b.Take(query, b, -1);
  TryFaces(a, of_a, &best);
  TryFaces(b, of_b, &best);
  Arcs arcs_a, arcs_b;
  arcs_a.Take(a, of_a, 1, best.separation());
  arcs_b.Take(b, of_b, -1, best.separation());
  for (int j = 0; j < arcs_b.size; ++j) {
    if (a.segment()) TryCrossing(a.along(0), a.point(0), arcs_b.list[j], &best);
    for (int i = 0; i < arcs_a.size; ++i) TryCrossing(arcs_a.list[i], arcs_b.list[j], &best);
  }
  Gap gap;
  WitnessPointsAlong(query, best.n(), &gap);
  return gap;
}

/// Finds the face whose normal equals the direction between the nearest points, up to rounding.
bool SnapToFace(const Query& query, const Outline& outline, double sign, const Vector3d& n, double distance,
                Gap* gap) {
  for (int f = 0; f < outline.faces(); ++f) {
    const Vector3d normal = sign * outline.normal(f);
    if (normal.dot(n) < 1 - 1e-6) continue;
    if (query.Separation(normal) < distance - kTie) continue;
    WitnessPointsAlong(query, normal, gap);
    return true;
  }
  return false;
}

Gap PolytopePolytope(const Query& query) {
  const math::Pose X_AA;
  const Outline a(query.a, X_AA);
  const Outline b(query.b, query.X_AB);
  const Apart apart = FindApart(query);
  const Vector3d between = apart.p_B - apart.p_A;
  const double distance = between.norm();
  if (!apart.apart || distance <= kTouching) return Overlap(query, a, b);
  const Vector3d n = between / distance;
  Gap gap;
  if (SnapToFace(query, a, 1, n, distance, &gap) || SnapToFace(query, b, -1, n, distance, &gap)) return gap;
  // Parallel edges: the middle of where they lie side by side.
  const double miss = WitnessPointsAlong(query, n, &gap);
  if (miss <= 1e-9 && gap.distance >= distance - kTie) return gap;
  return {distance, apart.p_A, apart.p_B, n};
}

Vector3d NearestOnSegment(const Vector3d& a, const Vector3d& b, const Vector3d& q) {
  const Vector3d d = b - a;
  return a + std::clamp((q - a).dot(d) / d.squaredNorm(), 0.0, 1.0) * d;
}

/// The nearest point to q of a face.
Vector3d NearestOnFace(const Polytope& hull, const Polytope::Face& face, const Vector3d& q) {
  const Vector3d p = q - (face.normal.dot(q) - face.offset) * face.normal;
  bool inside = true;
  double least = math::kInfinity;
  Vector3d nearest = p;
  for (size_t i = 0; i < face.corners.size(); ++i) {
    const Vector3d& a = hull.vertices[face.corners[i]];
    const Vector3d& b = hull.vertices[face.corners[(i + 1) % face.corners.size()]];
    if (face.normal.dot((b - a).cross(p - a)) >= 0) continue;
    inside = false;
    const Vector3d foot = NearestOnSegment(a, b, q);
    if ((foot - q).squaredNorm() >= least) continue;
    least = (foot - q).squaredNorm();
    nearest = foot;
  }
  return inside ? p : nearest;
}

/// A hull's witness point on one of its edges, for a cylinder and a hull that are apart; false where it is
/// not certain.
bool ApartAtEdge(const Query& query, Gap* gap) {
  const math::Pose& X = query.X_AB;
  const double radius = query.a.disc;
  const double half = query.a.half.z();
  double nearest2 = math::kInfinity;
  for (const Polytope::Edge& edge : query.b.hull->edges) {
    const Vector3d start = X * query.b.hull->vertices[edge.from];
    const Vector3d along = X * query.b.hull->vertices[edge.to] - start;
    const Vector3d middle = start + 0.5 * along;
    const double bound = (middle - NearestOfCylinder(radius, half, middle)).norm() - 0.5 * along.norm();
    if (bound > 0 && bound * bound >= nearest2) continue;
    const Vector3d q = start + NearestParameterToCylinder(radius, half, start, along) * along;
    const Vector3d foot = NearestOfCylinder(radius, half, q);
    if ((q - foot).squaredNorm() >= nearest2) continue;
    nearest2 = (q - foot).squaredNorm();
    gap->p_A = foot;
    gap->p_B = q;
  }
  // All edges may stay clear although the cylinder pierces a face: ask for a normal that tells them apart.
  if (nearest2 > 1e-16) {
    const double distance = std::sqrt(nearest2);
    const Vector3d n = (gap->p_B - gap->p_A) / distance;
    if (query.Separation(n) > 0) {
      *gap = {distance, gap->p_A, gap->p_B, n};
      return true;
    }
  }
  return false;
}

}  // namespace

Foot FootOnHull(const Polytope& hull, const Vector3d& q, const Vector3d& up) {
  Foot foot;
  foot.distance = -math::kInfinity;
  double best_up = 0;
  for (const Polytope::Face& face : hull.faces) {
    const double distance = face.normal.dot(q) - face.offset;
    const double n_up = face.normal.dot(up);
    if (distance < foot.distance - kTie) continue;
    if (distance <= foot.distance + kTie && n_up <= best_up + 1e-9) continue;
    foot.distance = distance;
    foot.n = face.normal;
    best_up = n_up;
  }
  foot.p = q - foot.distance * foot.n;
  if (foot.distance <= kTouching) return foot;
  double least = math::kInfinity;
  for (const Polytope::Face& face : hull.faces) {
    const double height = face.normal.dot(q) - face.offset;
    if (height <= 0 || height >= least) continue;
    const Vector3d p = NearestOnFace(hull, face, q);
    const double distance = (q - p).norm();
    if (distance >= least) continue;
    least = distance;
    foot.p = p;
  }
  foot.distance = least;
  foot.n = (q - foot.p) / least;
  return foot;
}

Gap PointHull(const Query& query) {
  const Foot foot = FootOnHull(*query.b.hull, -(query.X_AB.R.transpose() * query.X_AB.p),
                               -(query.X_AB.R.transpose() * query.up_A));
  return {foot.distance, Vector3d::Zero(), query.X_AB * foot.p, -(query.X_AB.R * foot.n)};
}

Gap SegmentHull(const Query& query) { return PolytopePolytope(query); }
Gap BoxHull(const Query& query) { return PolytopePolytope(query); }
Gap HullHull(const Query& query) { return PolytopePolytope(query); }

Gap CylinderHull(const Query& query) {
  const math::Pose& X = query.X_AB;
  const Outline outline(query.b, X);
  BestNormal best(query);
  FaceSamples samples;
  samples.Take(query, outline, -1);
  TryFaces(outline, samples, &best);
  best.Try(Vector3d::UnitZ(), 0);
  best.Try(-Vector3d::UnitZ(), 0);
  Gap gap;
  const double miss = WitnessPointsAlong(query, best.n(), &gap);
  if (gap.distance > 0 && miss <= kTouching) return gap;

  // Apart, with no witness inside a face: then the hull's lies on one of its edges.
  if ((gap.distance > 0 || !SurelyOverlap(query)) && ApartAtEdge(query, &gap)) return gap;

  TryCircle(query, Vector3d::UnitZ(), &best);
  for (const Polytope::Edge& edge : query.b.hull->edges) {
    const Vector3d& from = samples.n[edge.left];
    const Vector3d& to = samples.n[edge.right];
    if (BoundOnArc(from, samples.g[edge.left], to, samples.g[edge.right], edge.turn) <= best.separation()) {
      continue;
    }
    const Vector3d crossed = (X.R * edge.along).cross(Vector3d::UnitZ());
    if (crossed.norm() > 10 * kParallel) {
      best.Try(crossed.normalized(), 1);
      best.Try(-crossed.normalized(), 1);
    }
    TryArc(query, from, to, &best);
  }
  WitnessPointsAlong(query, best.n(), &gap);
  return gap;
}

}  // namespace tether::geometry::internal
