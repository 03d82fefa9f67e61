#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "tether/common/document/value.h"
#include "tether/control/arm_bodies.h"
#include "tether/control/constraint_spec.h"
#include "tether/execution/sequencer/constraint_builder.h"
#include "tether/execution/sequencer/plan_runner.h"
#include "tether/math/infinity.h"
#include "tether/robot/kinematics.h"
#include "tether/robot/model.h"
#include "tether/scene/scene.h"

namespace tether::evaluation {

/// The least margin of one constraint over a run.
struct Margin {
  std::string name;
  double minimum = math::kInfinity;  ///< Distance (or angle) less what is required; negative: violated.
  std::string unit;                  ///< "m", "rad" or "rad/s"
  std::string group;  ///< The panel in which it is drawn: "walls and table", "objects", "angles" …
  double time = 0;    ///< When, s.
  std::string what;   ///< Which bodies or joint.
  double last = math::kInfinity;  ///< The least since MarginMonitor::ForgetLast().
  /// Of a clearance: the least where the arm could vacate (VacateMonitor); infinite: it was not asked.
  double avoidable = math::kInfinity;

  /// A value that was measured at `time`, s, where `what_now` was.
  void Take(double value, double time_now, const std::string& what_now);
};

/// A margin in reports and records: name, minimum, unit, time_s, what; and minimum_avoidable where a
/// clearance is violated.
Value WriteMargin(const Margin& margin);

/// Measures margins from the true state, by the geometry of all bodies, without the controller's rows. One
/// margin per object of a clearance, one per other constraint, then self-collision and joint velocities; and
/// one per constraint of a verb from when it first applies, by its name: "cone to tray". Distances
/// above `range` (m) count as that.
class MarginMonitor {
 public:
  MarginMonitor(const scene::Scene& scene,
                const std::map<std::string, std::shared_ptr<const robot::Model>>& models,
                const std::string& robot, const std::vector<control::ConstraintSpec>& constraints,
                double range = 1.0);

  /// One tick. Pairs that `runner` allows are left out. `pushed`: the arm is pushed, or just was; it may then
  /// be a tenth faster than its limits. `avoidable`: the arm could vacate what it is too near to.
  void Observe(const scene::WorldEstimate& truth, const robot::Observations& observations,
               const execution::PlanRunner& runner, bool pushed = false, bool avoidable = true);
  /// Begins a new interval of the log.
  void ForgetLast();
  const std::vector<Margin>& margins() const { return margins_; }

 private:
  struct Clearance {
    size_t margin;
    int object;
    double distance;
    std::vector<int> bodies;
    bool held;
  };

  double Distance(int a, int b, double below) const;
  void ObserveField(const control::FieldConstraint& field, size_t margin, int held, double time);
  void ObserveClearances(double time, const execution::PlanRunner& runner);

  std::vector<control::ConstraintSpec> constraints_;
  execution::ControlScene scene_;
  std::shared_ptr<const robot::Model> model_;
  std::string robot_;
  robot::Kinematics kinematics_;
  control::ArmBodies bodies_;
  std::vector<control::FieldConstraint> fields_;
  std::vector<size_t> field_margins_;
  std::vector<Clearance> clearances_;
  std::vector<Margin> margins_;
  size_t joint_limits_ = 0, self_ = 0, velocity_ = 0;
  double joint_margin_ = 0;
  double range_;
  bool avoidable_ = true;
};

}  // namespace tether::evaluation
