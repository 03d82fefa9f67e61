#pragma once

#include <numbers>
#include <string>

#include "tether/common/random.h"
#include "tether/planning/plan/plan.h"
#include "tether/scene/scene.h"

/// Scenes and plans for the tests of execution, with and without physics.
namespace tether::execution {

inline scene::Object MakeFixed(const std::string& name, const geometry::Shape& shape,
                               const math::Pose& X_WO) {
  scene::Object object;
  object.name = name;
  object.shape = shape;
  object.X_ParentObject = X_WO;
  return object;
}

inline scene::Object MakeObject(const std::string& name, const geometry::Shape& shape, const math::Pose& X_WO,
                                double mass = 0.1) {
  scene::Object object = MakeFixed(name, shape, X_WO);
  object.mass = mass;
  return object;
}

/// A table whose top is at z = 0, and a Panda at the world's origin.
inline scene::Scene TableScene() {
  scene::Scene scene;
  scene.objects.push_back(MakeFixed("table", geometry::Primitive(geometry::Box{{2.0, 1.4, 0.5}}),
                                    math::Pose(Eigen::Vector3d(0.5, 0, -0.25))));
  scene::Robot robot;
  robot.name = "panda";
  robot.model = "panda";
  robot.q = {0, -0.5236, 0, -2.6180, 0, 2.0944, 0};
  scene.robots.push_back(robot);
  return scene;
}

/// The L-shaped hook of Workspace Reach.
inline geometry::Shape HookShape() {
  geometry::Part handle{geometry::Capsule{0.01, 0.25},
                        math::Pose(math::RotationFromRpy({0, std::numbers::pi / 2, 0}), {-0.09, 0.05, 0})};
  geometry::Part head{geometry::Capsule{0.01, 0.10},
                      math::Pose(math::RotationFromRpy({std::numbers::pi / 2, 0, 0}), {0.035, 0, 0})};
  return geometry::Shape({handle, head});
}

/// Moves each movable object by up to 1 cm in the plane and turns it by up to 5° about the vertical.
inline void Perturb(scene::Scene* scene, Random* random) {
  for (scene::Object& object : scene->objects) {
    if (!object.movable()) continue;
    const double yaw = random->Uniform(-1, 1) * 5 * std::numbers::pi / 180;
    object.X_ParentObject.p +=
        Eigen::Vector3d(random->Uniform(-0.007, 0.007), random->Uniform(-0.007, 0.007), 0);
    object.X_ParentObject.R = math::ExpSO3({0, 0, yaw}) * object.X_ParentObject.R;
  }
}

/// Straight down, fingers closing along y of the object when yaw is 0; the grasp point at p_OH of the object.
inline math::Pose TopGrasp(const Eigen::Vector3d& p_OH, double yaw = 0) {
  return {math::ExpSO3({0, 0, yaw}) * math::RotationFromRpy({std::numbers::pi, 0, 0}), p_OH};
}

/// The steps of pick, place and push, with the verbs of the shipped action library.
class PlanBuilder {
 public:
  PlanBuilder();
  PlanBuilder& Pick(const std::string& a, const math::Pose& X_AH);
  PlanBuilder& Place(const std::string& a, const std::string& b, const math::Pose& X_BA);
  PlanBuilder& Push(const std::string& a, const std::string& b, const std::string& c, const math::Pose& X_BA,
                    const math::Pose& X_CB);
  PlanBuilder& Home(const math::Pose& X_WH);
  planning::Plan Build() const {
    planning::Plan plan = plan_;
    planning::SetModes(&plan);
    return plan;
  }

 private:
  planning::PlanStep& Add(const std::string& action, bool starts_action);
  planning::Plan plan_;
};

inline PlanBuilder::PlanBuilder() {
  plan_.scenario = "test";
  plan_.robot = "panda";
}

inline planning::PlanStep& PlanBuilder::Add(const std::string& action, bool starts_action) {
  if (starts_action) plan_.actions.push_back(action);
  planning::PlanStep& step = plan_.steps.emplace_back();
  step.action = action;
  step.action_index = static_cast<int>(plan_.actions.size()) - 1;
  return step;
}

inline PlanBuilder& PlanBuilder::Pick(const std::string& a, const math::Pose& X_AH) {
  planning::PlanStep& step = Add("pick(" + a + ")", true);
  step.control = "hand";
  step.target = a;
  step.X_TC = X_AH;
  planning::ReachVerb approach;
  approach.offset = {0, 0, -0.13};
  planning::ReachVerb reach;
  reach.speed = 0.1;
  reach.position_tolerance = 0.003;
  reach.rotation_tolerance = 0.03;
  planning::ShiftVerb lift;
  lift.by = {0, 0, 0.08};
  step.execute = {planning::GripperVerb{}, approach, reach, planning::GripperVerb{a, 20}, lift};
  return *this;
}

inline PlanBuilder& PlanBuilder::Place(const std::string& a, const std::string& b, const math::Pose& X_BA) {
  planning::PlanStep& step = Add("place(" + a + "," + b + ")", true);
  step.control = a;
  step.target = b;
  step.X_TC = X_BA;
  planning::ReachVerb approach;
  approach.offset = {0, 0, 0.08};
  approach.in = planning::In::kWorld;
  planning::ReachVerb down;
  down.speed = 0.05;
  down.until_contact = true;
  planning::ShiftVerb away;
  away.by = {0, 0, -0.10};
  away.in = planning::In::kHand;
  step.execute = {approach, down, planning::GripperVerb{}, away};
  return *this;
}

inline PlanBuilder& PlanBuilder::Push(const std::string& a, const std::string& b, const std::string& c,
                                      const math::Pose& X_BA, const math::Pose& X_CB) {
  const std::string action = "push(" + a + "," + b + "," + c + ")";
  planning::PlanStep& touch = Add(action, true);
  touch.control = a;
  touch.target = b;
  touch.X_TC = X_BA;
  planning::ReachVerb approach;
  approach.offset = {0, 0, 0.05};
  approach.in = planning::In::kWorld;
  planning::ReachVerb slow;
  slow.speed = 0.05;
  touch.execute = {approach, slow};
  planning::PlanStep& push = Add(action, false);
  push.control = b;
  push.target = c;
  push.X_TC = X_CB;
  planning::ShiftVerb lift;
  lift.by = {0, 0, 0.08};
  push.execute = {slow, lift};
  return *this;
}

inline PlanBuilder& PlanBuilder::Home(const math::Pose& X_WH) {
  planning::PlanStep& step = Add("home", true);
  step.control = "hand";
  step.target = scene::kWorld;
  step.X_TC = X_WH;
  step.execute = {planning::ReachVerb{}};
  return *this;
}

}  // namespace tether::execution
