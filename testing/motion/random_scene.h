#pragma once

#include <string>

#include "tether/common/random.h"
#include "tether/geometry/hull/polytope.h"
#include "tether/motion/collision_scene.h"
#include "tether/robot/kinematics.h"

namespace tether::motion {

inline Eigen::Vector3d RandomPoint(Random& random, double lower, double upper) {
  return {random.Uniform(lower, upper), random.Uniform(lower, upper), random.Uniform(lower, upper)};
}

inline math::Pose RandomPose(Random& random) {
  Eigen::Vector4d q(random.Normal(), random.Normal(), random.Normal(), random.Normal());
  return {Eigen::Quaterniond(q[0], q[1], q[2], q[3]), RandomPoint(random, -0.9, 0.9)};
}

/// Each kind of primitive in turn.
inline geometry::Primitive RandomPrimitive(Random& random, int kind) {
  const double a = random.Uniform(0.03, 0.15), b = random.Uniform(0.03, 0.5);
  switch (kind % 5) {
    case 0:
      return geometry::Box{RandomPoint(random, 0.03, 0.4)};
    case 1:
      return geometry::Sphere{a};
    case 2:
      return geometry::Capsule{a, b};
    case 3:
      return geometry::Cylinder{a, b};
    default: {
      std::vector<Eigen::Vector3d> points;
      for (int i = 0; i < 12; ++i) points.push_back(RandomPoint(random, -0.15, 0.15));
      return *geometry::MakeHull(points).hull;
    }
  }
}

/// `count` obstacles of all kinds about the arm, none on its base, and something in its hand.
inline Snapshot RandomScene(const std::shared_ptr<const robot::Model>& model, uint64_t seed, int count) {
  Random random(seed);
  Snapshot snapshot;
  snapshot.model = model;
  snapshot.opening = random.Uniform(0, model->gripper().max_opening);
  for (int i = 0; i < count; ++i) {
    const geometry::Primitive primitive = RandomPrimitive(random, i);
    math::Pose X_BO = RandomPose(random);
    const double across = X_BO.p.head<2>().norm();
    if (across < 0.45) X_BO.p.head<2>() *= 0.45 / across;
    snapshot.obstacles.push_back({"obstacle " + std::to_string(i), geometry::Shape(primitive), X_BO});
  }
  snapshot.held.push_back({"cup", geometry::Shape(geometry::Cylinder{0.03, 0.15}), math::Pose()});
  return snapshot;
}

inline Eigen::VectorXd RandomConfiguration(const robot::Model& model, Random& random) {
  Eigen::VectorXd q(model.dof());
  for (int i = 0; i < model.dof(); ++i) q[i] = random.Uniform(model.lower()[i], model.upper()[i]);
  return q;
}

}  // namespace tether::motion
