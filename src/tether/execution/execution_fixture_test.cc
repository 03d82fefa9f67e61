#include <cmath>
#include <cstdio>
#include <numbers>

#include "tether/execution/execution_fixture.h"

namespace tether::execution {

using math::Pose;
using planning::GripperVerb;
using planning::In;
using planning::ReachVerb;
using planning::ShiftVerb;

int RunResult::Count(EventKind kind) const {
  int count = 0;
  for (const Event& event : events) count += event.kind == kind;
  return count;
}

std::string RunResult::Log() const {
  std::string log;
  for (const Event& event : events) {
    char line[256];
    std::snprintf(line, sizeof line, "%8.3f s  step %d  %-16s %s\n", event.time, event.step,
                  std::string(ToString(event.kind)).c_str(), event.text.c_str());
    log += line;
  }
  return log;
}

scene::Object MakeFixed(const std::string& name, const geometry::Shape& shape, const Pose& X_WO) {
  scene::Object object;
  object.name = name;
  object.shape = shape;
  object.X_ParentObject = X_WO;
  return object;
}

scene::Object MakeObject(const std::string& name, const geometry::Shape& shape, const Pose& X_WO,
                         double mass) {
  scene::Object object = MakeFixed(name, shape, X_WO);
  object.mass = mass;
  return object;
}

scene::Scene TableScene() {
  scene::Scene scene;
  scene.objects.push_back(MakeFixed("table", geometry::Primitive(geometry::Box{{2.0, 1.4, 0.5}}),
                                    Pose(Eigen::Vector3d(0.5, 0, -0.25))));
  scene::Robot robot;
  robot.name = "panda";
  robot.model = "panda";
  robot.q = {0, -0.5236, 0, -2.6180, 0, 2.0944, 0};
  scene.robots.push_back(robot);
  return scene;
}

geometry::Shape HookShape() {
  geometry::Part handle{geometry::Capsule{0.01, 0.25},
                        Pose(math::RotationFromRpy({0, std::numbers::pi / 2, 0}), {-0.09, 0.05, 0})};
  geometry::Part head{geometry::Capsule{0.01, 0.10},
                      Pose(math::RotationFromRpy({std::numbers::pi / 2, 0, 0}), {0.035, 0, 0})};
  return geometry::Shape({handle, head});
}

void Perturb(scene::Scene* scene, Random* random) {
  for (scene::Object& object : scene->objects) {
    if (!object.movable()) continue;
    const double yaw = random->Uniform(-1, 1) * 5 * std::numbers::pi / 180;
    object.X_ParentObject.p +=
        Eigen::Vector3d(random->Uniform(-0.007, 0.007), random->Uniform(-0.007, 0.007), 0);
    object.X_ParentObject.R = math::ExpSO3({0, 0, yaw}) * object.X_ParentObject.R;
  }
}

Pose TopGrasp(const Eigen::Vector3d& p_OH, double yaw) {
  return {math::ExpSO3({0, 0, yaw}) * math::RotationFromRpy({std::numbers::pi, 0, 0}), p_OH};
}

PlanBuilder::PlanBuilder() {
  plan_.scenario = "test";
  plan_.robot = "panda";
}

planning::PlanStep& PlanBuilder::Add(const std::string& action, bool starts_action) {
  if (starts_action) plan_.actions.push_back(action);
  planning::PlanStep& step = plan_.steps.emplace_back();
  step.action = action;
  step.action_index = static_cast<int>(plan_.actions.size()) - 1;
  return step;
}

PlanBuilder& PlanBuilder::Pick(const std::string& a, const Pose& X_AH) {
  planning::PlanStep& step = Add("pick(" + a + ")", true);
  step.control = "hand";
  step.target = a;
  step.X_TC = X_AH;
  ReachVerb approach;
  approach.offset = {0, 0, -0.13};
  ReachVerb reach;
  reach.speed = 0.1;
  reach.position_tolerance = 0.003;
  reach.rotation_tolerance = 0.03;
  ShiftVerb lift;
  lift.by = {0, 0, 0.08};
  step.execute = {GripperVerb{}, approach, reach, GripperVerb{a, 20}, lift};
  return *this;
}

PlanBuilder& PlanBuilder::Place(const std::string& a, const std::string& b, const Pose& X_BA) {
  planning::PlanStep& step = Add("place(" + a + "," + b + ")", true);
  step.control = a;
  step.target = b;
  step.X_TC = X_BA;
  ReachVerb approach;
  approach.offset = {0, 0, 0.08};
  approach.in = In::kWorld;
  ReachVerb down;
  down.speed = 0.05;
  down.until_contact = true;
  ShiftVerb away;
  away.by = {0, 0, -0.10};
  away.in = In::kHand;
  step.execute = {approach, down, GripperVerb{}, away};
  return *this;
}

PlanBuilder& PlanBuilder::Push(const std::string& a, const std::string& b, const std::string& c,
                               const Pose& X_BA, const Pose& X_CB) {
  const std::string action = "push(" + a + "," + b + "," + c + ")";
  planning::PlanStep& touch = Add(action, true);
  touch.control = a;
  touch.target = b;
  touch.X_TC = X_BA;
  ReachVerb approach;
  approach.offset = {0, 0, 0.05};
  approach.in = In::kWorld;
  ReachVerb slow;
  slow.speed = 0.05;
  touch.execute = {approach, slow};
  planning::PlanStep& push = Add(action, false);
  push.control = b;
  push.target = c;
  push.X_TC = X_CB;
  ShiftVerb lift;
  lift.by = {0, 0, 0.08};
  push.execute = {slow, lift};
  return *this;
}

PlanBuilder& PlanBuilder::Home(const Pose& X_WH) {
  planning::PlanStep& step = Add("home", true);
  step.control = "hand";
  step.target = scene::kWorld;
  step.X_TC = X_WH;
  step.execute = {ReachVerb{}};
  return *this;
}

RunResult RunPlan(const scene::Scene& scene, const planning::Plan& plan, const Disturbance& disturb,
                  const ExecutiveOptions& options, double limit) {
  static const auto panda = robot::Model::Load("panda");
  const std::map<std::string, std::shared_ptr<const robot::Model>> models{{"panda", panda}};
  sim::World world(scene, models);
  Executive executive(scene, models, plan, options);
  robot::Observations observations = world.Observe();
  scene::WorldEstimate estimate = world.Truth();
  double rest = 0;
  while (world.time() < limit && rest < 0.3) {
    if (!executive.running()) rest += options.period;
    if (disturb) disturb(world, executive);
    world.Observe(&observations);
    world.Truth(&estimate);
    world.Apply(executive.Step(estimate, observations), options.period);
  }
  return {executive.status(),  world.time(),        executive.events(),
          executive.records(), executive.retries(), world.Truth()};
}

}  // namespace tether::execution
