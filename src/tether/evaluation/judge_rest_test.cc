#include <cmath>

#include <gtest/gtest.h>

#include "tether/evaluation/judge.h"
#include "tether/geometry/hull/polytope.h"
#include "tether/geometry/polygon/support.h"
#include "tether/scene/resting_contact.h"
#include "tether/sim/world.h"

namespace tether::evaluation {
namespace {

using Eigen::Vector3d;
using geometry::Shape;
using math::Pose;

/// A shape as it rests on a plane.
struct RestingShape {
  const char* name;
  Shape shape;
  Vector3d rpy;
};

geometry::Hull Prism() {
  std::vector<Vector3d> points;
  for (int i = 0; i < 6; ++i) {
    const double angle = M_PI / 3 * i;
    for (const double z : {-0.03, 0.03})
      points.emplace_back(0.03 * std::cos(angle), 0.03 * std::sin(angle), z);
  }
  return *geometry::MakeHull(points).hull;
}

std::vector<RestingShape> Shapes() {
  const auto shape = [](const geometry::Primitive& primitive) { return Shape(primitive); };
  return {{"box", shape(geometry::Box{{0.05, 0.05, 0.06}}), {0, 0, 0}},
          {"upright cylinder", shape(geometry::Cylinder{0.025, 0.06}), {0, 0, 0}},
          {"lying cylinder", shape(geometry::Cylinder{0.025, 0.06}), {M_PI / 2, 0, 0}},
          {"lying capsule", shape(geometry::Capsule{0.02, 0.05}), {M_PI / 2, 0, 0}},
          {"sphere", shape(geometry::Sphere{0.025}), {0, 0, 0}},
          {"prism", shape(Prism()), {0, 0, 0}},
          {"lying prism", shape(Prism()), {M_PI / 2, 0, M_PI / 6}}};
}

/// Puts things down, one on another, and counts the moments of one second at which `on` is false of them.
class Yard {
 public:
  Yard() {
    scene::Object table;
    table.name = "table";
    table.shape = Shape(geometry::Primitive(geometry::Box{{4, 4, 0.2}}));
    table.X_ParentObject.p.z() = -0.1;
    scene_.objects.push_back(table);
  }

  /// Adds `shape` at rest at (x, y), on an object whose top is at `height`. Returns the height of its own
  /// top.
  double Add(const std::string& name, const RestingShape& resting, const std::string& on, const Vector3d& p,
             double yaw, double mass, double friction) {
    scene::Object object;
    object.name = name;
    object.shape = resting.shape;
    object.mass = mass;
    object.friction = friction;
    const Eigen::Matrix3d R = math::RotationFromRpy({0, 0, yaw}) * math::RotationFromRpy(resting.rpy);
    const double below = geometry::Support(resting.shape, R.transpose() * -Vector3d::UnitZ());
    const double above = geometry::Support(resting.shape, R.transpose() * Vector3d::UnitZ());
    object.X_ParentObject = Pose(R, p + Vector3d(0, 0, below));
    scene_.objects.push_back(object);
    pairs_.emplace_back(name, on);
    return p.z() + below + above;
  }

  std::map<std::string, int> Failures() const {
    sim::World world(scene_, {});
    PoseHistory history;
    std::map<std::string, int> failures;
    for (int tick = 0; tick <= 200; ++tick) {
      Truth truth;
      truth.X_WO = world.Truth().X_WO;
      history.Add(world.time(), truth.X_WO);
      truth.X_WO_before = history.Before(world.time());
      for (const auto& [upper, lower] : pairs_) {
        if (!IsOn(scene_, truth, upper, lower)) ++failures[upper + " on " + lower];
      }
      world.Apply({}, 0.005);
    }
    return failures;
  }

 private:
  scene::Scene scene_;
  std::vector<std::pair<std::string, std::string>> pairs_;
};

void ExpectNone(const Yard& yard, double friction) {
  for (const auto& [what, times] : yard.Failures())
    ADD_FAILURE() << what << ", friction " << friction << ": false at " << times << " of 201 samples";
}

// standing_cylinder_is_not_on: contacts tremble, and one step's velocity counted as motion.
TEST(JudgeRestTest, WhatStandsOnATableIsOnIt) {
  for (const double friction : {0.3, 0.6, 1.0}) {
    Yard yard;
    int row = 0;
    for (const RestingShape& resting : Shapes()) {
      int column = 0;
      for (const double mass : {0.02, 0.13, 1.0}) {
        for (const double yaw : {0.0, 0.3, 0.8}) {
          yard.Add(std::string(resting.name) + " " + std::to_string(column), resting, "table",
                   {0.2 * row - 0.7, 0.2 * column - 0.8, 0}, yaw, mass, friction);
          ++column;
        }
      }
      ++row;
    }
    ExpectNone(yard, friction);
  }
}

TEST(JudgeRestTest, WhatStandsOnAnotherIsOnIt) {
  const std::vector<RestingShape> shapes = Shapes();
  for (const double friction : {0.3, 1.0}) {
    Yard yard;
    int row = 0;
    for (const size_t lower : {0, 1, 5}) {
      for (const size_t upper : {0, 1, 5}) {
        int column = 0;
        for (const double yaw : {0.0, 0.3}) {
          for (const double mass : {0.05, 0.5}) {
            const std::string number = std::to_string(row) + std::to_string(column);
            const std::string below = std::string(shapes[lower].name) + " below " + number;
            const Vector3d p(0.3 * row - 1.2, 0.2 * column - 0.8, 0);
            const double top = yard.Add(below, shapes[lower], "table", p, 0, 0.13, friction);
            yard.Add(std::string(shapes[upper].name) + " " + number, shapes[upper], below,
                     p + Vector3d(0.004, -0.003, top), yaw, mass, friction);
            ++column;
          }
        }
        ++row;
      }
    }
    ExpectNone(yard, friction);
  }
}

}  // namespace
}  // namespace tether::evaluation
