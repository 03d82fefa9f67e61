#include "tether/geometry/distance/core.h"

#include <algorithm>
#include <numbers>

#include <Eigen/Geometry>

#include "tether/geometry/hull/polytope.h"
#include "tether/math/infinity.h"

namespace tether::geometry::internal {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

double Cross(const Vector2d& a, const Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); }

/// A convex polygon in the plane, possibly a point or a segment. Clipping adds at most one vertex per edge.
struct Flat {
  std::array<Vector2d, 2 * Feature::kMaxPoints> points;
  int size = 0;

  Flat() = default;
  Flat(const Flat& other) { *this = other; }
  Flat& operator=(const Flat& other) {
    size = other.size;
    std::copy_n(other.points.begin(), size, points.begin());
    return *this;
  }
};

Vector2d NearestOnSegment(const Vector2d& a, const Vector2d& b, const Vector2d& q) {
  const Vector2d d = b - a;
  const double length2 = d.squaredNorm();
  return length2 > 0 ? Vector2d(a + std::clamp((q - a).dot(d) / length2, 0.0, 1.0) * d) : a;
}

/// The nearest point to q of a convex polygon (counter-clockwise if it has three or more points).
Vector2d NearestOnFlat(const Flat& flat, const Vector2d& q) {
  if (flat.size == 1) return flat.points[0];
  if (flat.size == 2) return NearestOnSegment(flat.points[0], flat.points[1], q);
  bool inside = true;
  Vector2d best = q;
  double best2 = math::kInfinity;
  for (int i = 0; i < flat.size; ++i) {
    const Vector2d& a = flat.points[i];
    const Vector2d& b = flat.points[(i + 1) % flat.size];
    if (Cross(b - a, q - a) < 0) inside = false;
    const Vector2d foot = NearestOnSegment(a, b, q);
    if ((foot - q).squaredNorm() < best2) {
      best2 = (foot - q).squaredNorm();
      best = foot;
    }
  }
  return inside ? q : best;
}

/// Cuts `flat` to the left of the line from a to b.
void Clip(const Vector2d& a, const Vector2d& b, Flat* flat) {
  const Vector2d along = (b - a).normalized();
  Flat cut;
  for (int i = 0; i < flat->size; ++i) {
    const Vector2d& p = flat->points[i];
    const Vector2d& q = flat->points[(i + 1) % flat->size];
    const double side_p = Cross(along, p - a);
    const double side_q = Cross(along, q - a);
    if (side_p >= 0) cut.points[cut.size++] = p;
    if ((side_p > 0 && side_q < 0) || (side_p < 0 && side_q > 0)) {
      // A segment has one edge, which the loop over vertices walks twice.
      if (flat->size != 2 || i == 0) cut.points[cut.size++] = p + (q - p) * (side_p / (side_p - side_q));
    }
  }
  *flat = cut;
}

Vector2d Centre(const Flat& flat) {
  double area = 0;
  Vector2d moment = Vector2d::Zero();
  const Vector2d& o = flat.points[0];
  double diameter2 = 0;
  Vector2d middle = o;
  for (int i = 0; i < flat.size; ++i) {
    for (int j = i + 1; j < flat.size; ++j) {
      const double length2 = (flat.points[i] - flat.points[j]).squaredNorm();
      if (length2 > diameter2) {
        diameter2 = length2;
        middle = 0.5 * (flat.points[i] + flat.points[j]);
      }
    }
    if (i >= 1 && i + 1 < flat.size) {
      const Vector2d u = flat.points[i] - o;
      const Vector2d v = flat.points[i + 1] - o;
      area += Cross(u, v);
      moment += Cross(u, v) * (u + v) / 3.0;
    }
  }
  if (std::abs(area) > 1e-12 * diameter2 && diameter2 > 1e-20) return o + moment / area;
  return middle;
}

/// The centre of the overlap of two flat features; `miss` is how far they are from touching.
Vector2d OverlapCentre(const Flat& first, const Flat& second, double* miss) {
  *miss = 0;
  const Flat& a = first.size >= second.size ? first : second;
  const Flat& b = first.size >= second.size ? second : first;
  if (b.size == 1) {
    const Vector2d foot = NearestOnFlat(a, b.points[0]);
    *miss = (foot - b.points[0]).norm();
    return foot;
  }
  if (a.size >= 3) {
    Flat cut = b;
    for (int i = 0; i < a.size && cut.size > 0; ++i) Clip(a.points[i], a.points[(i + 1) % a.size], &cut);
    if (cut.size > 0) return Centre(cut);
  } else {
    const Vector2d u = a.points[1] - a.points[0];
    const Vector2d v = b.points[1] - b.points[0];
    const Vector2d w = b.points[0] - a.points[0];
    const double scale = u.norm() * v.norm();
    const double cross = Cross(u, v);
    if (std::abs(cross) <= 2 * kParallel * scale) {
      const double length = u.norm();
      const Vector2d along = u / length;
      const double s0 = w.dot(along);
      const double s1 = s0 + v.dot(along);
      const double lower = std::max(0.0, std::min(s0, s1));
      const double upper = std::min(length, std::max(s0, s1));
      if (lower <= upper) {
        *miss = std::abs(Cross(along, w));
        return a.points[0] + 0.5 * (lower + upper) * along;
      }
    } else {
      const double s = Cross(w, v) / cross;
      const double t = Cross(w, u) / cross;
      if (s >= 0 && s <= 1 && t >= 0 && t <= 1) return a.points[0] + s * u;
    }
  }
  // No overlap: the nearest vertex and foot.
  double best = math::kInfinity;
  Vector2d centre = a.points[0];
  for (int side = 0; side < 2; ++side) {
    const Flat& from = side == 0 ? a : b;
    const Flat& to = side == 0 ? b : a;
    for (int i = 0; i < from.size; ++i) {
      const Vector2d foot = NearestOnFlat(to, from.points[i]);
      const double gap = (foot - from.points[i]).norm();
      if (gap < best) {
        best = gap;
        centre = 0.5 * (foot + from.points[i]);
      }
    }
  }
  *miss = best;
  return centre;
}

