#pragma once

#include <limits>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "tether/common/id.h"
#include "tether/control/arm_bodies.h"
#include "tether/execution/observer/event.h"
#include "tether/execution/sequencer/plan_runner.h"
#include "tether/execution/sequencer/resolved_plan.h"
#include "tether/robot/interface.h"
#include "tether/robot/model.h"
#include "tether/scene/scene.h"

namespace tether::execution {

/// An arm that is not the plan's.
struct OtherArm {
  std::string name;
  std::shared_ptr<const robot::Model> model;
  math::Pose X_WB;
  Eigen::VectorXd q;  ///< n, rad: as measured last.
};

/// What is sensed, and where execution stands. The sequencer writes it; the servos read it, record events and
/// set the gripper's opening and force where that is part of the motion. W: world, B: the robot's base, H:
/// its hand, O: an object.
struct Situation {
  Situation(const scene::Scene& scene_in, ResolvedPlan resolved,
            const std::map<std::string, std::shared_ptr<const robot::Model>>& models);

  /// Appends an event of now.
  void Record(EventKind kind, std::string text);

  int num_steps() const { return static_cast<int>(steps.size()); }
  /// Whether `step` is one of the plan's: not so after the end.
  bool in_plan() const { return step < num_steps(); }
  const ResolvedStep& current() const { return steps[step]; }
  /// The region that is the present step's target; null: it is none.
  const scene::Region* region() const {
    return current().region < 0 ? nullptr : &scene.regions[ToIndex(current().region)];
  }
  const planning::PlanStep& plan_step() const { return plan_step(step); }
  const planning::PlanStep& plan_step(int index) const { return plan.steps[ToIndex(index)]; }
  /// The verbs that are being executed: the step's, or those of a recovery.
  const std::vector<planning::Verb>& verbs() const { return recovering ? recovery : plan_step().execute; }
  const planning::Verb& present_verb() const { return verbs()[ToIndex(verb)]; }
  const scene::Object& object(ObjectId id) const { return scene.object(id); }
  const std::string& object_name(ObjectId id) const { return object(id).name; }
  /// The pose of a frame, and its velocity, in the world: m/s, rad/s.
  math::Pose X_WF(const AttachedFrame& frame) const;
  math::Vector6d V_WF(const AttachedFrame& frame) const;
  const math::Pose& X_WO(ObjectId object) const { return objects[object].X; }
  /// The latest step up to the present one that grasps the object; kNoStep: none does.
  int GraspStep(ObjectId object) const;
  StepRecord& record() { return records[step]; }

  const scene::Scene scene;
  planning::Plan plan;
  IndexedVector<int, ResolvedStep> steps;       ///< One per step of the plan.
  IndexedVector<ObjectId, ObjectId> stands_on;  ///< At the start; kNone: nothing that can move.
  IndexedVector<int, AttachedFrame> regions;    ///< Their frames, in the scene's order.
  const std::string robot;                      ///< The acting one's name.
  const std::shared_ptr<const robot::Model> model;
  const math::Pose X_WB;

  // What is known at this tick.
  double time = 0;           ///< s
  bool trustworthy = false;  ///< What the robot measured, or what is said instead, is finite.
  bool stopping = false;     ///< A fault: the arm is braked, and rests.
  Eigen::VectorXd q, v;      ///< n: rad, rad/s
  Eigen::VectorXd tau_external;
  double opening = 0;                                    ///< Between the fingers, m.
  IndexedVector<ObjectId, control::MovingPose> objects;  ///< In the world.
  std::vector<OtherArm> others;
  math::Pose X_WH;  ///< Written by the servo.
  math::Vector6d V_WH = math::Vector6d::Zero();

  // Where execution stands.
  ExecutiveStatus status;
  int step = 0;
  int verb = 0;
  bool recovering = false;
  std::vector<planning::Verb> recovery;
  ObjectId held;
  double held_since = 0;
  math::Pose X_HO_grasp;  ///< Of what is held, as it was grasped.
  ObjectId released;      ///< In this step.
  robot::GripperCommand gripper;
  std::map<int, int> retries;  ///< By index of the action.
  std::vector<Event> events;
  IndexedVector<int, StepRecord> records;
};

/// "12.3 mm"; from a metre on "1.2 m".
std::string Length(double metres);
/// "12.3 mm", with "and 4.0 degrees" if the angle (rad) is not zero.
std::string Deviation(double metres, double radians);

}  // namespace tether::execution
