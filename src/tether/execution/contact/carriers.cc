#include "tether/execution/contact/carriers.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <variant>

#include "tether/geometry/distance/query.h"
#include "tether/geometry/polygon/support.h"

namespace tether::execution {
namespace {

using Eigen::Vector3d;
using math::Pose;

// What is no higher than this above another's foot can lie beneath it, m.
constexpr double kBeneath = 0.005;
// A footprint may reach so far beyond an outline and is still within it, m.
constexpr double kWithin = 0.001;
// An axis that is no steeper than this counts as level: |z| of its direction.
constexpr double kLevel = 0.7;
// A region is looked beneath in so many directions, halfway to its outline.
constexpr int kDirections = 8;

// How far an object reaches along a direction of the world, m.
double Extent(const Situation& s, ObjectId object, const Vector3d& d_W) {
  const Pose& X_WO = s.X_WO(object);
  return geometry::Support(s.object(object).shape, X_WO.R.transpose() * d_W) + d_W.dot(X_WO.p);
}

// The object's footprint is within the carrier's, seen along the carrier's level axes.
bool IsOver(const Situation& s, ObjectId object, ObjectId carrier) {
  for (int axis = 0; axis < 3; ++axis) {
    Vector3d d = s.X_WO(carrier).R.col(axis);
    if (std::abs(d.z()) > kLevel) continue;
    d = Vector3d(d.x(), d.y(), 0).normalized();
    for (const double side : {1.0, -1.0}) {
      if (Extent(s, object, side * d) > Extent(s, carrier, side * d) + kWithin) return false;
    }
  }
  return true;
}

// How far a flat region reaches along its frame's x and y axes, m.
Eigen::Vector2d HalfSize(const scene::RegionForm& form) {
  if (const auto* disc = std::get_if<scene::Disc>(&form)) return {disc->radius, disc->radius};
  if (const auto* rectangle = std::get_if<scene::Rectangle>(&form)) return 0.5 * rectangle->size;
  return {0, 0};
}

}  // namespace

void FindCarriers(const Situation& s, int index, std::vector<ObjectId>* found) {
  found->clear();
  const scene::Region& region = s.scene.regions[ToIndex(index)];
  const AttachedFrame& frame = s.regions[index];
  if (frame.object != kNone) found->push_back(frame.object);
  if (region.hub || std::holds_alternative<geometry::Primitive>(region.form)) return;
  const Pose X_WR = s.X_WF(frame);
  const auto lies_beneath = [&](ObjectId object, const Vector3d& p_R) {
    const Vector3d above = X_WR * (p_R + kBeneath * Vector3d::UnitZ());
    return geometry::CastRay(s.object(object).shape, s.X_WO(object), above, -X_WR.R.col(2),
                             geometry::RayStart::kIgnore, 2 * kBeneath)
        .has_value();
  };
  const Eigen::Vector2d half = HalfSize(region.form);
  for (const ObjectId other : s.objects.ids()) {
    if (other == s.held || other == frame.object) continue;
    bool beneath = lies_beneath(other, Vector3d::Zero());
    for (int k = 0; k < kDirections && !beneath; ++k) {
      const double angle = 2 * std::numbers::pi * k / kDirections;
      beneath = lies_beneath(other,
                             Vector3d(0.5 * half.x() * std::cos(angle), 0.5 * half.y() * std::sin(angle), 0));
    }
    if (beneath) found->push_back(other);
  }
}

void AddBeneath(const Situation& s, ObjectId carrier, std::vector<ObjectId>* found) {
  if (carrier == kNone || carrier == s.held || !IsOver(s, s.held, carrier)) return;
  const double foot = -Extent(s, carrier, -Vector3d::UnitZ());
  for (const ObjectId other : s.objects.ids()) {
    if (other == carrier || other == s.held) continue;
    if (Extent(s, other, Vector3d::UnitZ()) > foot + kBeneath) continue;
    if (std::find(found->begin(), found->end(), other) == found->end()) found->push_back(other);
  }
}

}  // namespace tether::execution
