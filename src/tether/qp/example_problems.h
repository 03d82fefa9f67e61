#pragma once

#include "tether/common/random.h"
#include "tether/qp/problem.h"

namespace tether::qp {

/// Problems as a velocity controller poses them, tick after tick: n joint velocities follow a six-dimensional
/// task with damping (H = JᵀJ + λI, λ = 0.001), m one-sided distance rows n_iᵀ J_i q̇ ≥ −η d_i, and velocity
/// bounds. All rows drift smoothly and come and go as active ones. For benchmarks and tests.
class ControlSequence {
 public:
  /// The same arguments give the same sequence.
  ControlSequence(int variables, int rows, uint64_t seed);

  /// Writes the next problem, `step` seconds later; `problem` is resized.
  void Next(double step, Problem& problem);
  /// Jumps to an unrelated state: the next problem is unrelated to the last.
  void Jump();

 private:
  double Wave(int i, int j) const;

  int n_, m_;
  Random random_;
  double time_ = 0;
  // Amplitude, frequency and phase of every entry of the task Jacobian, the rows, the distances, the task.
  Eigen::MatrixXd frequency_, phase_;
};

}  // namespace tether::qp
