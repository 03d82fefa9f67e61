#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "tether/common/document/value.h"

namespace tether::evaluation {

/// {x, y, z}: foxglove.Vector3 and foxglove.Point3.
inline Value VectorValue(const Eigen::Vector3d& v) {
  return Value::Object().Set("x", v.x()).Set("y", v.y()).Set("z", v.z());
}

/// {x, y, z, w}: foxglove.Quaternion.
inline Value QuaternionValue(const Eigen::Quaterniond& q) {
  return Value::Object().Set("x", q.x()).Set("y", q.y()).Set("z", q.z()).Set("w", q.w());
}

}  // namespace tether::evaluation
