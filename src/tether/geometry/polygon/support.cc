#include "tether/geometry/polygon/support.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>

#include <Eigen/Geometry>

#include "tether/geometry/distance/core.h"
#include "tether/geometry/hull/polytope.h"
#include "tether/geometry/input_tolerance.h"
#include "tether/math/infinity.h"

namespace tether::geometry {
namespace {

using Eigen::Vector3d;
using internal::Core;

/// A plane supports what reaches beyond it by this, m: rounding of the arithmetic.
constexpr double kSupporting = 1e-7;
/// Corners of a facet this near to the line between their neighbours are left out, m.
constexpr double kStraight = 1e-7;
constexpr int kDiscVertices = 32;

/// An element that a flat face can touch: a corner with a ball around it, or a rim; in the shape's frame.
struct Element {
  Vector3d centre;
  double ball = 0;
  double rim = 0;
  Vector3d axis = Vector3d::UnitZ();

  Vector3d SupportPoint(const Vector3d& n) const {
    const Vector3d across = n - n.dot(axis) * axis;
    const double length = across.norm();
    return centre + ball * n + (rim > 0 && length > 0 ? Vector3d(rim / length * across) : Vector3d::Zero());
  }
};

std::vector<Element> Elements(const Shape& shape) {
  std::vector<Element> elements;
  for (const Part& part : shape.parts) {
    const Core core = internal::MakeCore(part.primitive);
    if (core.hull != nullptr) {
      for (const Vector3d& p : core.hull->vertices) elements.push_back({part.X_SP * p});
      continue;
    }
    for (int corner = 0; corner < 8; ++corner) {
      Vector3d p;
      bool repeated = false;
      for (int axis = 0; axis < 3; ++axis) {
        const bool positive = (corner >> axis) & 1;
        p[axis] = positive ? core.half[axis] : -core.half[axis];
        if (positive && core.half[axis] <= 0) repeated = true;
      }
      if (!repeated) elements.push_back({part.X_SP * p, core.rounding, core.disc, part.X_SP.R.col(2)});
    }
  }
  return elements;
}

/// The unit normal, on the side of `n`, of the plane that supports all three elements; zero if there is none.
Vector3d CommonNormal(const Element& a, const Element& b, const Element& c, Vector3d n) {
  for (int i = 0; i < 60; ++i) {
    const Vector3d p = a.SupportPoint(n);
    Vector3d next = (b.SupportPoint(n) - p).cross(c.SupportPoint(n) - p);
    const double length = next.norm();
    if (!(length > 1e-10)) return Vector3d::Zero();
    next /= next.dot(n) >= 0 ? length : -length;
    const double change = (next - n).norm();
    n = next;
    if (change < 1e-13) break;
  }
  return n;
}

/// No element reaches beyond the plane.
bool IsSupporting(const std::vector<Element>& elements, const Vector3d& n, double offset) {
  return std::all_of(elements.begin(), elements.end(), [&](const Element& element) {
    return n.dot(element.SupportPoint(n)) <= offset + kSupporting;
  });
}

/// The normals of the flat faces of the elements' convex hull that touch corners of several parts. A plane
/// that touches a disc in two points contains it, so each face touches three elements. Corners alone form a
/// polytope; only triples with a round element are tried.
std::vector<Vector3d> BridgingNormals(std::vector<Element> elements) {
  std::vector<Vector3d> normals;
  const auto round_end = std::stable_partition(elements.begin(), elements.end(),
                                               [](const Element& e) { return e.ball > 0 || e.rim > 0; });
  auto num_round = static_cast<size_t>(round_end - elements.begin());
  std::vector<Vector3d> corners;
  for (auto element = round_end; element != elements.end(); ++element) corners.push_back(element->centre);
  const HullResult made = MakeHull(corners);
  if (made.hull && made.left_out < kSupporting) {
    elements.erase(round_end, elements.end());
    for (const Vector3d& p : made.hull->polytope->vertices) elements.push_back({p});
    for (const Polytope::Face& face : made.hull->polytope->faces) {
      if (IsSupporting(elements, face.normal, face.offset)) normals.push_back(face.normal);
    }
  } else {
    num_round = elements.size();
  }
  for (size_t i = 0; i < num_round; ++i) {
    for (size_t j = i + 1; j < elements.size(); ++j) {
      for (size_t k = j + 1; k < elements.size(); ++k) {
        const Vector3d u = elements[j].centre - elements[i].centre;
        const Vector3d v = elements[k].centre - elements[i].centre;
        const Vector3d start = u.cross(v);
        if (!(start.norm() > 1e-9 * u.norm() * v.norm())) continue;
        for (const double sign : {1.0, -1.0}) {
          const Vector3d n = CommonNormal(elements[i], elements[j], elements[k], sign * start.normalized());
          if (!n.isZero() && IsSupporting(elements, n, n.dot(elements[i].SupportPoint(n))))
            normals.push_back(n);
        }
      }
    }
  }
  return normals;
}

bool Flat(const Polygon& polygon) {
  if (polygon.size() < 3) return false;
  double longest = 0;
  for (const Eigen::Vector2d& p : polygon) longest = std::max(longest, (p - polygon[0]).norm());
  return Area(polygon) > kInputLength * longest;
}

/// Planes through corners that are coplanar but for rounding are one face.
bool LiesOn(const FlatFacet& facet, const FlatFacet& face) {
  return facet.normal.dot(face.normal) > 0.9 &&
         std::all_of(facet.points.begin(), facet.points.end(),
                     [&](const Vector3d& p) { return face.normal.dot(p) >= face.offset - kInputLength; });
}

double Rounded(double x) { return std::round(x * 1e8); }

}  // namespace

double Support(const Primitive& primitive, const Vector3d& d) {
  const Core core = internal::MakeCore(primitive);
  return core.Support(d) + (core.rounding > 0 ? core.rounding * d.norm() : 0.0);
}

double Support(const Shape& shape, const Vector3d& d) {
  assert(!shape.parts.empty());
  double greatest = -math::kInfinity;
  for (const Part& part : shape.parts) {
    greatest = std::max(greatest, d.dot(part.X_SP.p) + Support(part.primitive, part.X_SP.R.transpose() * d));
  }
  return greatest;
}

Vector3d SupportPoint(const Primitive& primitive, const Vector3d& d) {
  const Core core = internal::MakeCore(primitive);
  return core.SupportPoint(d) + core.rounding * d.normalized();
}

Vector3d SupportPoint(const Shape& shape, const Vector3d& d) {
  assert(!shape.parts.empty());
  Vector3d best = Vector3d::Zero();
  double greatest = -math::kInfinity;
  for (const Part& part : shape.parts) {
    const Vector3d p = part.X_SP * SupportPoint(part.primitive, part.X_SP.R.transpose() * d);
    if (d.dot(p) > greatest) {
      greatest = d.dot(p);
      best = p;
    }
  }
  return best;
}

FlatFacet SupportPolygon(const Shape& shape, const Vector3d& direction) {
  FlatFacet facet;
  facet.normal = direction.normalized();
  facet.offset = Support(shape, facet.normal);
  const Vector3d& n = facet.normal;
  const Vector3d along = std::abs(n.x()) > 0.9 ? Vector3d::UnitY() : Vector3d::UnitX();
  facet.axis_x = (along - along.dot(n) * n).normalized();
  facet.axis_y = n.cross(facet.axis_x);

  std::vector<Eigen::Vector2d> extreme;
  const auto include = [&](const Vector3d& p) {
    if (n.dot(p) >= facet.offset - kInputLength) extreme.push_back(facet.Project(p));
  };
  for (const Element& element : Elements(shape)) {
    const Vector3d across = n - n.dot(element.axis) * element.axis;
    if (element.rim > 0 && 2 * element.rim * across.norm() <= kInputLength) {
      const Vector3d u = element.axis.unitOrthogonal();
      const Vector3d v = element.axis.cross(u);
      for (int i = 0; i < kDiscVertices; ++i) {
        const double angle = 2 * std::numbers::pi * i / kDiscVertices;
        include(element.centre + element.rim * (std::cos(angle) * u + std::sin(angle) * v));
      }
    } else {
      include(element.SupportPoint(n));
    }
  }
  facet.polygon = ConvexHull(extreme, kStraight);
  for (const Eigen::Vector2d& p : facet.polygon) facet.points.push_back(facet.Lift(p));
  return facet;
}

std::vector<FlatFacet> RestingFaces(const Shape& shape, const Vector3d& centre_of_mass) {
  std::vector<Vector3d> normals;
  const auto consider = [&](const Vector3d& n) {
    const bool known =
        std::any_of(normals.begin(), normals.end(), [&](const Vector3d& m) { return (n - m).norm() < 1e-6; });
    if (!known) normals.push_back(n);
  };
  for (const Part& part : shape.parts) {
    const Core core = internal::MakeCore(part.primitive);
    if (core.hull != nullptr) {
      for (const Polytope::Face& face : core.hull->faces) consider(part.X_SP.R * face.normal);
    }
    const bool box = core.kind == Core::Kind::kBox;
    if (!box && core.kind != Core::Kind::kCylinder) continue;
    for (int axis = box ? 0 : 2; axis < 3; ++axis) {
      consider(part.X_SP.R.col(axis));
      consider(-part.X_SP.R.col(axis));
    }
  }
  if (shape.is_compound()) {
    for (const Vector3d& n : BridgingNormals(Elements(shape))) consider(n);
  }
  std::vector<FlatFacet> faces;
  for (const Vector3d& n : normals) {
    FlatFacet facet = SupportPolygon(shape, n);
    facet.margin = ContainmentMargin(facet.polygon, facet.Project(centre_of_mass));
    const bool rests = Flat(facet.polygon) && facet.margin > kInputLength;
    const auto same = [&](const FlatFacet& face) { return LiesOn(facet, face); };
    if (rests && std::none_of(faces.begin(), faces.end(), same)) faces.push_back(facet);
  }
  std::stable_sort(faces.begin(), faces.end(), [](const FlatFacet& a, const FlatFacet& b) {
    if (Rounded(a.margin) != Rounded(b.margin)) return a.margin > b.margin;
    for (const int axis : {2, 1, 0}) {
      if (Rounded(a.normal[axis]) != Rounded(b.normal[axis])) return a.normal[axis] > b.normal[axis];
    }
    return false;
  });
  return faces;
}

}  // namespace tether::geometry
