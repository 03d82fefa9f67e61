#include "tether/scene/region.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>

#include "tether/common/overloaded.h"
#include "tether/geometry/hull/polytope.h"
#include "tether/geometry/polygon/support.h"

namespace tether::scene {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

// Directions in which a round outline is sampled: the error is 4e-6 of the footprint's extent.
constexpr int kDirections = 1024;

/// The outline of a region: a disc about the origin, or the intersection of half planes.
struct Outline {
  double radius = 0;  ///< 0: the half planes.
  std::vector<geometry::HalfPlane> half_planes;
  geometry::Polygon polygon;
  double lower = 0, upper = 0;  ///< Extent along z.
};

Outline MakeRectangle(const Vector2d& size, double half_height) {
  const Vector2d h = 0.5 * size;
  Outline outline;
  outline.polygon = {{-h.x(), -h.y()}, {h.x(), -h.y()}, {h.x(), h.y()}, {-h.x(), h.y()}};
  outline.half_planes = geometry::EdgeHalfPlanes(outline.polygon);
  outline.lower = -half_height;
  outline.upper = half_height;
  return outline;
}

Outline MakeDisc(double radius, double half_height) { return {radius, {}, {}, -half_height, half_height}; }

Outline OutlineOf(const RegionForm& form) {
  const auto of_primitive = [](const geometry::Primitive& primitive) {
    return std::visit(
        Overloaded{
            [](const geometry::Box& box) { return MakeRectangle(box.size.head<2>(), 0.5 * box.size.z()); },
            [](const geometry::Sphere& sphere) { return MakeDisc(sphere.radius, sphere.radius); },
            [](const geometry::Capsule& capsule) {
              return MakeDisc(capsule.radius, capsule.radius + 0.5 * capsule.length);
            },
            [](const geometry::Cylinder& cylinder) {
              return MakeDisc(cylinder.radius, 0.5 * cylinder.length);
            },
            [](const geometry::Hull& hull) {
              std::vector<Vector2d> points;
              Outline outline;
              outline.lower = std::numeric_limits<double>::infinity();
              outline.upper = -outline.lower;
              for (const Vector3d& vertex : hull.polytope->vertices) {
                points.push_back(vertex.head<2>());
                outline.lower = std::min(outline.lower, vertex.z());
                outline.upper = std::max(outline.upper, vertex.z());
              }
              outline.polygon = geometry::ConvexHull(std::move(points));
              outline.half_planes = geometry::EdgeHalfPlanes(outline.polygon);
              return outline;
            }},
        primitive);
  };
  return std::visit(Overloaded{of_primitive, [](const Disc& disc) { return MakeDisc(disc.radius, 0); },
                               [](const Rectangle& rectangle) { return MakeRectangle(rectangle.size, 0); }},
                    form);
}

/// Whether `frame` is `object` or attached to it at the start.
bool HangsOn(const Scene& scene, std::string frame, const std::string& object) {
  while (frame != kWorld) {
    if (frame == object) return true;
    if (const Object* one = scene.FindObject(frame)) {
      frame = one->parent;
    } else if (const Region* region = scene.FindRegion(frame)) {
      frame = region->parent;
    } else if (const Robot* robot = scene.FindRobot(frame)) {
      frame = robot->parent;
    } else {
      return false;
    }
  }
  return false;
}

/// Unit vectors all around, in which a round outline is sampled.
const std::vector<Vector2d>& RoundDirections() {
  static const std::vector<Vector2d> directions = [] {
    std::vector<Vector2d> made;
    for (int i = 0; i < kDirections; ++i) {
      const double angle = 2 * std::numbers::pi * i / kDirections;
      made.emplace_back(std::cos(angle), std::sin(angle));
    }
    return made;
  }();
  return directions;
}

/// A body seen from a region: how far it reaches along directions of the region's frame.
class BodyInRegion {
 public:
  BodyInRegion(const math::Pose& X_WR, const geometry::Shape& shape, const math::Pose& X_WO)
      : shape_(shape), X_RO_(math::Between(X_WR, X_WO)) {}

  double Reach(const Vector3d& d_R) const {
    return geometry::Support(shape_, X_RO_.R.transpose() * d_R) + d_R.dot(X_RO_.p);
  }
  double Reach(const Vector2d& d_R) const { return Reach(Vector3d(d_R.x(), d_R.y(), 0)); }

  /// The height of the foot beyond the outline's extent along z, m.
  double Height(const Outline& outline) const {
    const double foot = -Reach(Vector3d(-Vector3d::UnitZ()));
    return std::max({0.0, outline.lower - foot, foot - outline.upper});
  }

  /// The distance from the origin that the footprint's bounding rectangle keeps within, m.
  double RadiusBound() const {
    const double x = std::max(Reach(Vector2d(1, 0)), Reach(Vector2d(-1, 0)));
    const double y = std::max(Reach(Vector2d(0, 1)), Reach(Vector2d(0, -1)));
    return std::hypot(x, y);
  }

