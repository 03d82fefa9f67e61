#include "tether/execution/sequencer/constraint_builder.h"

#include <algorithm>

#include "tether/constraints/core/field_function.h"

namespace tether::execution {
namespace {

using Eigen::Vector3d;

// Angles that are narrower than this are buffered by half of them, rad.
constexpr double kNarrow = 0.01;

control::Frame CarriedFrame(const std::string& name, const ControlScene& scene) {
  if (name == "hand") return {};
  if (name == "held") return {control::kHeld, {}};
  return {scene.ObjectIndex(name), {}};
}

}  // namespace

ControlScene::ControlScene(const scene::Scene& scene, const std::string& robot)
    : scene_(scene), X_WBase_(scene.InitialPose(robot)) {
  for (const scene::Object& object : scene.objects) {
    index_[object.name] = static_cast<int>(solids_.size());
    solids_.push_back({object.name, object.shape, object.movable()});
  }
}

int ControlScene::ObjectIndex(const std::string& name) const {
  const auto found = index_.find(name);
  return found == index_.end() ? -1 : found->second;
}

control::Frame ControlScene::Target(const std::string& name) const {
  std::string frame = name.ends_with("/base") ? name.substr(0, name.size() - 5) : name;
  math::Pose X_FrameTarget;
  while (frame != scene::kWorld) {
    if (const int object = ObjectIndex(frame); object >= 0) return {object, X_FrameTarget};
    if (const scene::Region* region = scene_.FindRegion(frame)) {
      X_FrameTarget = region->X_ParentRegion * X_FrameTarget;
      frame = region->parent;
    } else if (const scene::Robot* robot = scene_.FindRobot(frame)) {
      X_FrameTarget = robot->X_ParentBase * X_FrameTarget;
      frame = robot->parent;
    } else {
      break;
    }
  }
  return {-1, X_WBase_.Inverse() * X_FrameTarget};
}

std::string ControlScene::SupportOf(const std::string& name) const {
  const control::Frame frame = Target(name);
  return frame.object < 0 ? "" : solids_[static_cast<size_t>(frame.object)].name;
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
                                  const ControlScene& scene, const control::ArmBodies& bodies,
                                  int last_link) {
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

}  // namespace tether::execution
