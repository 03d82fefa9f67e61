#pragma once

#include <memory>
#include <string>
#include <variant>
#include <vector>

#include "tether/math/pose.h"

namespace tether::geometry {

/// A box centred at its frame's origin, axes along the frame's.
struct Box {
  Eigen::Vector3d size;  ///< Full side lengths, m.
};

struct Sphere {
  double radius;  ///< m
};

/// A capsule along its frame's z axis, centred at the origin.
struct Capsule {
  double radius;  ///< m
  double length;  ///< Distance between the centres of the two caps, m.
};

/// A solid cylinder along its frame's z axis, centred at the origin.
struct Cylinder {
  double radius;  ///< m
  double length;  ///< Full height, m.
};

struct Polytope;

/// A convex polytope, made by MakeHull (polytope.h). Its frame is that of its points: unlike the other
/// primitives it need not be centred there. Copies share the polytope.
struct Hull {
  std::shared_ptr<const Polytope> polytope;  ///< Never null.
};

/// The convex primitives.
using Primitive = std::variant<Box, Sphere, Capsule, Cylinder, Hull>;

/// One convex part of a shape, with the pose of the part's frame P in the shape's frame S.
struct Part {
  Primitive primitive;
  math::Pose X_SP;
};

/// A solid: the union of one or more convex parts. With more than one it is a compound, whose distance to
/// anything is the minimum over its parts. Immutable once built; safe to share between threads.
struct Shape {
  std::vector<Part> parts;

  Shape() = default;
  Shape(Primitive primitive)
      : parts{{std::move(primitive), math::Pose()}} {}  // NOLINT: a primitive is a shape
  explicit Shape(std::vector<Part> all) : parts(std::move(all)) {}
  bool is_compound() const { return parts.size() > 1; }
};

/// "box", "sphere", "capsule", "cylinder" or "hull".
std::string KindName(const Primitive& primitive);

/// Volume, m³.
double Volume(const Primitive& primitive);

/// The centre of mass of a body of uniform density in its own frame. Of all primitives but a hull, its
/// origin.
Eigen::Vector3d CentreOfMass(const Primitive& primitive);
/// As above. Parts of a compound are weighted by volume, overlaps counted twice. ERRATA A14: a compound has
/// one centre of mass, not one per part.
Eigen::Vector3d CentreOfMass(const Shape& shape);

}  // namespace tether::geometry
