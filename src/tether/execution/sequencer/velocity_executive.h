#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tether/control/constrained_velocity.h"
#include "tether/control/constraint_spec.h"
#include "tether/execution/sequencer/plan_runner.h"
#include "tether/planning/skeleton/action.h"
#include "tether/robot/model.h"
#include "tether/scene/scene.h"

namespace tether::execution {

/// Finds other actions that reach the goal from the present state of a plan, in place of `blocked` and those
/// after it; empty, with the reason, if there are none.
using Alternative = std::function<std::optional<std::vector<std::string>>(
    const std::vector<std::string>& done, const std::string& blocked, std::string& reason)>;

struct VelocityExecutiveOptions {
  double period = 0.005;  ///< Time between ticks, s.
  control::VelocityOptions controller;
  std::vector<control::ConstraintSpec> constraints;  ///< Those of the scenario.
  double acceleration = 0.5;    ///< How fast a verb's speed rises, m/s²; turning in rad/s².
  double turn_speed = 0.6;      ///< Of the hand, rad/s.
  double foot_gap = 0.0015;     ///< Held objects are released this high above a region, m.
  double least_width = 0.002;   ///< Closed further than this, the gripper holds nothing, m.
  double slip_distance = 0.03;  ///< An object displaced further in the hand is lost, m …
  double slip_angle = 0.6;      ///< … or turned further, rad.
  double stall_time = 2.0;      ///< A verb without progress for so long has stalled, s.
  double verb_timeout = 40;     ///< s
  int max_retries = 2;          ///< Per action.
  Alternative alternative;      ///< Asked when an action can't be done; none: the run fails then.
  int max_alternatives = 4;     ///< So often, per run.
  /// Throws InputError naming every field that is not finite or not positive.
  void Validate() const;
};

/// Executes a plan by joint velocities under constraints (paper B, section 3.2): nothing is planned between
/// key poses; each verb is an objective of control::ConstrainedVelocity, and walls, objects and limits are
/// kept at every tick, for the links and for what is held.
///
/// - Steps may have regions as targets: a reach then brings the control frame above the region, into it if it
///   is solid, or a held object onto its plane, within the point-cone if the verb asks for one.
/// - A plan without key poses will do: where a step needs a grasp and the plan has none, one from above is
///   chosen.
/// - Contact is exempt for the pairs under `allow`, for a held object against what it stood on until it is
///   clear of that, and against what carries the region that it is brought to; and while it is above either,
///   within its outline, against what lies beneath that.
/// - A reach is done when its own constraints hold as well. After an object was released in a region it is
///   checked that it is inside; if not, it is grasped again.
/// - After a contact the hand moves along with what it touched until it is clear of that.
/// - A verb without progress is reported with the constraints that stop it. Then a detour in joint space is
///   planned and followed under the same constraints, and the action is tried again; then other actions are
///   asked for (`alternative`); then the run fails.
///
/// Between events, Step() allocates nothing. Deterministic if `alternative` is. Detours and alternatives are
/// planned within one tick, for now, while the arm stands.
class VelocityExecutive final : public PlanRunner {
 public:
  /// Binds the plan's actions to `actions`. Throws InputError with everything that can't be executed: unknown
  /// names, steps that can't be bound, regions that are out of reach or too small for what is brought there.
  VelocityExecutive(const scene::Scene& scene,
                    const std::map<std::string, std::shared_ptr<const robot::Model>>& models,
                    const std::vector<planning::ActionSchema>& actions, planning::Plan plan,
                    const VelocityExecutiveOptions& options);
  ~VelocityExecutive() override;

  /// One tick. `observations` must hold every robot of the scene. After the end the arm stands.
  const robot::Commands& Step(const scene::WorldEstimate& estimate,
                              const robot::Observations& observations) override;
  const planning::Plan& plan() const override;
  const ExecutiveStatus& status() const override;
  int step() const override;
  const std::string& held() const override;
  const std::vector<Event>& events() const override;
  const std::vector<StepRecord>& records() const override;
  int retries() const override;
  int replans() const override;
  const std::vector<std::pair<std::string, std::string>>& allowed() const override;
  const std::vector<control::FieldConstraint>& verb_fields() const override;
  /// The controller as it was at the last tick.
  const control::ConstrainedVelocity& controller() const;

  struct Impl;

 private:
  std::unique_ptr<Impl> impl_;
};

}  // namespace tether::execution
