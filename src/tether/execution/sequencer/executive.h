#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "tether/control/operational_space.h"
#include "tether/execution/observer/contact_detector.h"
#include "tether/execution/reference/pose_reference.h"
#include "tether/execution/reference/transit.h"
#include "tether/execution/sequencer/plan_runner.h"
#include "tether/execution/servo/torque_servo.h"
#include "tether/planning/plan/plan.h"
#include "tether/robot/interface.h"
#include "tether/robot/model.h"
#include "tether/scene/scene.h"

namespace tether::execution {

struct ExecutiveOptions {
  double period = 0.001;  ///< Time between ticks, s.
  control::OperationalSpaceGains gains;
  MotionLimits motion;  ///< Speeds are the lesser of these and the verb's.
  TransitMargins transit;
  ContactDetector::Options contact;
  double contact_search = 0.01;   ///< A reach until contact goes on so far beyond its pose, m.
  double leash = 0.02;            ///< The reference waits for a hand that is further behind, m.
  double obstacle_range = 0.05;   ///< Obstacle damping begins at this distance, m.
  double least_width = 0.002;     ///< Closed further than this, the gripper holds nothing, m.
  double slip_distance = 0.03;    ///< An object displaced further in the hand is lost, m …
  double slip_angle = 0.6;        ///< … or turned further, rad.
  double push_tolerance = 0.003;  ///< A push ends when the object is this near to its pose, m …
  double push_angle = 0.0175;     ///< … and turned from it by no more, rad.
  double push_limit = 0.03;       ///< A push that gets no nearer still succeeds this near to its pose, m.
  double stall_time = 1.5;        ///< A verb without progress for so long has stalled, s.
  double verb_timeout = 40;       ///< s
  int max_retries = 2;            ///< Per action.
  /// The constrained torque controller in place of the operational-space one.
  bool constrained = false;
  TorqueServoOptions servo;  ///< Its settings; the gains and the period are those above.
  /// Throws InputError naming every field that is not finite or not positive.
  void Validate() const;
};

/// Executes a plan: verb by verb, relative to where the objects are at each tick (Paper A, eq. (30a)), so
/// that the plan stays valid while they move. The hand is servoed to a reference that moves, in the frame of
/// the step's target, with bounded speed and acceleration towards the pose that is wanted there; the target's
/// own velocity is fed forward.
///
/// - The hand as control frame: a parallel gripper turned by half a turn about its approach grasps alike. Of
///   the two orientations, the one with more room to the joint limits is chosen, at the first reach of the
///   step.
/// - A held object as control frame is servoed through the hand, at the pose in the hand where it is now.
/// - Any other object as control frame is pushed by what the hand holds, or by the hand, until the *object*
///   is at its pose in the plan: the tool's goal follows from the object's pose at each tick (ERRATA A15).
///   See push.cc.
/// - A reach that isn't preceded by another one in its step is a transit: obstacles are passed above. Later
///   ones, and pushes, go straight.
/// - When a grasp is missed or lost, a push slips or a verb stalls, execution resumes at the step that can
///   mend it, at most `max_retries` times per action.
///
/// Step() allocates only where events are recorded; it neither blocks nor throws. Deterministic.
class Executive final : public PlanRunner {
 public:
  /// `models`: by robot name; robots other than the plan's hold their posture. Throws InputError with
  /// everything in the plan that can't be executed: unknown names, values that are not finite, a push without
  /// a pusher, an objective.
  Executive(const scene::Scene& scene,
            const std::map<std::string, std::shared_ptr<const robot::Model>>& models, planning::Plan plan,
            const ExecutiveOptions& options = {});
  ~Executive() override;
  Executive(Executive&&) noexcept;
  Executive& operator=(Executive&&) noexcept;

  /// One tick. `observations` must hold every robot of the scene; an object that the estimate lacks, or has
  /// at a pose that is not finite, keeps its last pose. After the end the arm holds its pose.
  const robot::Commands& Step(const scene::WorldEstimate& estimate,
                              const robot::Observations& observations) override;

  const planning::Plan& plan() const override;
  const ExecutiveStatus& status() const override;
  int step() const override;
  const std::string& held() const override;
  const std::vector<Event>& events() const override;
  const std::vector<StepRecord>& records() const override;
  int retries() const override;
  const std::vector<std::pair<std::string, std::string>>& allowed() const override;

  struct Impl;

 private:
  std::unique_ptr<Impl> impl_;
};

}  // namespace tether::execution
