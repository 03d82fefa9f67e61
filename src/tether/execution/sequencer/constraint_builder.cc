#include "tether/execution/sequencer/constraint_builder.h"

#include <algorithm>

#include "tether/constraints/core/field_function.h"

namespace tether::execution {
namespace {

using Eigen::Vector3d;
using math::Pose;

// Angles that are narrower than this are buffered by half of them, rad.
constexpr double kNarrow = 0.01;
// Cones begin at least so high above their region, m.
constexpr double kLeastHeight = 0.02;
// Shares: of the buffer, the room at a cone's start (a frustum has sides in two directions); of the least
// angle of `upright`, its buffer.
constexpr double kStartRoom = 1.5, kUprightShare = 0.25;
// Regions too small for what is brought there still leave this radius, m.
constexpr double kLeastRadius = 0.001;

control::Frame CarriedFrame(const std::string& name, const ControlScene& scene) {
  if (name == "hand") return {};
  if (name == "held") return {control::kHeld, {}};
  return {scene.Find(name).value(), {}};
}

}  // namespace

ControlScene::ControlScene(const scene::Scene& scene, const std::string& robot)
    : scene_(scene), X_WBase_(scene.InitialPose(robot)) {
  for (const scene::Object& object : scene.objects) {
    index_[object.name] = ObjectId(solids_.size());
    solids_.push_back({object.name, object.shape, object.movable()});
  }
}

ObjectId ControlScene::Find(const std::string& name) const {
  const auto found = index_.find(name);
  return found == index_.end() ? ObjectId() : found->second;
}

control::Frame ControlScene::Target(const std::string& name) const {
  const std::string frame = name.ends_with("/base") ? name.substr(0, name.size() - 5) : name;
  return Target(FindFrame(scene_, frame).value_or(AttachedFrame{}));
}

control::Frame ControlScene::Target(const AttachedFrame& frame) const {
  if (frame.object != kNone) return {frame.object.value(), frame.X_OF};
  return {-1, X_WBase_.Inverse() * frame.X_OF};
}

std::string ControlScene::SupportOf(const std::string& name) const {
  const control::Frame frame = Target(name);
  return frame.object < 0 ? "" : solids_[ToIndex(frame.object)].name;
}

control::FieldConstraint BuildField(const control::ConstraintSpec& spec, const ControlScene& scene) {
  control::FieldConstraint field;
  field.name = control::Describe(spec);
  field.priority = spec.relax.value_or(0);
  field.frame = CarriedFrame(spec.frame, scene);
  if (spec.kind == "outside") {
    field.target = scene.Target(spec.around);
    field.function = constraints::MakeAxisDistance(Vector3d::Zero(), Vector3d::UnitZ(), Vector3d::Zero(),
                                                   spec.cylinder, -1);
  } else {
    field.target = scene.Target(scene::kWorld);
    field.function = constraints::MakeAngle(spec.axis, spec.from, spec.max);
    if (spec.max < kNarrow) field.buffer = spec.max / 2;
  }
  return field;
}

BuiltConstraints BuildConstraints(const std::vector<control::ConstraintSpec>& specs,
                                  const ControlScene& scene, const control::ArmBodies& bodies) {
  const int last_link = bodies.link(bodies.hand());
  BuiltConstraints built;
  for (const control::ConstraintSpec& spec : specs) {
    if (spec.kind == "joint_limits") {
      built.joint_margin = std::max(built.joint_margin, spec.margin);
    } else if (spec.kind == "clearance") {
      control::ClearanceConstraint clearance;
      clearance.name = control::Describe(spec);
      clearance.distance = spec.distance;
      clearance.priority = spec.relax.value_or(0);
      for (const std::string& of : spec.of) {
        clearance.held = clearance.held || of == "held";
        for (int body = 0; body <= bodies.hand() && of != "held"; ++body) {
          const bool counts = of == "links" || bodies.link(body) == last_link;
          if (counts && std::find(clearance.of.begin(), clearance.of.end(), body) == clearance.of.end()) {
            clearance.of.push_back(body);
          }
        }
      }
      for (const std::string& to : spec.to) {
        for (size_t i = 0; i < scene.solids().size(); ++i) {
          const control::Solid& solid = scene.solids()[i];
          const int index = static_cast<int>(i);
          const bool counts = to == solid.name || (to == "objects" && solid.movable);
          if (counts && std::find(clearance.to.begin(), clearance.to.end(), index) == clearance.to.end()) {
            clearance.to.push_back(index);
          }
        }
      }
      built.clearances.push_back(std::move(clearance));
    } else {
      built.fields.push_back(BuildField(spec, scene));
    }
  }
  return built;
}

control::FieldConstraint BuildRegionField(const control::ConstraintSpec& spec, const scene::Region& region,
                                          const RegionReach& reach, double buffer) {
  control::FieldConstraint field;
  field.name = spec.kind + " to " + region.name;
  field.priority = spec.relax.value_or(0);
  field.target = reach.target;
  field.frame = reach.frame;
  Vector3d start = reach.p_TF;
  if (spec.kind == "cone") {
    field.target.X_OF = field.target.X_OF * Pose(Vector3d(0, 0, reach.end_height));
    start.z() -= reach.end_height;
    // It begins with the buffer's room: what is at its edge will be beyond it now and then.
    const double across = start.head<2>().norm();
    if (across > 1e-6) start.head<2>() *= (across + kStartRoom * buffer) / across;
  }
  start.z() = std::max(start.z(), kLeastHeight);
  if (spec.kind == "upright") {
    field.buffer = kUprightShare * spec.max;  // it becomes nearly as narrow as things stand
    field.function = constraints::MakeNarrowingAngle(reach.up_F, Vector3d::UnitZ(), spec.max, spec.per_height,
                                                     Vector3d::Zero());
  } else if (const auto* disc = std::get_if<scene::Disc>(&region.form)) {
    field.function = constraints::MakePointCone(
        std::max(kLeastRadius, disc->radius - reach.radius - spec.margin), start, Vector3d::Zero());
  } else {
    const Eigen::Vector2d size = std::get<scene::Rectangle>(region.form).size;
    field.function = constraints::MakeFrustum(
        (size.array() - 2 * (reach.radius + spec.margin)).max(2 * kLeastRadius).matrix(), start,
        Vector3d::Zero());
  }
  return field;
}

}  // namespace tether::execution
