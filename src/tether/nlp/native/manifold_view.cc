#include "tether/nlp/native/manifold_view.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>

#include "tether/nlp/native/block_kernels.h"

namespace tether::nlp {
namespace {

using Edges = std::vector<std::pair<int, int>>;

void AddEdges(const std::vector<int>& nodes, Edges& edges) {
  for (size_t p = 0; p < nodes.size(); ++p) {
    for (size_t q = 0; q < p; ++q) edges.emplace_back(nodes[p], nodes[q]);
  }
}

std::vector<int> SlotsOf(const std::vector<int>& nodes, const BlockCholesky& factor) {
  std::vector<int> slots;
  for (size_t p = 0; p < nodes.size(); ++p) {
    for (size_t q = 0; q <= p; ++q) slots.push_back(factor.Slot(nodes[p], nodes[q]));
  }
  return slots;
}

}  // namespace

ManifoldView::ManifoldView(const Program& program) : program_(program), num_nodes_(program.num_poses()) {
  for (int i = 0; i < program.num_vectors(); ++i) {
    first_node_.push_back(num_nodes_);
    num_nodes_ += (program.TangentSize({BlockRef::Kind::kVector, i}) + 5) / 6;
  }
  positions_.resize(num_nodes_);
  for (size_t k = 0; k < positions_.size(); ++k) positions_[k] = static_cast<int>(k);
  Edges edges;
  for (const Term& term : program.terms()) AddEdges(NodesOf(*term.residual), edges);
  positions_ = EliminationPositions(num_nodes_, edges);
  for (auto& [i, j] : edges) {
    i = positions_[i];
    j = positions_[j];
  }
  factor_ = BlockCholesky(num_nodes_, edges);
  PlanTerms();
  PlanBounds();
  for (const Group& group : cost_groups_)
    curvature_slots_.insert(curvature_slots_.end(), group.slots.begin(), group.slots.end());
  std::sort(curvature_slots_.begin(), curvature_slots_.end());
  curvature_slots_.erase(std::unique(curvature_slots_.begin(), curvature_slots_.end()),
                         curvature_slots_.end());
}

std::vector<int> ManifoldView::NodesOf(const Residual& residual) const {
  std::vector<int> nodes;
  for (const BlockRef& block : residual.blocks()) {
    const bool is_pose = block.kind == BlockRef::Kind::kPose;
    const int first = is_pose ? block.index : first_node_[block.index];
    const int count = (program_.TangentSize(block) + 5) / 6;
    for (int k = 0; k < count; ++k) nodes.push_back(positions_[first + k]);
  }
  return nodes;
}

void ManifoldView::PlanTerms() {
  std::map<std::vector<int>, int> group_of, cost_group_of;
  int most_rows = 1, most_columns = 1;
  for (const Term& term : program_.terms()) {
    const Residual& residual = *term.residual;
    const std::vector<int> nodes = NodesOf(residual);
    std::vector<int> sorted = nodes;
    std::sort(sorted.begin(), sorted.end());
    const bool is_cost = term.role == Role::kCost;
    std::vector<Group>& groups = is_cost ? cost_groups_ : groups_;
    const auto [it, is_new] =
        (is_cost ? cost_group_of : group_of).try_emplace(sorted, static_cast<int>(groups.size()));
    if (is_new) {
      Group group;
      group.slots = SlotsOf(sorted, factor_);
      group.nodes = sorted;
      groups.push_back(std::move(group));
    }
    Group& group = groups[it->second];
    TermPlan plan{&residual, term.role, it->second, 0, group.rows, {}};
    if (is_cost) {
      plan.first_row_in_group = 0;
      group.rows = std::max(group.rows, residual.size());
    } else {
      group.rows += residual.size();
    }
    int node = 0;
    for (const BlockRef& block : residual.blocks()) {
      const int size = program_.TangentSize(block);
      for (int k = 0; k < size; ++k) {
        const auto place = std::lower_bound(sorted.begin(), sorted.end(), nodes[node + k / 6]);
        const bool fixed = block.kind == BlockRef::Kind::kVector &&
                           program_.lower(block.index)[k] == program_.upper(block.index)[k];
        plan.columns.push_back(fixed ? -1 : 6 * static_cast<int>(place - sorted.begin()) + k % 6);
      }
      node += (size + 5) / 6;
    }
    most_rows = std::max(most_rows, residual.size());
    most_columns = std::max(most_columns, static_cast<int>(plan.columns.size()));
    terms_.push_back(std::move(plan));
  }
  int next_row = 0;
  for (Group& group : groups_) {
    group.first_row = next_row;
    group.first_value = num_values_;
    next_row += group.rows;
    num_values_ += static_cast<size_t>(group.rows * group.columns());
  }
  is_equality_.assign(next_row, 0);
  units_.assign(next_row, Unit::kNone);
  int widest = 6;
  for (TermPlan& plan : terms_) {
    if (plan.role == Role::kCost) {
      widest = std::max(widest, cost_groups_[plan.group].columns());
      continue;
    }
    const Group& group = groups_[plan.group];
    widest = std::max(widest, group.columns());
    plan.first_row = group.first_row + plan.first_row_in_group;
    for (int k = 0; k < plan.residual->size(); ++k) {
      is_equality_[plan.first_row + k] = plan.role == Role::kEquality ? 1 : 0;
      units_[plan.first_row + k] = plan.residual->unit();
    }
  }
  residual_scratch_.resize(most_rows);
  jacobian_scratch_.resize(most_rows, most_columns);
  row_scratch_.resize(most_rows * widest);
  cost_rows_.reserve(most_rows);
  twos_.assign(most_rows, 2.0);
}

void ManifoldView::PlanBounds() {
  for (int i = 0; i < program_.num_vectors(); ++i) {
    const Eigen::VectorXd &lower = program_.lower(i), &upper = program_.upper(i);
    for (int k = 0; k < lower.size(); ++k) {
      if (lower[k] == upper[k]) continue;
      for (const double sign : {-1.0, 1.0}) {
        if (!std::isfinite(sign < 0 ? lower[k] : upper[k])) continue;
        const int node = positions_[first_node_[i] + k / 6];
        Group group;
        group.nodes = {node};
        group.slots = {factor_.Slot(node, node)};
        group.first_row = num_rows();
        group.rows = 1;
        group.first_value = num_values_;
        num_values_ += 6;
        bounds_.push_back({i, k, sign, num_rows()});
        groups_.push_back(std::move(group));
        is_equality_.push_back(0);
        units_.push_back(Unit::kNone);
      }
    }
  }
}

Point ManifoldView::Start(const Point& guess) const {
  Point x = guess;
  for (math::Pose& X : x.poses) X.R = math::ProjectToSO3(X.R);
  for (int i = 0; i < program_.num_vectors(); ++i) {
    Eigen::VectorXd& v = x.vectors[i];
    v = v.cwiseMax(program_.lower(i)).cwiseMin(program_.upper(i)).eval();
  }
  return x;
}

ManifoldView::Values ManifoldView::MakeValues() const {
  Values values;
  values.gradient.setZero(num_coordinates());
  values.rows.setZero(num_rows());
  values.jacobian.assign(num_values_, 0.0);
  values.curvature.assign(factor_.num_slots(), BlockCholesky::Block::Zero());
  // The bounds' derivatives never change.
  size_t value = num_values_ - 6 * bounds_.size();
  for (const Bound& bound : bounds_) {
    values.jacobian[value + static_cast<size_t>(bound.entry % 6)] = bound.sign;
    value += 6;
  }
  return values;
}

TETHER_MULTIVERSION void ManifoldView::AddGram(const Group& group, const std::vector<const double*>& rows,
                                               const double* weights, BlockCholesky::Blocks& target) {
  const int* slot = group.slots.data();
  for (size_t p = 0; p < group.nodes.size(); ++p) {
    for (size_t q = 0; q <= p; ++q, ++slot)
      block::AddWeightedProducts(rows.data(), weights, rows.size(), 6 * p, 6 * q,
                                 target[static_cast<size_t>(*slot)].data());
  }
}

bool ManifoldView::Evaluate(const Point& x, Values& values) {
  ++evaluations_;
  values.revision = evaluations_;
  not_finite_.clear();
  values.cost = 0;
  values.gradient.setZero();
  for (int slot : curvature_slots_) values.curvature[slot].setZero();
  for (const TermPlan& term : terms_) {
    const int size = term.residual->size();
    const auto columns = static_cast<int>(term.columns.size());
    auto r = residual_scratch_.head(size);
    auto J = jacobian_scratch_.topLeftCorner(size, columns);
    JacobianRef ref(J);
    term.residual->Evaluate(x, r, &ref);
    if (!r.allFinite() || !J.allFinite()) {
      not_finite_ = term.residual->name();
      return false;
    }
    const bool is_cost = term.role == Role::kCost;
    const Group& group = (is_cost ? cost_groups_ : groups_)[term.group];
    const int n = group.columns();
    double* out = is_cost ? row_scratch_.data()
                          : values.jacobian.data() + group.first_value +
                                static_cast<size_t>(term.first_row_in_group * n);
    if (is_cost) std::fill(row_scratch_.begin(), row_scratch_.end(), 0.0);
    for (int k = 0; k < columns; ++k) {
      const int column = term.columns[k];
      if (column < 0) continue;
      for (int row = 0; row < size; ++row) out[row * n + column] = J(row, k);
    }
    if (!is_cost) {
      values.rows.segment(term.first_row, size) = r;
      continue;
    }
    values.cost += r.squaredNorm();
    cost_rows_.clear();
    for (int row = 0; row < size; ++row) {
      const double* g = out + row * n;
      cost_rows_.push_back(g);
      for (size_t p = 0; p < group.nodes.size(); ++p) {
        values.gradient.segment<6>(6 * group.nodes[p]) +=
            2 * r[row] * Eigen::Map<const math::Vector6d>(g + 6 * p);
      }
    }
    AddGram(group, cost_rows_, twos_.data(), values.curvature);
  }
  for (const Bound& bound : bounds_) {
    const double v = x.vectors[bound.vector][bound.entry];
    values.rows[bound.row] = bound.sign > 0 ? v - program_.upper(bound.vector)[bound.entry]
                                            : program_.lower(bound.vector)[bound.entry] - v;
  }
  return true;
}

void ManifoldView::Move(const Point& x, const Eigen::VectorXd& d, double scale, Point& moved) const {
  for (size_t i = 0; i < x.poses.size(); ++i)
    moved.poses[i] = x.poses[i] * math::ExpSE3(scale * d.segment<6>(6 * positions_[i]));
  for (size_t i = 0; i < x.vectors.size(); ++i) {
    for (int k = 0; k < x.vectors[i].size(); ++k) {
      const int node = positions_[first_node_[i] + k / 6];
      moved.vectors[i][k] = x.vectors[i][k] + scale * d[6 * node + k % 6];
    }
  }
}

void ManifoldView::WriteMultipliers(const Eigen::VectorXd& y, WarmStart& warm) const {
  warm.terms.resize(terms_.size());
  for (size_t k = 0; k < terms_.size(); ++k) {
    if (terms_[k].role != Role::kCost)
      warm.terms[k] = y.segment(terms_[k].first_row, terms_[k].residual->size());
  }
  for (int i = 0; i < program_.num_vectors(); ++i)
    warm.bounds.emplace_back(Eigen::VectorXd::Zero(program_.lower(i).size()));
  for (const Bound& bound : bounds_) warm.bounds[bound.vector][bound.entry] += bound.sign * y[bound.row];
}

Eigen::VectorXd ManifoldView::ReadMultipliers(const WarmStart& warm) const {
  Eigen::VectorXd y = Eigen::VectorXd::Zero(num_rows());
  for (size_t k = 0; k < std::min(terms_.size(), warm.terms.size()); ++k) {
    if (terms_[k].role == Role::kCost || warm.terms[k].size() != terms_[k].residual->size()) continue;
    y.segment(terms_[k].first_row, warm.terms[k].size()) = warm.terms[k];
  }
  for (const Bound& bound : bounds_) {
    const auto vector = static_cast<size_t>(bound.vector);
    if (vector < warm.bounds.size() && bound.entry < warm.bounds[vector].size())
      y[bound.row] = std::max(0.0, bound.sign * warm.bounds[vector][bound.entry]);
  }
  for (double& value : y) value = std::isfinite(value) ? value : 0;
  return y;
}

std::vector<int> ManifoldView::TermsByWeight(const Eigen::VectorXd& weights, double least) const {
  std::vector<std::pair<double, int>> found;
  for (size_t k = 0; k < terms_.size(); ++k) {
    if (terms_[k].role == Role::kCost) continue;
    const auto rows = weights.segment(terms_[k].first_row, terms_[k].residual->size());
    if (rows.size() > 0 && rows.maxCoeff() > least) found.emplace_back(rows.sum(), static_cast<int>(k));
  }
  std::stable_sort(found.begin(), found.end(),
                   [](const auto& a, const auto& b) { return a.first > b.first; });
  std::vector<int> terms;
  for (const auto& [weight, term] : found) terms.push_back(term);
  return terms;
}

double ManifoldView::LargestTurn(const Eigen::VectorXd& d) const {
  double largest = 0;
  for (int i = 0; i < program_.num_poses(); ++i)
    largest = std::max(largest, d.segment<3>(6 * positions_[i] + 3).norm());
  return largest;
}

double ManifoldView::Amount(const Eigen::VectorXd& rows, int row) const {
  return is_equality(row) ? std::abs(rows[row]) : std::max(rows[row], 0.0);
}

double ManifoldView::Violation(const Eigen::VectorXd& rows, Unit unit) const {
  double largest = 0;
  for (int row = 0; row < num_rows(); ++row) {
    if (units_[row] == unit) largest = std::max(largest, Amount(rows, row));
  }
  return largest;
}

double ManifoldView::Violation(const Eigen::VectorXd& rows) const {
  double largest = 0;
  for (int row = 0; row < num_rows(); ++row) largest = std::max(largest, Amount(rows, row));
  return largest;
}

double ManifoldView::TotalViolation(const Eigen::VectorXd& rows) const {
  double sum = 0;
  for (int row = 0; row < num_rows(); ++row) sum += Amount(rows, row);
  return sum;
}

}  // namespace tether::nlp
