#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tether/control/constraint_spec.h"
#include "tether/execution/reference/arm_transit_options.h"
#include "tether/execution/servo/situation.h"
#include "tether/motion/trajectory.h"
#include "tether/motion/transit_search.h"
#include "tether/robot/kinematics.h"

namespace tether::execution {

/// So often in a step or reach a path is looked for; then the hand goes straight.
inline constexpr int kMostTransits = 6;
/// Whether a goal of the hand is so near that it is reached along a straight line.
bool IsNearForTransit(const math::Pose& X_BH, const math::Pose& X_BGoal);
/// Whether a goal has moved so far since a path to it was found that it gets another one.
bool HasMovedForTransit(const math::Pose& X_BGoal, const math::Pose& X_BGoalThen);

/// The motion of the whole arm from where it stands to a pose of the hand: found around everything that
/// stands there, timed, followed sample by sample, watched, and braked when something comes into it. The
/// same whatever follows it.
class ArmTransit {
 public:
  /// `constraints`: those of the scenario; paths keep its tilts, not the others.
  ArmTransit(const Situation& situation, const ArmTransitOptions& options,
             const std::vector<control::ConstraintSpec>& constraints);

  /// Whether an object moves with the hand: what is held, and what stands on that.
  using MovesWithHand = std::function<bool(ObjectId object)>;

  /// Finds a motion from `q`, where the arm moves at `v`, to one of the goals. False, with why() and
  /// blocker() set, if there is none. `known`: the plan's path, which is used if it is still free; may be
  /// null.
  bool Begin(const Eigen::VectorXd& q, const Eigen::VectorXd& v, std::vector<motion::TransitGoal> goals,
             const MovesWithHand& moves_with_hand, const std::vector<Eigen::VectorXd>* known = nullptr);
  bool active() const { return active_; }
  void Stop() { active_ = false; }

  /// Goes on by `dt` (s) at a share `rate` of the trajectory's speed, changed no faster than the arm can
  /// brake. Allocates nothing.
  void Advance(double dt, double rate);
  /// Comes to rest on the path; at_rest() says when.
  void Brake() { braking_ = true; }
  bool braking() const { return braking_; }
  bool at_rest() const { return braking_ && rate_ == 0; }
  /// The end of the trajectory is reached.
  bool done() const { return time_ >= trajectory_.duration(); }
  /// Whether what is left of the path is free of what stands there now. Looks only where something has moved.
  bool IsFreeAhead();

  /// n: where the joints shall be now.
  const motion::JointReference& joints() const { return joints_; }
  /// n: where they shall be in the end.
  const Eigen::VectorXd& end() const { return transit_.path.back(); }
  int goal() const { return transit_.goal; }  ///< Index of the goal that the path leads to.
  std::string Describe() const;               ///< "1.2 s along 5 configurations"
  motion::PathStatus status() const { return transit_.status; }
  const std::string& why() const { return transit_.reason; }
  const std::string& blocker() const { return transit_.blocker; }

 private:
  motion::Snapshot TakeSnapshot() const;
  std::optional<motion::TiltLimit> FindTilt() const;
  void Time(motion::Snapshot snapshot);
  void TakeUpVelocity(const Eigen::VectorXd& v);
  void Evaluate();

  const Situation& s_;
  const ArmTransitOptions options_;
  std::vector<control::ConstraintSpec> tilts_;
  robot::State state_;
  MovesWithHand moves_with_hand_;
  motion::Transit transit_;
  motion::Trajectory trajectory_;
  motion::JointReference joints_;
  IndexedVector<ObjectId, math::Pose> seen_;  ///< The objects' poses when the path was last found free.
  bool active_ = false, braking_ = false;
  double time_ = 0, rate_ = 1, next_look_ = 0;
  Eigen::VectorXd v_start_;  ///< How the arm moved as the transit began …
  double take_up_time_ = 0;  ///< … which has ended after this time, s.
};

}  // namespace tether::execution