/// The middle of the overlap of two discs.
Vector2d LensCentre(const Vector2d& a, double radius_a, const Vector2d& b, double radius_b, double* miss) {
  const double apart = (b - a).norm();
  if (!(apart > 0)) return a;
  const double lower = std::max(-radius_a, apart - radius_b);
  const double upper = std::min(radius_a, apart + radius_b);
  *miss = std::max(0.0, lower - upper);
  return a + (b - a) * (0.5 * (lower + upper) / apart);
}

Flat Project(const Feature& feature, const Vector3d& u, const Vector3d& v) {
  Flat flat;
  flat.size = feature.size;
  for (int i = 0; i < feature.size; ++i) {
    flat.points[i] = {u.dot(feature.points[i]), v.dot(feature.points[i])};
  }
  double area = 0;
  for (int i = 0; i < flat.size; ++i) area += Cross(flat.points[i], flat.points[(i + 1) % flat.size]);
  if (flat.size >= 3 && area < 0) std::reverse(flat.points.begin(), flat.points.begin() + flat.size);
  return flat;
}

/// The corners that are extreme along d: those of a face whose normal d is, to within kParallel, or the ends
/// of an edge that d is at right angles to, or one.
void ExtremeFeatureOfHull(const Polytope& hull, const math::Pose& X, const Vector3d& d, Feature* feature) {
  for (const Polytope::Face& face : hull.faces) {
    if (face.normal.dot(d) < 0.9 || face.normal.cross(d).norm() > kParallel) continue;
    const size_t count = face.corners.size();
    feature->size = std::min(static_cast<int>(count), Feature::kMaxPoints);
    for (int i = 0; i < feature->size; ++i) {
      feature->points[i] = X * hull.vertices[face.corners[i * count / feature->size]];
    }
    return;
  }
  int top = 0;
  for (size_t i = 1; i < hull.vertices.size(); ++i) {
    if (d.dot(hull.vertices[i]) > d.dot(hull.vertices[top])) top = static_cast<int>(i);
  }
  feature->size = 1;
  feature->points[0] = X * hull.vertices[top];
  for (const Polytope::Edge& edge : hull.edges) {
    if ((edge.from != top && edge.to != top) || std::abs(d.dot(edge.along)) > kParallel) continue;
    feature->size = 2;
    feature->points[1] = X * hull.vertices[edge.from == top ? edge.to : edge.from];
    break;
  }
}

}  // namespace

double Core::SupportOfHull(const Vector3d& d) const {
  double greatest = -math::kInfinity;
  for (const Vector3d& p : hull->vertices) greatest = std::max(greatest, d.dot(p));
  return greatest;
}

Vector3d Core::SupportPoint(const Vector3d& d) const {
  if (disc < 0) {
    const Vector3d* best = &hull->vertices[0];
    double greatest = d.dot(*best);
    for (const Vector3d& p : hull->vertices) {
      const double there = d.dot(p);
      if (there <= greatest) continue;
      greatest = there;
      best = &p;
    }
    return *best;
  }
  Vector3d p(d.x() >= 0 ? half.x() : -half.x(), d.y() >= 0 ? half.y() : -half.y(),
             d.z() >= 0 ? half.z() : -half.z());
  const double across = std::sqrt(d.x() * d.x() + d.y() * d.y());
  if (disc > 0 && across > 0) {
    p.x() += disc * d.x() / across;
    p.y() += disc * d.y() / across;
  }
  return p;
}

