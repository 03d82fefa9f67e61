#pragma once

#include <memory>

#include <Eigen/Cholesky>
#include <Eigen/Core>

#include "tether/control/torque/joint_braking.h"
#include "tether/qp/solver.h"
#include "tether/robot/model.h"

namespace tether::control {

struct LimiterOptions {
  double period = 0.001;         ///< Between ticks, s.
  double velocity_share = 0.98;  ///< Of the joints' greatest velocities.
  double torque_share = 0.8;     ///< Of the torque that is free, counted on for braking …
  double rate_share = 0.6;       ///< … and of the torque rate.
  double limit_gap = 0.005;      ///< From the position limits, rad.
  double return_speed = 0.1;     ///< At which joints come back from beyond a limit, rad/s.
};

/// What a limiter had to change in the last tick.
struct LimiterFlags {
  bool not_finite = false;   ///< A torque was not finite: it stays as it was.
  bool rate = false;         ///< A torque jumped.
  bool torque = false;       ///< A torque was beyond its limit.
  bool motion = false;       ///< A joint would have been led beyond its position or velocity.
  bool unavoidable = false;  ///< … and no torque within the rate keeps it from that; it is led least beyond.
};

/// The last stage before the robot. Whatever torques come in (not finite, of any size, jumping), those that
/// go out are finite, within the torque and the torque rate counted from the last ones, and nearest to what
/// came in, in the sense of accelerations, among those from which the joints, by a prediction of one step
/// with the model, can still stop before their position limits and stay below their velocity limits
/// (joint_braking.h). Allocates nothing after construction.
class TorqueLimiter {
 public:
  TorqueLimiter(std::shared_ptr<const robot::Model> model, const LimiterOptions& options);

  /// `state` must be set to what was measured; `carried` are the torques that hold a payload, n, Nm, or null.
  /// Counts the rate from the torques that hold the pose at the first call. `external`: torques by which
  /// something pushes the arm, n, Nm, or null.
  const Eigen::VectorXd& Limit(const robot::State& state, const Eigen::VectorXd& torque,
                               const Eigen::VectorXd* carried = nullptr,
                               const Eigen::VectorXd* external = nullptr);
  const LimiterFlags& flags() const { return flags_; }
  void Restart() { started_ = false; }

 private:
  void LimitMotion(const robot::State& state, const Eigen::VectorXd* external);

  std::shared_ptr<const robot::Model> model_;
  LimiterOptions options_;
  BrakingReserve reserve_;
  qp::Problem problem_;
  qp::Solver solver_;
  Eigen::VectorXd last_, out_, hold_, lower_, upper_, a_, a_lower_, a_upper_, most_, pushed_;
  Eigen::MatrixXd Minv_;
  Eigen::LLT<Eigen::MatrixXd> M_llt_;
  LimiterFlags flags_;
  bool started_ = false;
};

}  // namespace tether::control
