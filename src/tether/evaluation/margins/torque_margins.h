#pragma once

#include <memory>
#include <string>
#include <vector>

#include "tether/evaluation/margins/force_record.h"
#include "tether/evaluation/margins/margins.h"
#include "tether/robot/interface.h"

namespace tether::evaluation {

/// What torques, torque rates and unintended forces had left over a run, from commands and from the
/// simulation's true contacts. A force is that of a pair of bodies, averaged over 10 ms (ForceRecord).
class TorqueMargins {
 public:
  /// `max_force`: what nothing that a step does not intend may be pressed with, N; `period`: of the ticks, s.
  /// Without `torques` only forces are measured: commands are velocities.
  TorqueMargins(std::shared_ptr<const robot::Model> model, double max_force, double period,
                bool torques = true);

  /// One tick: the torques that are commanded, and the contacts that no step intends.
  void Observe(double time, const Eigen::VectorXd& torque, const std::vector<PairForce>& unintended);
  /// "joint torque limits" (Nm), "joint torque rate limits" (Nm/s), "unintended force" (N).
  const std::vector<Margin>& margins() const { return margins_; }
  /// Begins a new interval of the log: `last` is the least within it.
  void ForgetLast();
  const ForceSummary& forces() const { return forces_.summary(); }

 private:
  std::shared_ptr<const robot::Model> model_;
  double max_force_, period_;
  bool torques_;
  size_t force_ = 0;  ///< Its margin.
  ForceRecord forces_;
  std::vector<Margin> margins_;
  Eigen::VectorXd last_;
};

}  // namespace tether::evaluation