Core MakeCore(const Primitive& primitive) {
  Core core;
  if (const auto* box = std::get_if<Box>(&primitive)) {
    core.kind = Core::Kind::kBox;
    core.half = 0.5 * box->size;
  } else if (const auto* sphere = std::get_if<Sphere>(&primitive)) {
    core.rounding = sphere->radius;
  } else if (const auto* capsule = std::get_if<Capsule>(&primitive)) {
    core.kind = capsule->length > 0 ? Core::Kind::kSegment : Core::Kind::kPoint;
    core.half.z() = 0.5 * capsule->length;
    core.rounding = capsule->radius;
  } else if (const auto* hull = std::get_if<Hull>(&primitive)) {
    core.kind = Core::Kind::kHull;
    core.disc = -1;
    core.hull = hull->polytope.get();
  } else {
    const auto& cylinder = std::get<Cylinder>(primitive);
    core.kind = Core::Kind::kCylinder;
    core.half.z() = 0.5 * cylinder.length;
    core.disc = cylinder.radius;
  }
  return core;
}

Feature ExtremeFeature(const Core& core, const math::Pose& X, const Vector3d& n) {
  const Vector3d d = X.R.transpose() * n;
  Feature feature;
  if (core.disc < 0) {
    ExtremeFeatureOfHull(*core.hull, X, d, &feature);
    return feature;
  }
  const double across = std::sqrt(d.x() * d.x() + d.y() * d.y());
  if (core.disc > 0 && across <= kParallel) {
    feature.size = Feature::kDiscPoints;
    for (int i = 0; i < feature.size; ++i) {
      const double angle = 2 * std::numbers::pi * i / feature.size;
      feature.points[i] = X * Vector3d(core.disc * std::cos(angle), core.disc * std::sin(angle),
                                       d.z() > 0 ? core.half.z() : -core.half.z());
    }
    return feature;
  }
  feature.size = 1;
  feature.points[0] = core.SupportPoint(d);
  for (int axis = 0; axis < 3; ++axis) {
    if (core.half[axis] <= 0 || std::abs(d[axis]) > kParallel || feature.size > 2) continue;
    // The new points come in reverse order, so that four points are in order around the rectangle.
    for (int i = feature.size - 1, end = 2 * feature.size; feature.size < end; --i) {
      feature.points[feature.size] = feature.points[i];
      feature.points[feature.size++][axis] *= -1;
    }
  }
  for (int i = 0; i < feature.size; ++i) feature.points[i] = X * feature.points[i];
  return feature;
}

double WitnessPointsAlong(const Query& query, const Vector3d& n, Gap* gap) {
  const Feature a = ExtremeFeature(query.a, math::Pose(), n);
  const Feature b = ExtremeFeature(query.b, query.X_AB, -n);
  gap->distance = query.Separation(n);
  gap->n = n;
  double miss = 0;
  if (a.size == 1 && b.size == 1) {
    const Vector3d between = b.points[0] - a.points[0];
    miss = (between - between.dot(n) * n).norm();
    gap->p_A = a.points[0];
  } else {
    const Vector3d u = n.unitOrthogonal();
    const Vector3d v = n.cross(u);
    const auto across = [&](const Vector3d& p) { return Vector2d(u.dot(p), v.dot(p)); };
    const bool disc_a = query.a.disc > 0 && a.size == Feature::kDiscPoints;
    const bool disc_b = query.b.disc > 0 && b.size == Feature::kDiscPoints;
    Vector2d centre;
    if (disc_a && disc_b) {
      centre = LensCentre(Vector2d::Zero(), query.a.disc, across(query.X_AB.p), query.b.disc, &miss);
    } else {
      const Flat flat_a = Project(a, u, v);
      const Flat flat_b = Project(b, u, v);
      centre = OverlapCentre(flat_a, flat_b, &miss);
      if (miss > 0 && (disc_a || disc_b)) {
        // The overlap may lie between the circle and the polygon inscribed in it.
        const Vector2d middle = disc_a ? Vector2d::Zero() : across(query.X_AB.p);
        centre = NearestOnFlat(disc_a ? flat_b : flat_a, middle);
        miss = std::max(0.0, (centre - middle).norm() - (disc_a ? query.a.disc : query.b.disc));
      }
    }
    gap->p_A = centre.x() * u + centre.y() * v + query.a.Support(n) * n;
  }
  gap->p_B = gap->p_A + gap->distance * n;
  return miss;
}

void BestNormal::Try(const Vector3d& n, int rank) {
  const double separation = query_.Separation(n);
  const double up = n.dot(query_.up_A);
  if (!(separation > separation_ - kTie)) return;
  const bool same =
      n.dot(n_) > 0.999;  // nearly the same normal is no tie: the better one is the more accurate
  if (same && rank == rank_ && separation <= separation_) return;
  if (!same && separation <= separation_ + kTie && (rank > rank_ || (rank == rank_ && up <= up_ + 1e-9)))
    return;
  if (same && rank > rank_ && separation <= separation_ + kTie) return;
  n_ = n;
  separation_ = separation;
  up_ = up;
  rank_ = rank;
}

Vector3d UpAcross(const Vector3d& d, const Vector3d& up) {
  const double length = d.norm();
  if (!(length > 0)) return up;
  const Vector3d axis = d / length;
  const Vector3d across = up - up.dot(axis) * axis;
  const double norm = across.norm();
  return norm > 1e-9 ? Vector3d(across / norm) : axis.unitOrthogonal();
}

}  // namespace tether::geometry::internal
