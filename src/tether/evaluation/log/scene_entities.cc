#include "tether/evaluation/log/scene_entities.h"

#include <array>

#include "tether/common/overloaded.h"
#include "tether/evaluation/log/pose_values.h"
#include "tether/geometry/hull/polytope.h"
#include "tether/robot/kinematics.h"

namespace tether::evaluation {
namespace {

using Colour = Eigen::Vector4d;

// Movable objects take these in turn; what is fixed is grey.
const std::array<Colour, 7> kColours = {Colour(0.20, 0.47, 0.75, 1), Colour(0.85, 0.40, 0.27, 1),
                                        Colour(0.40, 0.62, 0.35, 1), Colour(0.80, 0.65, 0.15, 1),
                                        Colour(0.55, 0.35, 0.65, 1), Colour(0.20, 0.65, 0.62, 1),
                                        Colour(0.62, 0.42, 0.25, 1)};
const Colour kFixed(0.62, 0.62, 0.62, 1), kRegion(0.15, 0.60, 0.30, 0.25), kArm(0.88, 0.88, 0.90, 1),
    kHand(0.35, 0.35, 0.40, 1);
constexpr double kRegionHeight = 1e-3;  // Of a flat one, m.

Value PoseValue(const math::Pose& X) {
  return Value::Object()
      .Set("position", VectorValue(X.p))
      .Set("orientation", QuaternionValue(X.Quaternion()));
}

Value ColourValue(const Colour& c) {
  return Value::Object().Set("r", c[0]).Set("g", c[1]).Set("b", c[2]).Set("a", c[3]);
}

/// One entity: what is drawn in one frame.
class Entity {
 public:
  explicit Entity(std::string frame) : frame_(std::move(frame)) {}

  void Add(const geometry::Shape& shape, const Colour& colour) {
    for (const geometry::Part& part : shape.parts) Add(part.primitive, part.X_SP, colour);
  }

  void Add(const geometry::Primitive& primitive, const math::Pose& X, const Colour& colour) {
    std::visit(Overloaded{[&](const geometry::Box& box) { cubes_.Append(Sized(X, box.size, colour)); },
                          [&](const geometry::Sphere& ball) { AddBall(X, ball.radius, colour); },
                          [&](const geometry::Capsule& capsule) {
                            const Eigen::Vector3d end(0, 0, 0.5 * capsule.length);
                            AddCylinder(X, capsule.radius, capsule.length, colour);
                            AddBall(X * math::Pose(end), capsule.radius, colour);
                            AddBall(X * math::Pose(-end), capsule.radius, colour);
                          },
                          [&](const geometry::Cylinder& cylinder) {
                            AddCylinder(X, cylinder.radius, cylinder.length, colour);
                          },
                          [&](const geometry::Hull& hull) { AddHull(X, *hull.polytope, colour); }},
               primitive);
  }

  void AddCylinder(const math::Pose& X, double radius, double length, const Colour& colour) {
    cylinders_.Append(
        Sized(X, {2 * radius, 2 * radius, length}, colour).Set("bottom_scale", 1).Set("top_scale", 1));
  }

  Value ToValue() const {
    const auto zero = [] { return Value::Object().Set("sec", 0).Set("nsec", 0); };
    return Value::Object()
        .Set("timestamp", zero())
        .Set("frame_id", frame_)
        .Set("id", frame_)
        .Set("lifetime", zero())  // Until the next of the same id.
        .Set("frame_locked", true)
        .Set("metadata", Value::Array())
        .Set("arrows", Value::Array())
        .Set("cubes", cubes_)
        .Set("spheres", spheres_)
        .Set("cylinders", cylinders_)
        .Set("lines", Value::Array())
        .Set("triangles", triangles_)
        .Set("texts", Value::Array())
        .Set("models", Value::Array());
  }

 private:
  static Value Sized(const math::Pose& X, const Eigen::Vector3d& size, const Colour& colour) {
    return Value::Object()
        .Set("pose", PoseValue(X))
        .Set("size", VectorValue(size))
        .Set("color", ColourValue(colour));
  }
  void AddBall(const math::Pose& X, double radius, const Colour& colour) {
    spheres_.Append(Sized(X, Eigen::Vector3d::Constant(2 * radius), colour));
  }
  void AddHull(const math::Pose& X, const geometry::Polytope& polytope, const Colour& colour) {
    Value points = Value::Array(), indices = Value::Array();
    for (const Eigen::Vector3d& vertex : polytope.vertices) points.Append(VectorValue(vertex));
    for (const geometry::Polytope::Face& face : polytope.faces) {
      for (size_t i = 2; i < face.corners.size(); ++i) {
        for (const int corner : {face.corners[0], face.corners[i - 1], face.corners[i]})
          indices.Append(corner);
      }
    }
    triangles_.Append(Value::Object()
                          .Set("pose", PoseValue(X))
                          .Set("points", points)
                          .Set("color", ColourValue(colour))
                          .Set("colors", Value::Array())
                          .Set("indices", indices));
  }

  std::string frame_;
  Value cubes_ = Value::Array(), spheres_ = Value::Array(), cylinders_ = Value::Array(),
        triangles_ = Value::Array();
};

}  // namespace

std::string LinkFrame(const std::string& robot, int link) { return robot + "/link" + std::to_string(link); }
std::string HandFrame(const std::string& robot) { return robot + "/hand"; }

Value SceneEntities(const scene::Scene& scene,
                    const std::map<std::string, std::shared_ptr<const robot::Model>>& models) {
  Value entities = Value::Array();
  size_t movable = 0;
  for (const scene::Object& object : scene.objects) {
    const Colour own = object.movable() ? kColours[movable++ % kColours.size()] : kFixed;
    Entity entity(object.name);
    entity.Add(object.shape, object.rgba.value_or(own));
    entities.Append(entity.ToValue());
  }
  for (const scene::Region& region : scene.regions) {
    Entity entity(region.name);
    std::visit(Overloaded{[&](const geometry::Primitive& solid) { entity.Add(solid, {}, kRegion); },
                          [&](const scene::Disc& disc) {
                            entity.AddCylinder({}, disc.radius, kRegionHeight, kRegion);
                          },
                          [&](const scene::Rectangle& area) {
                            const geometry::Box flat{{area.size.x(), area.size.y(), kRegionHeight}};
                            entity.Add(flat, {}, kRegion);
                          }},
               region.form);
    entities.Append(entity.ToValue());
  }
  for (const scene::Robot& robot : scene.robots) {
    const robot::Model& model = *models.at(robot.name);
    for (int link = 0; link <= model.dof(); ++link) {
      Entity entity(LinkFrame(robot.name, link));
      bool any = false;
      for (const robot::LinkSolid& solid : model.solids().links) {
        if (solid.link != link) continue;
        entity.Add(solid.shape, kArm);
        any = true;
      }
      if (any) entities.Append(entity.ToValue());
    }
    Entity hand(HandFrame(robot.name));
    hand.Add(model.HandShape(model.gripper().max_opening), kHand);
    entities.Append(hand.ToValue());
  }
  return Value::Object().Set("deletions", Value::Array()).Set("entities", entities);
}

}  // namespace tether::evaluation
