#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "tether/execution/servo/reference_servo.h"
#include "tether/geometry/distance/distance.h"
#include "tether/geometry/distance/query.h"
#include "tether/geometry/polygon/support.h"

namespace tether::execution {
namespace {

using Eigen::Vector3d;

// Overlap by more than this is an obstruction, m.
constexpr double kOverlap = 0.001;
// Another place has this much room, m.
constexpr double kRoom = 0.005;
// Other places: on circles about the planned one, this far apart, up to a greatest radius, m.
constexpr double kRing = 0.004, kFurthest = 0.06;
constexpr int kDirections = 16;
// A corner is over what carries it if that begins so far below it at most, m.
constexpr double kOver = 0.01;

}  // namespace

bool ReferenceServo::PutsDown() const {
  if (s_.current().push || s_.current().control == kNone || s_.held != s_.current().control) return false;
  if (s_.current().target.object == kNone) return false;
  return std::any_of(s_.verbs().begin(), s_.verbs().end(), [](const planning::Verb& verb) {
    const auto* gripper = std::get_if<planning::GripperVerb>(&verb);
    return gripper != nullptr && gripper->close_on.empty();
  });
}

// The least distance of what is held, at this pose, from what it is not put on.
double ReferenceServo::RoomAt(const math::Pose& X_WC, ObjectId* nearest) const {
  double room = std::numeric_limits<double>::infinity();
  for (const ObjectId object : s_.objects.ids()) {
    if (MovesWithHand(object) || object == s_.current().target.object) continue;
    const double distance =
        geometry::SignedDistance(s_.object(s_.held).shape, X_WC, s_.object(object).shape, s_.X_WO(object))
            .distance;
    if (distance >= room) continue;
    room = distance;
    *nearest = object;
  }
  return room;
}

// How many corners of the foot of what is held are over what carries it.
int ReferenceServo::CornersOver(const math::Pose& X_WC) const {
  const geometry::Shape& shape = s_.object(s_.held).shape;
  const ObjectId carrier = s_.current().target.object;
  int over = 0;
  for (const Vector3d& corner : geometry::SupportPolygon(shape, -X_WC.R.row(2).transpose()).points) {
    const Vector3d from = X_WC * corner + kOver * Vector3d::UnitZ();
    over += geometry::CastRay(s_.object(carrier).shape, s_.objects[carrier].X, from, -Vector3d::UnitZ(),
                              geometry::RayStart::kIgnore, 2 * kOver)
                .has_value();
  }
  return over;
}

// An object is put down at its pose in the plan, unless something stands there by now: then at the nearest
// free place on the same surface.
void ReferenceServo::FindFreePlace() {
  const math::Pose X_WT = X_WF(s_.current().target);
  const math::Pose X_WC = X_WT * s_.plan_step().X_TC;
  X_TC_ = s_.plan_step().X_TC;
  ObjectId blocking;
  if (RoomAt(X_WC, &blocking) > -kOverlap) return;
  const int corners = CornersOver(X_WC);
  for (double radius = kRing; radius <= kFurthest; radius += kRing) {
    double most = kRoom;
    for (int k = 0; k < kDirections; ++k) {
      const double angle = 2 * std::numbers::pi * k / kDirections;
      const math::Pose X_WFree(X_WC.R, X_WC.p + radius * Vector3d(std::cos(angle), std::sin(angle), 0));
      ObjectId ignored;
      const double room = RoomAt(X_WFree, &ignored);
      if (room <= most || CornersOver(X_WFree) < corners) continue;
      most = room;
      X_TC_ = math::Between(X_WT, X_WFree);
    }
    if (most == kRoom) continue;
    s_.Record(EventKind::kReplanned, "'" + s_.plan_step().control + "' is put " + Length(radius) +
                                         " beside its pose: '" + s_.object(blocking).name + "' stands there");
    return;
  }
}

}  // namespace tether::execution
