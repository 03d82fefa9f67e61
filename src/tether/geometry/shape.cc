#include "tether/geometry/shape.h"

#include <numbers>

#include "tether/common/overloaded.h"
#include "tether/geometry/hull/polytope.h"

namespace tether::geometry {
std::string KindName(const Primitive& primitive) {
  static const char* const names[] = {"box", "sphere", "capsule", "cylinder", "hull"};
  return names[primitive.index()];
}

double Volume(const Primitive& primitive) {
  using std::numbers::pi;
  return std::visit(
      Overloaded{
          [](const Box& box) { return box.size.prod(); },
          [](const Sphere& sphere) { return 4.0 / 3.0 * pi * sphere.radius * sphere.radius * sphere.radius; },
          [](const Capsule& capsule) {
            return pi * capsule.radius * capsule.radius * (capsule.length + 4.0 / 3.0 * capsule.radius);
          },
          [](const Cylinder& cylinder) { return pi * cylinder.radius * cylinder.radius * cylinder.length; },
          [](const Hull& hull) { return hull.polytope->volume; }},
      primitive);
}

Eigen::Vector3d CentreOfMass(const Primitive& primitive) {
  const auto* hull = std::get_if<Hull>(&primitive);
  return hull != nullptr ? hull->polytope->centroid : Eigen::Vector3d::Zero();
}

Eigen::Vector3d CentreOfMass(const Shape& shape) {
  double total = 0;
  Eigen::Vector3d moment = Eigen::Vector3d::Zero();
  for (const Part& part : shape.parts) {
    const double volume = Volume(part.primitive);
    total += volume;
    moment += volume * (part.X_SP * CentreOfMass(part.primitive));
  }
  return total > 0 ? Eigen::Vector3d(moment / total) : Eigen::Vector3d::Zero();
}

}  // namespace tether::geometry
