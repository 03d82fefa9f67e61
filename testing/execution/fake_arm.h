#pragma once

#include <algorithm>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tether/execution/sequencer/velocity_executive.h"
#include "tether/planning/skeleton/action_reader.h"
#include "tether/robot/kinematics.h"

/// A scene with regions, and an arm without physics, for the tests of the velocity executive.
namespace tether::execution {

/// A table with two regions, a hub above it, and a block in the first region.
inline scene::Scene MakeRegionScene() {
  scene::Scene scene;
  const auto add = [&](const char* name, const Eigen::Vector3d& size, const char* parent,
                       const Eigen::Vector3d& p, std::optional<double> mass) {
    scene::Object object;
    object.name = name;
    object.shape = geometry::Primitive(geometry::Box{size});
    object.parent = parent;
    object.X_ParentObject = math::Pose(p);
    object.mass = mass;
    scene.objects.push_back(object);
  };
  add("table", {1.4, 1.8, 0.04}, "world", {0, 0, -0.02}, {});
  add("block", {0.06, 0.04, 0.10}, "left", {0.005, -0.01, 0.05}, 0.1);
  const auto region = [&](const char* name, const scene::RegionForm& form, const char* parent,
                          const Eigen::Vector3d& p) {
    scene::Region one;
    one.name = name;
    one.form = form;
    one.parent = parent;
    one.X_ParentRegion = math::Pose(p);
    scene.regions.push_back(one);
  };
  region("left", scene::Disc{0.06}, "table", {0.35, 0.3, 0.02});
  region("right", scene::Disc{0.06}, "table", {0.3, -0.35, 0.02});
  region("square", scene::Rectangle{{0.12, 0.12}}, "table", {0.45, 0.0, 0.02});
  region("hub", geometry::Primitive(geometry::Sphere{0.05}), "world", {0.3, 0, 0.35});
  scene.regions.back().hub = true;
  scene.regions[1].dwell = 0.5;
  scene::Robot robot;
  robot.name = "jaco";
  robot.model = "j2n6s300";
  scene.robots.push_back(robot);
  return scene;
}

inline const std::vector<planning::ActionSchema>& RegionActions() {
  static const auto actions = planning::ReadActions(robot::DataDirectory() + "/models/actions/regions.yaml");
  return actions;
}

inline std::shared_ptr<const robot::Model> Jaco() {
  static const auto model = robot::Model::Load("j2n6s300");
  return model;
}

/// The arm follows its velocities exactly; the gripper closes on what is between its fingers, which then
/// moves with the hand.
struct FakeArm {
  scene::Scene scene = MakeRegionScene();
  VelocityExecutiveOptions options;
  scene::WorldEstimate truth;
  robot::Observations observations;
  robot::Kinematics kinematics{Jaco()};
  std::string held;
  math::Pose X_HO;
  std::unique_ptr<VelocityExecutive> executive;

  FakeArm() {
    control::ConstraintSpec clearance;
    clearance.kind = "clearance";
    clearance.of = {"links", "held"};
    clearance.to = {"table", "objects"};
    clearance.distance = 0.01;
    options.constraints = {clearance};
    options.controller.gain = 3;
  }

  void Start(const std::vector<std::string>& plan_actions) {
    planning::Plan plan;
    plan.actions = plan_actions;
    executive = std::make_unique<VelocityExecutive>(
        scene, std::map<std::string, std::shared_ptr<const robot::Model>>{{"jaco", Jaco()}}, RegionActions(),
        plan, options);
    truth.time = 0;
    for (const scene::Object& object : scene.objects)
      truth.X_WO[object.name] = scene.InitialPose(object.name);
    robot::Observation& seen = observations["jaco"];
    seen.q = Jaco()->home();
    seen.v = Eigen::VectorXd::Zero(6);
    seen.gripper_opening = Jaco()->gripper().max_opening;
  }

  /// One tick; `disturb` may change the world before it.
  void Tick() {
    const robot::Command& command = executive->Step(truth, observations).at("jaco");
    robot::Observation& seen = observations["jaco"];
    seen.q += options.period * command.velocity;
    kinematics.Set(seen.q);
    const bool closing = command.gripper.mode == robot::GripperCommand::Mode::kForce;
    const double wanted = closing ? (held.empty() && !Between() ? 0.0 : 0.04) : command.gripper.opening;
    const double step = 0.2 * options.period;
    seen.gripper_opening += std::clamp(wanted - seen.gripper_opening, -step, step);
    if (closing && held.empty() && Between() && seen.gripper_opening <= 0.04) {
      held = "block";
      X_HO = math::Between(kinematics.X_BH(), truth.X_WO["block"]);
    }
    if (!closing) held.clear();
    if (!held.empty()) truth.X_WO[held] = kinematics.X_BH() * X_HO;
    truth.time += options.period;
    seen.time = truth.time;
  }
  bool Between() const { return (kinematics.X_BH().p - truth.X_WO.at("block").p).norm() < 0.05; }

  void Run(
      double seconds, const std::function<void()>& each = [] {}) {
    for (const double end = truth.time + seconds; executive->running() && truth.time < end;) {
      each();
      Tick();
    }
  }

  std::string Story() const {
    std::string text;
    for (const Event& event : executive->events())
      text += std::to_string(event.time) + " " + std::string(ToString(event.kind)) + " " + event.text + "\n";
    return text;
  }
  bool Happened(EventKind kind, const std::string& text = "") const {
    for (const Event& event : executive->events()) {
      if (event.kind == kind && event.text.find(text) != std::string::npos) return true;
    }
    return false;
  }
};

}  // namespace tether::execution
