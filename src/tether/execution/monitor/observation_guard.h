#pragma once

#include <memory>
#include <string>

#include <Eigen/Cholesky>
#include <Eigen/Core>

#include "tether/execution/monitor/own_clock.h"
#include "tether/robot/interface.h"
#include "tether/robot/model.h"

namespace tether::execution {

/// Tells measurements of an arm that can be believed from those that can't (none has come, not finite, a
/// clock that jumped, a joint that would have moved faster than joints do) and says instead where the arm is
/// by what it was told: its torques and the equations of motion, or its velocities. A joint whose position
/// has jumped is followed by its measured velocity. Allocates nothing after the first tick.
class ObservationGuard {
 public:
  enum class Trouble { kFine, kSilence, kNotFinite, kClock, kJump };

  /// `gravity_B`: see robot::State. `period`: between ticks, s.
  ObservationGuard(std::shared_ptr<const robot::Model> model, const Eigen::Vector3d& gravity_B,
                   double period);

  /// One tick: what the arm's sensors say, what it was told in the tick before, and the torques that hold
  /// what it carries, n, Nm, or null.
  void Take(const robot::Observation& seen, const robot::Command& told, const Eigen::VectorXd* carried);

  /// What is to be believed, with a time that does not jump. Until a first measurement could be believed,
  /// what was measured.
  const robot::Observation& believed() const { return believed_; }
  /// Where the arm is has not been measured in this tick.
  bool blind() const { return blind_ > 0; }
  /// What is wrong with the measurement of this tick.
  Trouble trouble() const { return trouble_; }
  /// The last trouble for people: "joint4 of 'panda' seems to have jumped by 0.300 rad".
  std::string Describe(const std::string& robot) const;

 private:
  void Predict(const robot::Command& told, const Eigen::VectorXd* carried);
  Trouble Believe(const robot::Observation& seen);

  std::shared_ptr<const robot::Model> model_;
  double period_;
  robot::State state_;
  OwnClock clock_;
  robot::Observation believed_;
  Eigen::VectorXd a_;
  Eigen::LLT<Eigen::MatrixXd> M_llt_;
  Trouble trouble_ = Trouble::kFine;
  Trouble last_ = Trouble::kFine;
  bool started_ = false;
  double blind_ = 0;   ///< Since when nothing was measured, s.
  double jumped_ = 0;  ///< Since when a joint is not where it seems to be, s.
  int joint_ = -1;     ///< That joint …
  double off_ = 0;     ///< … and by how much, rad.
};

}  // namespace tether::execution
