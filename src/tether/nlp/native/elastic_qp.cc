#include "tether/nlp/native/elastic_qp.h"

#include <algorithm>
#include <cmath>

#include "tether/nlp/backends.h"

namespace tether::nlp {
namespace {

// Rows with less weight than this next to curvatures of about one are far from active.
constexpr double kNegligibleWeight = 1e-9;
// Inequalities within this many changes of the last step are included from the beginning; m, rad.
constexpr double kReachPerChange = 2;
constexpr double kLeastReach = 0.002;
constexpr double kFirstChange = 0.25;
constexpr double kRoughPerPenalty = 1e-6;
// A row has to come out this much above its prediction to be worth a cut, m or rad.
constexpr double kLeastExcess = 1e-9;

constexpr char kWithinRow = 1;
constexpr char kUnknownRow = 2;
// A row of a warm start with a smaller multiplier does not start as active.
constexpr double kLeastMultiplier = 1e-8;

}  // namespace

ElasticQp::ElasticQp(ManifoldView& view) : view_(view), largest_change_(kFirstChange) {
  const int n = view_.num_coordinates(), m = view_.num_rows() + kMostCuts;
  for (Eigen::VectorXd* v : {&d_, &dd_, &Hd_, &slope_, &Hstep_, &interior_d_}) v->setZero(n);
  for (Eigen::VectorXd* v :
       {&c_, &y_, &lo_, &hi_, &z_,  &shifted_, &Jstep_, &weight_, &multiplier_, &interior_y_, &interior_z_,
        &a_, &b_, &u_,  &l_,  &dy_, &da_,      &db_,    &primal_, &target_a_,   &target_b_,   &wanted_}) {
    v->setZero(m);
  }
  const auto rows = static_cast<size_t>(m);
  group_of_.assign(rows, nullptr);
  for (const ManifoldView::Group& group : view.groups()) {
    std::fill_n(group_of_.begin() + group.first_row, group.rows, &group);
    widest_ = std::max(widest_, static_cast<size_t>(group.columns()));
  }
  cut_jacobians_.resize(widest_ * cuts_.size());
  near_.reserve(rows);
  gram_rows_.reserve(rows);
  gram_weights_.reserve(rows);
  is_near_.assign(rows, 0);
  active_.assign(rows, kUnknownRow);
  factored_.assign(rows, 0);
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

double ElasticQp::Along(size_t cut, const Eigen::VectorXd& d) const {
  const double* row = cut_jacobians_.data() + cut * widest_;
  double sum = 0;
  for (const int node : cuts_[cut].group->nodes) {
    sum += Eigen::Map<const math::Vector6d>(row).dot(d.segment<6>(6 * node));
    row += 6;
  }
  return sum;
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
      active_[static_cast<size_t>(view_.num_rows()) + next_cut_] = kUnknownRow;
      factored_revision_ = -1;
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
    const BlockCholesky::Block& block = values.curvature[slot];
    const int row = factor.row(slot), column = factor.column(slot);
    if (row == column) {
      Hd.segment<6>(6 * row).noalias() += block.selfadjointView<Eigen::Lower>() * d.segment<6>(6 * row);
    } else {
      Hd.segment<6>(6 * row).noalias() += block.lazyProduct(d.segment<6>(6 * column));
      Hd.segment<6>(6 * column).noalias() += block.transpose().lazyProduct(d.segment<6>(6 * row));
    }
  }
}

const double* ElasticQp::RowOf(const ManifoldView::Values& values, int row) const {
  if (row >= view_.num_rows())
    return cut_jacobians_.data() + static_cast<size_t>(row - view_.num_rows()) * widest_;
  const ManifoldView::Group& group = *group_of_[row];
  return values.jacobian.data() + group.first_value +
         static_cast<size_t>((row - group.first_row) * group.columns());
}

double ElasticQp::DotRow(const ManifoldView::Values& values, int row, const Eigen::VectorXd& d) const {
  const double* g = RowOf(values, row);
  double sum = 0;
  for (const int node : group_of_[row]->nodes) {
    sum += Eigen::Map<const math::Vector6d>(g).dot(d.segment<6>(6 * node));
    g += 6;
  }
  return sum;
}

void ElasticQp::AddRow(const ManifoldView::Values& values, int row, double factor,
                       Eigen::VectorXd& out) const {
  const double* g = RowOf(values, row);
  for (const int node : group_of_[row]->nodes) {
    out.segment<6>(6 * node) += factor * Eigen::Map<const math::Vector6d>(g);
    g += 6;
  }
}

void ElasticQp::SetRows(const Eigen::VectorXd& c, double nu) {
  const int m = view_.num_rows();
  c_.head(m) = c;
  hi_.setConstant(nu);
  for (int i = 0; i < m; ++i) lo_[i] = view_.is_equality(i) ? -nu : 0;
  for (size_t k = 0; k < cuts_.size(); ++k) {
    const int row = m + static_cast<int>(k);
    group_of_[row] = cuts_[k].group;
    c_[row] = cuts_[k].value;
    lo_[row] = 0;
    if (cuts_[k].group == nullptr) y_[row] = 0;
  }
}

void ElasticQp::ChooseNearRows() {
  near_.clear();
  const double reach = std::clamp(kReachPerChange * largest_change_, kLeastReach, kFirstChange);
  for (int i = 0; i < static_cast<int>(c_.size()); ++i) {
    const auto k = static_cast<size_t>(i);
    y_[i] = std::clamp(y_[i], lo_[i], hi_[i]);
    is_near_[k] = group_of_[k] != nullptr && (lo_[i] < 0 || c_[i] > -reach || y_[i] > 0) ? 1 : 0;
    if (is_near_[k] != 0) near_.push_back(i);
  }
}

bool ElasticQp::AddViolatedRows(const ManifoldView::Values& values) {
  const size_t before = near_.size();
  for (int i = 0; i < static_cast<int>(c_.size()); ++i) {
    const auto k = static_cast<size_t>(i);
    if (is_near_[k] != 0 || group_of_[k] == nullptr || c_[i] + DotRow(values, i, d_) <= 0) continue;
    is_near_[k] = 1;
    near_.push_back(i);
  }
  if (near_.size() == before) return false;
  std::sort(near_.begin(), near_.end());
  return true;
}

void ElasticQp::Factorize(const ManifoldView::Values& values, double lambda) {
  ++factorizations_;
  factored_revision_ = -1;
  Assemble(values, lambda);
  view_.factor().Factorize();
}

void ElasticQp::Assemble(const ManifoldView::Values& values, double lambda) {
  const Stopwatch watch(assembly_s_);
  BlockCholesky& factor = view_.factor();
  BlockCholesky::Blocks& blocks = factor.blocks();
  for (BlockCholesky::Block& block : blocks) block.setZero();
  for (const int slot : view_.curvature_slots()) blocks[slot] = values.curvature[slot];
  for (int k = 0; k < factor.count(); ++k) blocks[factor.Slot(k, k)].diagonal().array() += lambda;
  for (size_t k = 0; k < near_.size();) {
    const ManifoldView::Group* group = group_of_[near_[k]];
    gram_rows_.clear();
    gram_weights_.clear();
    for (; k < near_.size() && group_of_[near_[k]] == group; ++k) {
      const double weight = weight_[static_cast<int>(k)];
      if (weight < kNegligibleWeight) continue;
      gram_rows_.push_back(RowOf(values, near_[k]));
      gram_weights_.push_back(weight);
    }
    if (!gram_rows_.empty()) ManifoldView::AddGram(*group, gram_rows_, gram_weights_.data(), blocks);
  }
}

void ElasticQp::StartFrom(const Eigen::VectorXd& y) {
  y_.head(view_.num_rows()) = y;
  for (int i = 0; i < view_.num_rows(); ++i)
    active_[i] = view_.is_equality(i) || y[i] > kLeastMultiplier ? kWithinRow : 0;
  guess_known_ = true;
}

bool ElasticQp::Solve(const ManifoldView::Values& values, const Eigen::VectorXd& c, double nu, double lambda,
                      double tolerance) {
  SetRows(c, nu);
  ChooseNearRows();
  // The interior point only has to identify the active rows; if it can't, it continues to the end.
  const double rough = std::max(tolerance, kRoughPerPenalty * nu);
  bool converged = true;
  do {
    converged = guess_known_ && SolveByActiveSet(values, lambda, tolerance);
    if (!converged) {
      const bool tries = with_rough_rows_.TriesNow();
      if (tries) {
        SolveByInteriorPoint(values, lambda, rough, false);
        converged = SolveByActiveSet(values, lambda, tolerance);
        with_rough_rows_.Note(converged);
      }
      converged = converged || SolveByInteriorPoint(values, lambda, tolerance, tries) ||
                  SolveByInteriorPoint(values, lambda, tolerance, false, true);
    }
    guess_known_ = true;
  } while (!stop_() && AddViolatedRows(values));
  largest_change_ = 0;
  for (const int i : near_) largest_change_ = std::max(largest_change_, std::abs(DotRow(values, i, d_)));
  return converged;
}

}  // namespace tether::nlp
