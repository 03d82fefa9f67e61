#include <algorithm>
#include <cmath>
#include <limits>

#include "tether/nlp/native/elastic_qp.h"

namespace tether::nlp {
namespace {

// The weight σ of a row of size one, per unit of its penalty.
constexpr double kSigmaPerPenalty = 1e4;
constexpr int kMostNewtonSteps = 8;
constexpr int kMostRounds = 6;

// A row's state in the last solve.
constexpr char kAtLower = 0;
constexpr char kWithin = 1;
constexpr char kUnknown = 2;
constexpr char kAtUpper = 3;

}  // namespace

void ElasticQp::FactorizeActive(const ManifoldView::Values& values, double lambda) {
  if (factored_revision_ == values.revision && factored_sigma_ == sigma_ && factored_lambda_ == lambda) {
    bool same = true;
    for (size_t i = 0; i < active_.size() && same; ++i)
      same = (is_near_[i] != 0 && active_[i] == kWithin) == (factored_[i] != 0);
    if (same) return;
  }
  std::fill(factored_.begin(), factored_.end(), 0);
  for (size_t k = 0; k < near_.size(); ++k) {
    const auto i = static_cast<size_t>(near_[k]);
    factored_[i] = active_[i] == kWithin ? 1 : 0;
    weight_[static_cast<int>(k)] = factored_[i] != 0 ? sigma_ : 0;
  }
  Factorize(values, lambda);
  factored_revision_ = values.revision;
  factored_sigma_ = sigma_;
  factored_lambda_ = lambda;
}

void ElasticQp::Slope(const ManifoldView::Values& values, double lambda, bool guessed) {
  slope_ = values.gradient + Hd_ + lambda * d_;
  for (int k = 0; k < static_cast<int>(near_.size()); ++k) {
    const int i = near_[k];
    char& active = active_[i];
    shifted_[k] = multiplier_[k] + sigma_ * z_[k];
    double y = shifted_[k];
    if (!guessed) {
      y = std::clamp(y, lo_[i], hi_[i]);
      active = y <= lo_[i] ? kAtLower : y >= hi_[i] ? kAtUpper : kWithin;
    } else if (active != kWithin) {
      y = active == kAtUpper ? hi_[i] : lo_[i];
    }
    if (y != 0) AddRow(values, i, y, slope_);
  }
}

bool ElasticQp::SolveByActiveSet(const ManifoldView::Values& values, double lambda, double tolerance) {
  if (near_.empty()) return false;
  const auto m = static_cast<int>(near_.size());
  sigma_ = kSigmaPerPenalty * hi_[near_.front()];
  d_.setZero();
  Hd_.setZero();
  for (int k = 0; k < m; ++k) {
    const int i = near_[k];
    z_[k] = c_[i];
    multiplier_[k] = y_[i];
    char& active = active_[i];
    if (active == kUnknown) active = lo_[i] < 0 || c_[i] > 0 ? kWithin : kAtLower;
  }
  bool guessed = true;
  int steps = 0;
  double last_slope = std::numeric_limits<double>::infinity();
  for (int round = 0; round < kMostRounds; ++round) {
    for (;;) {
      Slope(values, lambda, guessed);
      if (!guessed && slope_.cwiseAbs().maxCoeff() <= 10 * tolerance) break;
      // With redundant rows it may cycle.
      const double slope = slope_.cwiseAbs().maxCoeff();
      if (++steps > kMostNewtonSteps || slope > 0.5 * last_slope) return false;
      last_slope = slope;
      if (guessed) last_slope = std::numeric_limits<double>::infinity();
      guessed = false;
      FactorizeActive(values, lambda);
      dd_ = -slope_;
      view_.factor().Solve(dd_);
      MultiplyCurvature(values, dd_, Hstep_);
      d_ += dd_;
      Hd_ += Hstep_;
      for (int k = 0; k < m; ++k) z_[k] += DotRow(values, near_[k], dd_);
    }
    double error = 0;
    for (int k = 0; k < m; ++k) {
      const int i = near_[k];
      const double y = std::clamp(shifted_[k], lo_[i], hi_[i]);
      if (active_[i] == kWithin) error = std::max(error, std::abs(y - multiplier_[k]) / sigma_);
      multiplier_[k] = y;
    }
    if (error > tolerance) {
      last_slope = std::numeric_limits<double>::infinity();
      continue;
    }
    for (int k = 0; k < m; ++k) y_[near_[k]] = multiplier_[k];
    return true;
  }
  return false;
}

}  // namespace tether::nlp