 private:
  const geometry::Shape& shape_;
  math::Pose X_RO_;
};

/// FitRegion(...).Holds(), with what usually decides asked first: it is asked at every sample of a run.
bool Fits(const RegionForm& form, const math::Pose& X_WR, const geometry::Shape& shape,
          const math::Pose& X_WO) {
  const Outline outline = OutlineOf(form);
  const BodyInRegion body(X_WR, shape, X_WO);
  if (body.Height(outline) > RegionFit::kHeightTolerance) return false;
  const double room = outline.radius + RegionFit::kOutlineTolerance;
  for (const geometry::HalfPlane& edge : outline.half_planes) {
    if (body.Reach(edge.normal) - edge.offset > RegionFit::kOutlineTolerance) return false;
  }
  if (outline.radius <= 0 || body.RadiusBound() <= room) return true;
  return std::none_of(RoundDirections().begin(), RoundDirections().end(),
                      [&](const Vector2d& direction) { return body.Reach(direction) > room; });
}

}  // namespace

RegionFit FitRegion(const RegionForm& form, const math::Pose& X_WR, const geometry::Shape& shape,
                    const math::Pose& X_WO) {
  const BodyInRegion body(X_WR, shape, X_WO);
  const Outline outline = OutlineOf(form);
  RegionFit fit;
  fit.outside = -std::numeric_limits<double>::infinity();
  for (const geometry::HalfPlane& edge : outline.half_planes) {
    fit.outside = std::max(fit.outside, body.Reach(edge.normal) - edge.offset);
  }
  if (outline.radius > 0) {
    for (const Vector2d& direction : RoundDirections()) {
      fit.outside = std::max(fit.outside, body.Reach(direction) - outline.radius);
    }
  }
  fit.height = body.Height(outline);
  return fit;
}

geometry::Polygon OutlinePolygon(const RegionForm& form) {
  Outline outline = OutlineOf(form);
  constexpr int kCorners = 64;
  const double radius = outline.radius / std::cos(std::numbers::pi / kCorners);
  for (int i = 0; radius > 0 && i < kCorners; ++i) {
    const double angle = 2 * std::numbers::pi * i / kCorners;
    outline.polygon.emplace_back(radius * std::cos(angle), radius * std::sin(angle));
  }
  return outline.polygon;
}

double OutlineArea(const RegionForm& form) {
  const Outline outline = OutlineOf(form);
  return outline.radius > 0 ? std::numbers::pi * outline.radius * outline.radius
                            : geometry::Area(outline.polygon);
}

math::Pose RegionPose(const Scene& scene, const std::map<std::string, math::Pose>& X_WO,
                      const Region& region) {
  math::Pose X = region.X_ParentRegion;  // of the region in `frame`
  std::string frame = region.parent;
  while (frame != kWorld) {
    if (const auto moved = X_WO.find(frame); moved != X_WO.end()) return moved->second * X;
    if (const Object* object = scene.FindObject(frame)) {
      X = object->X_ParentObject * X;
      frame = object->parent;
    } else if (const Region* above = scene.FindRegion(frame)) {
      X = above->X_ParentRegion * X;
      frame = above->parent;
    } else if (const Robot* robot = scene.FindRobot(frame)) {
      X = robot->X_ParentBase * X;
      frame = robot->parent;
    } else {
      throw std::logic_error("no frame named '" + frame + "'");
    }
  }
  return X;
}

namespace {

/// in(object, region), not for hubs and regions that hang on the object itself.
bool Contains(const Scene& scene, const std::map<std::string, math::Pose>& X_WO, const Region& region,
              const Object& object) {
  return !region.hub && !HangsOn(scene, region.parent, object.name) &&
         Fits(region.form, RegionPose(scene, X_WO, region), object.shape, X_WO.at(object.name));
}

}  // namespace

std::vector<const Region*> FindRegionsOf(const Scene& scene, const std::map<std::string, math::Pose>& X_WO,
                                         const Object& object) {
  std::vector<const Region*> found;
  for (const Region& region : scene.regions) {
    if (Contains(scene, X_WO, region, object)) found.push_back(&region);
  }
  std::stable_sort(found.begin(), found.end(), [](const Region* a, const Region* b) {
    return OutlineArea(a->form) < OutlineArea(b->form);
  });
  return found;
}

bool IsIn(const Scene& scene, const std::map<std::string, math::Pose>& X_WO, const Object& object,
          const std::string& area) {
  const auto group = scene.groups.find(area);
  const auto is_meant = [&](const Region& region) {
    if (group == scene.groups.end()) return region.name == area;
    return std::find(group->second.begin(), group->second.end(), region.name) != group->second.end();
  };
  return std::any_of(scene.regions.begin(), scene.regions.end(), [&](const Region& region) {
    return is_meant(region) && Contains(scene, X_WO, region, object);
  });
}

}  // namespace tether::scene
