#include "tether/nlp/elastic_qp.h"

#include <algorithm>
#include <cmath>

namespace tether::nlp {
namespace {

constexpr int kMaxIterations = 40;
// Rows with less weight than this next to curvatures of about one are far from active.
constexpr double kNegligibleWeight = 1e-9;
constexpr double kRowRegularisation = 1e-11;
// A row has to come out this much above its prediction to be worth a cut, m or rad.
constexpr double kLeastExcess = 1e-9;

}  // namespace

ElasticQp::ElasticQp(ManifoldView& view) : view_(view) {
  const int n = view.num_coordinates(), m = view.num_rows() + kMostCuts;
  for (Eigen::VectorXd* v : {&d_, &dd_, &Hd_, &dual_}) v->setZero(n);
  for (Eigen::VectorXd* v : {&y_, &lo_, &hi_, &a_, &b_, &u_, &l_, &dy_, &da_, &db_, &Jd_, &Jdd_, &primal_,
                             &weight_, &gram_weight_, &target_a_, &target_b_, &rhs_row_, &c_}) {
    v->setZero(m);
  }
  for (const ManifoldView::Group& group : view.groups())
    widest_ = std::max(widest_, static_cast<size_t>(group.columns()));
  gram_.resize(widest_ * widest_);
  column_.resize(widest_);
  cut_jacobians_.resize(widest_ * cuts_.size());
}

void ElasticQp::Multiply(const ManifoldView::Values& values, const Eigen::VectorXd& d,
                         Eigen::VectorXd& Jd) const {
  for (const ManifoldView::Group& group : view_.groups()) {
    const double* row = values.jacobian.data() + group.first_value;
    for (int k = 0; k < group.rows; ++k) {
      double sum = 0;
      for (const int node : group.nodes) {
        sum += Eigen::Map<const math::Vector6d>(row).dot(d.segment<6>(6 * node));
        row += 6;
      }
      Jd[group.first_row + k] = sum;
    }
  }
}

void ElasticQp::AddTransposed(const ManifoldView::Values& values, const Eigen::VectorXd& y,
                              Eigen::VectorXd& out) {
  for (const ManifoldView::Group& group : view_.groups()) {
    const int n = group.columns();
    const double* row = values.jacobian.data() + group.first_value;
    std::fill_n(column_.begin(), static_cast<size_t>(n), 0.0);
    for (int k = 0; k < group.rows; ++k, row += n) {
      const double factor = y[group.first_row + k];
      if (factor == 0) continue;
      for (int i = 0; i < n; i += 6) {
        Eigen::Map<math::Vector6d>(column_.data() + i) += factor * Eigen::Map<const math::Vector6d>(row + i);
      }
    }
    for (size_t p = 0; p < group.nodes.size(); ++p)
      out.segment<6>(6 * group.nodes[p]) += Eigen::Map<const math::Vector6d>(column_.data() + 6 * p);
  }
  for (size_t k = 0; k < cuts_.size(); ++k) {
    if (cuts_[k].group == nullptr) continue;
    const double factor = y[view_.num_rows() + static_cast<int>(k)];
    const double* row = cut_jacobians_.data() + k * widest_;
    for (const int node : cuts_[k].group->nodes) {
      out.segment<6>(6 * node) += factor * Eigen::Map<const math::Vector6d>(row);
      row += 6;
    }
  }
}

double ElasticQp::Along(size_t cut, const Eigen::VectorXd& d) const {
  const double* row = cut_jacobians_.data() + cut * widest_;
  double sum = 0;
  for (const int node : cuts_[cut].group->nodes) {
    sum += Eigen::Map<const math::Vector6d>(row).dot(d.segment<6>(6 * node));
    row += 6;
  }
  return sum;
}

void ElasticQp::MultiplyAll(const ManifoldView::Values& values, const Eigen::VectorXd& d,
                            Eigen::VectorXd& Jd) const {
  Multiply(values, d, Jd);
  for (size_t k = 0; k < cuts_.size(); ++k)
    Jd[view_.num_rows() + static_cast<int>(k)] = cuts_[k].group == nullptr ? 0 : Along(k, d);
}

int ElasticQp::AddCuts(const ManifoldView::Values& there, const Eigen::VectorXd& d,
                       const Eigen::VectorXd& model) {
  const auto excess = [&](int row) {
    if (view_.is_equality(row) || there.rows[row] <= 0) return 0.0;
    return there.rows[row] - std::max(model[row], 0.0);
  };
  double worst = 0;
  for (int row = 0; row < view_.num_rows(); ++row) worst = std::max(worst, excess(row));
  int added = 0;
  for (const ManifoldView::Group& group : view_.groups()) {
    for (int k = 0; k < group.rows && added < kMostCuts / 2; ++k) {
      const int row = group.first_row + k;
      if (excess(row) <= std::max(kLeastExcess, 0.1 * worst)) continue;
      // The change of the tangent frame along d is left out: second order where rows are straight.
      const auto n = static_cast<size_t>(group.columns());
      const double* from = there.jacobian.data() + group.first_value + static_cast<size_t>(k) * n;
      std::copy_n(from, n, cut_jacobians_.data() + next_cut_ * widest_);
      Cut& cut = cuts_[next_cut_];
      cut = {&group, row, 0, 0};
      cut.value = there.rows[row] - Along(next_cut_, d);
      y_[view_.num_rows() + static_cast<int>(next_cut_)] = 0;
      next_cut_ = (next_cut_ + 1) % cuts_.size();
      ++added;
    }
  }
  return added;
}

bool ElasticQp::HasFreshCut(int row) const {
  return std::any_of(cuts_.begin(), cuts_.end(), [row](const Cut& cut) {
    return cut.group != nullptr && cut.row == row && cut.age == 0;
  });
}

void ElasticQp::RaiseToCuts(const Eigen::VectorXd& d, Eigen::VectorXd& rows) const {
  for (size_t k = 0; k < cuts_.size(); ++k) {
    if (cuts_[k].group == nullptr) continue;
    double& row = rows[cuts_[k].row];
    row = std::max(row, cuts_[k].value + Along(k, d));
  }
}

void ElasticQp::MoveCuts(const Eigen::VectorXd& d) {
  for (size_t k = 0; k < cuts_.size(); ++k) {
    if (cuts_[k].group == nullptr) continue;
    cuts_[k].value += Along(k, d);
    if (++cuts_[k].age > 1) cuts_[k].group = nullptr;
  }
}

bool ElasticQp::DropOldCuts() {
  bool any = false;
  for (Cut& cut : cuts_) {
    if (cut.group == nullptr || cut.age == 0) continue;
    cut.group = nullptr;
    any = true;
  }
  return any;
}

void ElasticQp::MultiplyCurvature(const ManifoldView::Values& values, const Eigen::VectorXd& d,
                                  Eigen::VectorXd& Hd) const {
  Hd.setZero();
  const BlockCholesky& factor = view_.factor();
  for (const int slot : view_.curvature_slots()) {
    const BlockCholesky::Block& block = values.curvature[static_cast<size_t>(slot)];
    const int row = factor.row(slot), column = factor.column(slot);
    if (row == column) {
      Hd.segment<6>(6 * row).noalias() += block.selfadjointView<Eigen::Lower>() * d.segment<6>(6 * row);
    } else {
      Hd.segment<6>(6 * row).noalias() += block.lazyProduct(d.segment<6>(6 * column));
      Hd.segment<6>(6 * column).noalias() += block.transpose().lazyProduct(d.segment<6>(6 * row));
    }
  }
}

void ElasticQp::Factorize(const ManifoldView::Values& values, double lambda) {
  BlockCholesky& factor = view_.factor();
  BlockCholesky::Blocks& blocks = factor.blocks();
  for (BlockCholesky::Block& block : blocks) block.setZero();
  for (const int slot : view_.curvature_slots())
    blocks[static_cast<size_t>(slot)] = values.curvature[static_cast<size_t>(slot)];
  for (int k = 0; k < factor.count(); ++k)
    blocks[static_cast<size_t>(factor.Slot(k, k))].diagonal().array() += lambda;
  for (const ManifoldView::Group& group : view_.groups()) {
    ManifoldView::AddGram(group, group.rows, values.jacobian.data() + group.first_value,
                          gram_weight_.data() + group.first_row, gram_, blocks);
  }
  for (size_t k = 0; k < cuts_.size(); ++k) {
    if (cuts_[k].group == nullptr) continue;
    ManifoldView::AddGram(*cuts_[k].group, 1, cut_jacobians_.data() + k * widest_,
                          gram_weight_.data() + view_.num_rows() + k, gram_, blocks);
  }
  factor.Factorize();
}

void ElasticQp::Direction(const ManifoldView::Values& values) {
  // Row by row: dy = w (J dd − e), e = −r + τ_a/u − a − τ_b/l + b.
  rhs_row_ = -primal_ - a_ + b_ + target_a_.cwiseQuotient(u_) - target_b_.cwiseQuotient(l_);
  dd_ = -dual_;
  dy_ = weight_.cwiseProduct(rhs_row_);
  AddTransposed(values, dy_, dd_);
  view_.factor().Solve(dd_);
  MultiplyAll(values, dd_, Jdd_);
  dy_ = weight_.cwiseProduct(Jdd_ - rhs_row_);
  da_ = target_a_.cwiseQuotient(u_) - a_ + a_.cwiseQuotient(u_).cwiseProduct(dy_);
  db_ = target_b_.cwiseQuotient(l_) - b_ - b_.cwiseQuotient(l_).cwiseProduct(dy_);
}

double ElasticQp::LongestStep() const {
  double step = 1;
  for (int i = 0; i < a_.size(); ++i) {
    if (da_[i] < 0) step = std::min(step, -a_[i] / da_[i]);
    if (db_[i] < 0) step = std::min(step, -b_[i] / db_[i]);
    if (dy_[i] > 0) step = std::min(step, u_[i] / dy_[i]);
    if (dy_[i] < 0) step = std::min(step, -l_[i] / dy_[i]);
  }
  return step;
}

bool ElasticQp::Solve(const ManifoldView::Values& values, const Eigen::VectorXd& c, double nu, double lambda,
                      double tolerance) {
  const int m = static_cast<int>(c_.size());
  d_.setZero();
  Jd_.setZero();
  c_.head(view_.num_rows()) = c;
  for (size_t k = 0; k < cuts_.size(); ++k)
    c_[view_.num_rows() + static_cast<int>(k)] = cuts_[k].group == nullptr ? -1 : cuts_[k].value;
  for (int i = 0; i < m; ++i) {
    lo_[i] = i < view_.num_rows() && view_.is_equality(i) ? -nu : 0;
    hi_[i] = nu;
    // Off the ends of its interval, and with slacks that make the products alike.
    const double margin = std::min(0.01, 0.01 * nu);
    y_[i] = std::clamp(y_[i], lo_[i] + margin, hi_[i] - margin);
    const double slack = 1e-3;
    a_[i] = std::max(c_[i], 0.0) + slack;
    b_[i] = std::max(-c_[i], 0.0) + slack;
  }
  for (int iteration = 0; iteration < kMaxIterations; ++iteration) {
    u_ = hi_ - y_;
    l_ = y_ - lo_;
    primal_ = c_ + Jd_ - a_ + b_;
    MultiplyCurvature(values, d_, Hd_);
    dual_ = values.gradient + Hd_ + lambda * d_;
    AddTransposed(values, y_, dual_);
    const double gap = m == 0 ? 0 : (a_.dot(u_) + b_.dot(l_)) / (2 * m);
    const double dual_error = dual_.size() == 0 ? 0 : dual_.cwiseAbs().maxCoeff();
    const double primal_error = m == 0 ? 0 : primal_.cwiseAbs().maxCoeff();
    if (gap <= tolerance && primal_error <= tolerance && dual_error <= 10 * tolerance) return true;
    ++iterations_;
    for (int i = 0; i < m; ++i) {
      weight_[i] = 1 / (a_[i] / u_[i] + b_[i] / l_[i] + kRowRegularisation);
      gram_weight_[i] = weight_[i] < kNegligibleWeight ? 0 : weight_[i];
    }
    Factorize(values, lambda);
    target_a_.setZero();
    target_b_.setZero();
    Direction(values);
    double step = 1;
    if (m > 0) {
      step = LongestStep();
      double affine = 0;
      for (int i = 0; i < m; ++i) {
        affine += (a_[i] + step * da_[i]) * (u_[i] - step * dy_[i]) +
                  (b_[i] + step * db_[i]) * (l_[i] + step * dy_[i]);
      }
      const double ratio = std::clamp(affine / (2 * m * gap), 0.0, 1.0);
      const double mu = std::max(ratio * ratio * ratio * gap, 0.1 * tolerance);
      target_a_ = (mu + da_.array() * dy_.array()).matrix();
      target_b_ = (mu - db_.array() * dy_.array()).matrix();
      Direction(values);
      step = std::min(1.0, 0.995 * LongestStep());
    }
    d_ += step * dd_;
    Jd_ += step * Jdd_;
    y_ += step * dy_;
    a_ += step * da_;
    b_ += step * db_;
  }
  return false;
}

}  // namespace tether::nlp
