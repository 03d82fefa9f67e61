#include "tether/geometry/shape.h"

#include <numbers>

#include "tether/common/overloaded.h"

namespace tether::geometry {
std::string KindName(const Primitive& primitive) {
  static const char* const names[] = {"box", "sphere", "capsule", "cylinder"};
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
          [](const Cylinder& cylinder) { return pi * cylinder.radius * cylinder.radius * cylinder.length; }},
      primitive);
}

Eigen::Vector3d CentreOfMass(const Shape& shape) {
  double total = 0;
  Eigen::Vector3d moment = Eigen::Vector3d::Zero();
  for (const Part& part : shape.parts) {
    const double volume = Volume(part.primitive);
    total += volume;
    moment += volume * part.X_SP.p;  // every primitive is centred in its own frame
  }
  return total > 0 ? Eigen::Vector3d(moment / total) : Eigen::Vector3d::Zero();
}

}  // namespace tether::geometry
