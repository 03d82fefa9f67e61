#pragma once

#include <memory>
#include <string>

#include <Eigen/Core>

#include "tether/motion/line_checker.h"
#include "tether/robot/kinematics.h"

namespace tether::motion {

/// An axis of the hand, or of what it holds, stays within an angle of a direction: a cup stays upright.
struct TiltLimit {
  Eigen::Vector3d axis_H;       ///< Unit, in the hand.
  Eigen::Vector3d direction_B;  ///< Unit, in the base frame.
  double max = 0;               ///< rad
};

/// The configurations that keep a TiltLimit. One per thread.
class TiltManifold {
 public:
  TiltManifold(std::shared_ptr<const robot::Model> model, const TiltLimit& limit);

  /// The angle between axis and direction, rad.
  double Angle(const Eigen::VectorXd& q);
  bool Holds(const Eigen::VectorXd& q) { return Angle(q) <= limit_.max; }
  /// Moves `q` (n, rad) by the least that brings the axis well within the limit, by Gauss-Newton steps on the
  /// rotation that is missing. False if it doesn't get there.
  bool Project(Eigen::VectorXd* q);
  const TiltLimit& limit() const { return limit_; }

 private:
  TiltLimit limit_;
  robot::Kinematics kinematics_;
  Eigen::MatrixXd J_;
};

/// What another checker calls free and keeps a tilt, the latter at samples.
class TiltChecker final : public LineChecker {
 public:
  /// `resolution`: the most that a joint moves between two samples, rad. Both must outlive this.
  TiltChecker(LineChecker& inner, TiltManifold& manifold, double resolution)
      : inner_(inner), manifold_(manifold), resolution_(resolution) {}

  bool IsFree(const Eigen::VectorXd& q) override { return manifold_.Holds(q) && inner_.IsFree(q); }
  bool IsFree(const Eigen::VectorXd& a, const Eigen::VectorXd& b) override;
  int64_t checks() const override { return checks_ + inner_.checks(); }
  int64_t exact_checks() const override { return inner_.exact_checks(); }
  /// "what is held is tilted by 31.0 degrees", or what the other says.
  std::string Why(const Eigen::VectorXd& q) const override;

 private:
  LineChecker& inner_;
  TiltManifold& manifold_;
  double resolution_;
  int64_t checks_ = 0;
};

}  // namespace tether::motion
