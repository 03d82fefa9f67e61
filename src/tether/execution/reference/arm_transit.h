#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "tether/execution/servo/situation.h"
#include "tether/motion/trajectory.h"
#include "tether/motion/transit_search.h"
#include "tether/robot/kinematics.h"

namespace tether::execution {

struct ArmTransitOptions {
  double clearance = 0.01;          ///< That paths keep from everything where there is room, m.
  int64_t max_checks = 300'000;     ///< Of configurations, per path.
  double velocity_share = 0.75;     ///< Of the joints' greatest velocities …
  double acceleration_share = 0.7;  ///< … accelerations …
  double jerk_share = 0.5;          ///< … and jerks.
  double hand_speed = 1.2;          ///< m/s
  double hand_acceleration = 8;     ///< m/s² …
  double held_acceleration = 5;     ///< … and with something in the hand.
  double look_ahead_period = 0.02;  ///< The path ahead is checked so often, s.
};

/// The motion of the whole arm from where it stands to a pose of the hand: found around everything that
/// stands there, timed, followed sample by sample, watched, and braked when something comes into it. The
/// same whatever follows it.
class ArmTransit {
 public:
  ArmTransit(const Situation& situation, const ArmTransitOptions& options);

  /// Whether an object moves with the hand: what is held, and what stands on that.
  using MovesWithHand = std::function<bool(ObjectId object)>;

  /// Finds a motion from `q` (at rest) to one of the goals. False, with why() and blocker() set, if there is
  /// none. `known`: the plan's path, which is used if it is still free; may be null.
  bool Begin(const Eigen::VectorXd& q, std::vector<motion::TransitGoal> goals,
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
  int goal() const { return transit_.goal; }  ///< Index of the goal that the path leads to.
  std::string Describe() const;               ///< "1.2 s along 5 configurations"
  motion::PathStatus status() const { return transit_.status; }
  const std::string& why() const { return transit_.reason; }
  const std::string& blocker() const { return transit_.blocker; }

 private:
  motion::Snapshot TakeSnapshot() const;
  void Time(motion::Snapshot snapshot);

  const Situation& s_;
  const ArmTransitOptions options_;
  robot::State state_;
  MovesWithHand moves_with_hand_;
  motion::Transit transit_;
  motion::Trajectory trajectory_;
  motion::JointReference joints_;
  IndexedVector<ObjectId, math::Pose> seen_;  ///< The objects' poses when the path was last found free.
  bool active_ = false, braking_ = false;
  double time_ = 0, rate_ = 1, next_look_ = 0;
};

}  // namespace tether::execution
