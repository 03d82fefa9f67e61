#include "tether/qp/example_problems.h"

#include <cmath>

namespace tether::qp {
namespace {

constexpr int kTask = 6;
constexpr double kDamping = 1e-3;
constexpr double kGain = 10;

}  // namespace

ControlSequence::ControlSequence(int variables, int rows, uint64_t seed)
    : n_(variables), m_(rows), random_(seed) {
  const int count = kTask + m_ + 2;
  frequency_.resize(count, n_);
  phase_.resize(count, n_);
  for (int i = 0; i < count; ++i) {
    for (int j = 0; j < n_; ++j) {
      frequency_(i, j) = random_.Uniform(0.2, 2);
      phase_(i, j) = random_.Uniform(0, 2 * M_PI);
    }
  }
}

void ControlSequence::Jump() { time_ += random_.Uniform(1e3, 2e3); }

double ControlSequence::Wave(int i, int j) const { return std::sin(frequency_(i, j) * time_ + phase_(i, j)); }

void ControlSequence::Next(double step, Problem& problem) {
  time_ += step;
  problem.Resize(n_, 0, m_);
  Eigen::Matrix<double, kTask, Eigen::Dynamic, 0, kTask, kMaxVariables> J(kTask, n_);
  Eigen::Matrix<double, kTask, 1> error;
  for (int i = 0; i < kTask; ++i) {
    for (int j = 0; j < n_; ++j) J(i, j) = 0.6 * Wave(i, j);
    error[i] = Wave(kTask + m_, i % n_) * Wave(kTask + m_ + 1, (i + 3) % n_);
  }
  problem.H() = J.transpose() * J;
  problem.H().diagonal().array() += kDamping;
  problem.g() = -J.transpose() * error;
  for (int i = 0; i < m_; ++i) {
    double distance = 0.12;
    for (int j = 0; j < n_; ++j) {
      problem.A()(i, j) = 0.5 * Wave(kTask + i, j);
      distance += 0.12 * Wave(kTask + i, (j + 1) % n_) * Wave(kTask + m_, j) / std::sqrt(n_);
    }
    // A controller keeps its state nearly out of the forbidden zones.
    problem.lower()[i] = -kGain * std::max(distance, -0.002);
  }
  problem.x_lower().setConstant(-2);
  problem.x_upper().setConstant(2);
}

}  // namespace tether::qp
