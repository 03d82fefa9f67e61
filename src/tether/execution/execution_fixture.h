#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "tether/common/random.h"
#include "tether/execution/executive.h"
#include "tether/sim/world.h"

/// Scenes, plans and a loop for the tests of execution in physics.
namespace tether::execution {

struct RunResult {
  ExecutiveStatus status;
  double time = 0;
  std::vector<Event> events;
  std::vector<StepRecord> records;
  int retries = 0;
  scene::WorldEstimate truth;  ///< When the run had ended and things had come to rest.

  int Count(EventKind kind) const;
  std::string Log() const;
};

/// Called before each tick with the world and the events so far.
using Disturbance = std::function<void(sim::World&, const Executive&)>;

/// A table whose top is at z = 0, and a Panda at the world's origin.
scene::Scene TableScene();
scene::Object MakeObject(const std::string& name, const geometry::Shape& shape, const math::Pose& X_WO,
                         double mass = 0.1);
scene::Object MakeFixed(const std::string& name, const geometry::Shape& shape, const math::Pose& X_WO);

/// The L-shaped hook of Workspace Reach.
geometry::Shape HookShape();

/// Moves each movable object by up to 1 cm in the plane and turns it by up to 5° about the vertical.
void Perturb(scene::Scene* scene, Random* random);

/// Straight down, fingers closing along y of the object; the grasp point at p_OH of the object.
math::Pose TopGrasp(const Eigen::Vector3d& p_OH, double yaw = 0);

/// The steps of pick, place and push, with the verbs of the shipped action library.
class PlanBuilder {
 public:
  PlanBuilder();
  PlanBuilder& Pick(const std::string& a, const math::Pose& X_AH);
  PlanBuilder& Place(const std::string& a, const std::string& b, const math::Pose& X_BA);
  PlanBuilder& Push(const std::string& a, const std::string& b, const std::string& c, const math::Pose& X_BA,
                    const math::Pose& X_CB);
  PlanBuilder& Home(const math::Pose& X_WH);
  planning::Plan Build() const { return plan_; }

 private:
  planning::PlanStep& Add(const std::string& action, bool starts_action);
  planning::Plan plan_;
};

/// Runs the plan in physics until it ends or `limit` seconds have passed.
RunResult RunPlan(const scene::Scene& scene, const planning::Plan& plan, const Disturbance& disturb = {},
                  const ExecutiveOptions& options = {}, double limit = 120);

}  // namespace tether::execution
