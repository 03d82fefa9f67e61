#include <algorithm>
#include <cmath>

#include "tether/nlp/native/elastic_qp.h"

namespace tether::nlp {
namespace {

constexpr int kMaxIterations = 40;
constexpr double kRowRegularisation = 1e-11;
// The complementarity products to begin with, per square root of the penalty; found by counting
// factorisations.
constexpr double kFirstProduct = 0.1;
constexpr double kLeastMargin = 1e-9;  // of an interval
// The share of the complementarity products at which a careful step aims.
constexpr double kCarefulShare = 0.2;

/// A row's multiplier and slacks on the central path.
struct CentralPoint {
  double multiplier, a, b;
};

/// For a row of value c and weight interval [lower, upper]: a − b = c, and both products are μ. With
/// s = y − lower: c s² + 2 h s = μ w.
CentralPoint FindCentralPoint(double c, double lower, double upper) {
  const double w = upper - lower, mu = kFirstProduct * std::sqrt(upper);
  const double h = mu - 0.5 * c * w, root = std::sqrt(h * h + c * mu * w);
  const double s = h >= 0 ? mu * w / (h + root) : (root - h) / c;
  const double inside = std::clamp(s, kLeastMargin * w, (1 - kLeastMargin) * w);
  return {lower + inside, mu / (w - inside), mu / inside};
}

}  // namespace

void ElasticQp::Direction(const ManifoldView::Values& values) {
  // Row by row: dy = w (J dd − e), e = −r + τ_a/u − a − τ_b/l + b.
  dd_ = -slope_;
  const auto m = static_cast<int>(near_.size());
  for (int k = 0; k < m; ++k) {
    wanted_[k] = -primal_[k] - a_[k] + b_[k] + target_a_[k] / u_[k] - target_b_[k] / l_[k];
    AddRow(values, near_[k], weight_[k] * wanted_[k], dd_);
  }
  view_.factor().Solve(dd_);
  for (int k = 0; k < m; ++k) {
    Jstep_[k] = DotRow(values, near_[k], dd_);
    dy_[k] = weight_[k] * (Jstep_[k] - wanted_[k]);
    da_[k] = (target_a_[k] + a_[k] * dy_[k]) / u_[k] - a_[k];
    db_[k] = (target_b_[k] - b_[k] * dy_[k]) / l_[k] - b_[k];
  }
}

double ElasticQp::LongestStep() const {
  // The largest rate at which a positive quantity goes to zero; without branches.
  double rate = 1;
  for (int k = 0; k < static_cast<int>(near_.size()); ++k) {
    rate = std::max({rate, -da_[k] / a_[k], -db_[k] / b_[k], dy_[k] / u_[k], -dy_[k] / l_[k]});
  }
  return 1 / rate;
}

double ElasticQp::SumOfProducts(double step) const {
  double sum = 0;
  for (int k = 0; k < static_cast<int>(near_.size()); ++k) {
    sum +=
        (a_[k] + step * da_[k]) * (u_[k] - step * dy_[k]) + (b_[k] + step * db_[k]) * (l_[k] + step * dy_[k]);
  }
  return sum;
}

bool ElasticQp::SolveByInteriorPoint(const ManifoldView::Values& values, double lambda, double tolerance,
                                     bool resume, bool careful) {
  const auto m = static_cast<int>(near_.size());
  if (resume) {
    d_ = interior_d_;
    multiplier_ = interior_y_;
    z_ = interior_z_;
  } else {
    d_.setZero();
  }
  MultiplyCurvature(values, d_, Hd_);
  for (int k = 0; k < m && !resume; ++k) {
    const int i = near_[k];
    const CentralPoint start = FindCentralPoint(c_[i], lo_[i], hi_[i]);
    multiplier_[k] = start.multiplier;
    z_[k] = c_[i];
    a_[k] = start.a;
    b_[k] = start.b;
  }
  bool converged = false;
  for (int iteration = 0; iteration < kMaxIterations && !converged; ++iteration) {
    slope_ = values.gradient + Hd_ + lambda * d_;
    double gap = 0, primal_error = 0;
    for (int k = 0; k < m; ++k) {
      const int i = near_[k];
      u_[k] = hi_[i] - multiplier_[k];
      l_[k] = multiplier_[k] - lo_[i];
      primal_[k] = z_[k] - a_[k] + b_[k];
      gap += a_[k] * u_[k] + b_[k] * l_[k];
      primal_error = std::max(primal_error, std::abs(primal_[k]));
      AddRow(values, i, multiplier_[k], slope_);
    }
    gap /= std::max(1, 2 * m);
    const double dual_error = slope_.size() == 0 ? 0 : slope_.cwiseAbs().maxCoeff();
    converged = gap <= tolerance && primal_error <= tolerance && dual_error <= 10 * tolerance;
    if (converged || stop_()) break;
    ++interior_factorizations_;
    for (int k = 0; k < m; ++k) {
      weight_[k] = 1 / (a_[k] / u_[k] + b_[k] / l_[k] + kRowRegularisation);
      target_a_[k] = target_b_[k] = 0;
    }
    Factorize(values, lambda);
    Direction(values);
    double step = 1;
    if (m > 0) {
      step = LongestStep();
      const double ratio = std::clamp(SumOfProducts(step) / (2 * m * gap), 0.0, 1.0);
      const double mu = std::max((careful ? kCarefulShare : ratio * ratio * ratio) * gap, 0.1 * tolerance);
      // The corrector is that of a whole step: where only a short step is possible, it may cycle.
      for (int k = 0; k < m; ++k) {
        target_a_[k] = mu + (careful ? 0 : da_[k] * dy_[k]);
        target_b_[k] = mu - (careful ? 0 : db_[k] * dy_[k]);
      }
      Direction(values);
      step = std::min(1.0, 0.995 * LongestStep());
    }
    d_ += step * dd_;
    MultiplyCurvature(values, d_, Hd_);
    for (int k = 0; k < m; ++k) {
      z_[k] += step * Jstep_[k];
      multiplier_[k] += step * dy_[k];
      a_[k] += step * da_[k];
      b_[k] += step * db_[k];
    }
  }
  for (int k = 0; k < m; ++k) {
    const int i = near_[k];
    // A multiplier is inside its interval if it is nearer to that than to an end, by the products.
    active_[i] = a_[k] > hi_[i] - multiplier_[k] ? 3 : b_[k] > multiplier_[k] - lo_[i] ? 0 : 1;
    y_[i] = multiplier_[k];
  }
  interior_d_ = d_;
  interior_y_ = multiplier_;
  interior_z_ = z_;
  return converged;
}

}  // namespace tether::nlp
