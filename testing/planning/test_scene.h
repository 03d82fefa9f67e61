#pragma once

#include "tether/planning/plan/problem.h"
#include "tether/planning/skeleton/action_reader.h"

namespace tether::planning {

/// Workspace Reach as built in, for the tests of this room.
inline scene::Scene ReachScene() {
  using Eigen::Vector3d;
  scene::Scene scene;
  const auto add = [&](const std::string& name, geometry::Shape shape, const std::string& parent,
                       const Vector3d& p, bool movable) {
    scene::Object object;
    object.name = name;
    object.shape = std::move(shape);
    object.parent = parent;
    object.X_ParentObject = math::Pose(p);
    if (movable) object.mass = 0.1;
    scene.objects.push_back(std::move(object));
  };
  add("table", geometry::Shape(geometry::Box{{2, 1, 0.5}}), "world", {0.5, 0, -0.25}, false);
  add("shelf", geometry::Shape(geometry::Box{{0.3, 0.3, 0.1}}), "world", {0.35, -0.35, 0.05}, false);
  add("box", geometry::Shape(geometry::Box{{0.05, 0.05, 0.05}}), "table", {0.4, 0, 0.275}, true);
  const geometry::Part handle{
      geometry::Capsule{0.01, 0.25},
      math::Pose(math::RotationFromRpy({0, 1.5707963267948966, 0}), {-0.09, 0.05, 0})};
  const geometry::Part head{geometry::Capsule{0.01, 0.1},
                            math::Pose(math::RotationFromRpy({1.5707963267948966, 0, 0}), {0.035, 0, 0})};
  add("hook", geometry::Shape(std::vector<geometry::Part>{handle, head}), "table", {0.4, 0.3, 0.26}, true);
  scene.regions.push_back({"workspace", geometry::Primitive(geometry::Box{{0.8, 1, 1}}), "world",
                           math::Pose(Vector3d(0.6, 0, 0))});
  scene.robots.push_back({"panda", "panda", {0, -0.5236, 0, -2.6180, 0, 2.0944, 0}, "world", {}});
  return scene;
}

/// A problem over a scene whose first robot is a Panda, with the shipped actions.
inline Problem PandaProblem(scene::Scene scene) {
  Problem problem;
  problem.title = "test";
  problem.scene = std::move(scene);
  problem.actions = ReadActions(robot::DataDirectory() + "/models/actions/manipulation.yaml");
  problem.robot.name = "panda";
  problem.robot.model = robot::Model::Load("panda");
  robot::State state(problem.robot.model);
  const std::vector<double>& q = problem.scene.robots[0].q;
  state.Set(Eigen::Map<const Eigen::VectorXd>(q.data(), static_cast<Eigen::Index>(q.size())),
            Eigen::VectorXd::Zero(static_cast<Eigen::Index>(q.size())));
  problem.robot.X_WHand = state.X_BH();
  return problem;
}

inline Problem ReachProblem() { return PandaProblem(ReachScene()); }

}  // namespace tether::planning
