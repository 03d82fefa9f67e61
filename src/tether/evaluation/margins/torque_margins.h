#pragma once

#include <memory>
#include <string>
#include <vector>

#include "tether/evaluation/margins/margins.h"
#include "tether/robot/interface.h"

namespace tether::evaluation {

/// Two that touch, and the sum of the normal forces between them.
struct PairForce {
  std::string a, b;
  double force = 0;  ///< N
};

/// What torques, torque rates and unintended forces had left over a run, from commands and from the
/// simulation's true contacts. A force is that of a pair of bodies, averaged over 10 ms.
class TorqueMargins {
 public:
  /// `max_force`: what nothing that a step does not intend may be pressed with, N; `period`: of the ticks, s.
  TorqueMargins(std::shared_ptr<const robot::Model> model, double max_force, double period);

  /// One tick: the torques that are commanded, and the contacts that no step intends.
  void Observe(double time, const Eigen::VectorXd& torque, const std::vector<PairForce>& unintended);
  /// "joint torque limits" (Nm), "joint torque rate limits" (Nm/s), "unintended force" (N).
  const std::vector<Margin>& margins() const { return margins_; }
  /// The largest mean force, N, and for how long in all more than 50 N, s.
  double most_force() const { return most_force_; }
  double pressed_s() const { return pressed_s_; }

 private:
  struct Window {
    std::string a, b;
    std::vector<double> forces;  ///< Of the last 10 ms, as a ring.
    size_t next = 0;
    double sum = 0;
  };
  void Take(size_t margin, double value, double time, const std::string& what);

  std::shared_ptr<const robot::Model> model_;
  double max_force_, period_;
  size_t window_ticks_;
  std::vector<Window> windows_;
  std::vector<Margin> margins_;
  Eigen::VectorXd last_;
  double most_force_ = 0, pressed_s_ = 0;
};

}  // namespace tether::evaluation
