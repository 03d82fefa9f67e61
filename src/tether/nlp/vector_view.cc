#include "tether/nlp/vector_view.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

namespace tether::nlp {

math::Pose ChartPose(const math::Pose& origin, const math::Vector6d& v) {
  return {origin.R * math::ExpSO3(v.tail<3>()), origin.p + v.head<3>()};
}

math::Matrix6d ChartJacobian(const math::Pose& origin, const math::Vector6d& v) {
  math::Matrix6d J = math::Matrix6d::Zero();
  J.topLeftCorner<3, 3>() = (origin.R * math::ExpSO3(v.tail<3>())).transpose();
  J.bottomRightCorner<3, 3>() = math::RightJacobianSO3(v.tail<3>());
  return J;
}

VectorView::VectorView(const Program& program, const Point& origin)
    : program_(program),
      origin_(origin),
      num_variables_(program.num_variables()),
      num_equalities_(program.num_rows(Role::kEquality)),
      num_inequalities_(program.num_rows(Role::kInequality)) {
  assert(static_cast<int>(origin.poses.size()) == program.num_poses());
  assert(static_cast<int>(origin.vectors.size()) == program.num_vectors());
  // A guess that went through a file or a long product may have drifted off the group.
  for (math::Pose& X : origin_.poses) X.R = math::ProjectToSO3(X.R);

  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  lower_.setConstant(num_variables_, -kInfinity);
  upper_.setConstant(num_variables_, kInfinity);
  start_.setZero(num_variables_);
  for (int i = 0; i < program.num_vectors(); ++i) {
    const BlockRef block{BlockRef::Kind::kVector, i};
    const int offset = program.Offset(block), size = program.TangentSize(block);
    const Eigen::VectorXd& value = origin_.vectors[i];
    assert(value.size() == size);
    lower_.segment(offset, size) = program.lower(i);
    upper_.segment(offset, size) = program.upper(i);
    start_.segment(offset, size) = value.cwiseMax(program.lower(i)).cwiseMin(program.upper(i));
  }

  int next_equality = 0, next_inequality = num_equalities_;
  int max_rows = 0, max_columns = 0;
  for (const Term& term : program.terms()) {
    Row row{term.residual.get(), term.role, 0, static_cast<int>(jacobian_entries_.size()), {}, {}, 0};
    const int size = row.residual->size();
    for (const BlockRef& block : row.residual->blocks()) {
      const bool is_pose = block.kind == BlockRef::Kind::kPose;
      row.spans.push_back({program.Offset(block), program.TangentSize(block), is_pose ? block.index : -1});
      row.columns += row.spans.back().size;
    }
    if (term.role != Role::kCost) {
      int& next = term.role == Role::kEquality ? next_equality : next_inequality;
      row.first_row = next;
      next += size;
      for (const Span& span : row.spans) {
        for (int column = 0; column < span.size; ++column) {
          for (int r = 0; r < size; ++r)
            jacobian_entries_.push_back({row.first_row + r, span.offset + column});
        }
      }
    }
    max_rows = std::max(max_rows, size);
    max_columns = std::max(max_columns, row.columns);
    rows_.push_back(std::move(row));
  }
  AddHessianEntries();

  constraints_.setZero(num_constraints());
  gradient_.setZero(num_variables_);
  jacobian_values_.resize(jacobian_entries_.size());
  hessian_values_.resize(hessian_entries_.size());
  chart_jacobians_.resize(origin_.poses.size());
  residual_scratch_.resize(max_rows);
  jacobian_scratch_.resize(max_rows, max_columns);
  chained_scratch_.resize(max_rows, max_columns);
}

void VectorView::AddHessianEntries() {
  std::map<std::pair<int, int>, int> first;
  const auto place = [&](const Span& a, const Span& b) {
    const auto [it, is_new] =
        first.try_emplace({a.offset, b.offset}, static_cast<int>(hessian_entries_.size()));
    if (is_new) {
      for (int column = 0; column < b.size; ++column) {
        for (int row = a.offset == b.offset ? column : 0; row < a.size; ++row) {
          hessian_entries_.push_back({a.offset + row, b.offset + column});
        }
      }
    }
    return it->second;
  };
  for (int i = 0; i < program_.num_poses(); ++i) {
    const Span span{6 * i, 6, i};
    place(span, span);
  }
  for (int i = 0; i < program_.num_vectors(); ++i) {
    const BlockRef block{BlockRef::Kind::kVector, i};
    const Span span{program_.Offset(block), program_.TangentSize(block), -1};
    place(span, span);
  }
  for (Row& row : rows_) {
    if (row.role != Role::kCost) continue;
    const int count = static_cast<int>(row.spans.size());
    for (int i = 0; i < count; ++i) {
      for (int j = 0; j < count; ++j) {
        const Span &a = row.spans[i], &b = row.spans[j];
        if (a.offset >= b.offset) row.products.push_back({i, j, place(a, b)});
      }
    }
  }
}

Point VectorView::PointAt(const Eigen::VectorXd& x) const {
  Point point = origin_;
  int offset = 0;
  for (math::Pose& X : point.poses) {
    X = ChartPose(X, x.segment<6>(offset));
    offset += 6;
  }
  for (Eigen::VectorXd& v : point.vectors) {
    v = x.segment(offset, v.size());
    offset += static_cast<int>(v.size());
  }
  return point;
}

bool VectorView::EvaluateValues(const Eigen::VectorXd& x) {
  if (level_ >= Level::kValues && x == x_) return true;
  return Evaluate(x, false);
}

bool VectorView::EvaluateDerivatives(const Eigen::VectorXd& x) {
  if (level_ >= Level::kDerivatives && x == x_) return true;
  return Evaluate(x, true);
}

bool VectorView::Evaluate(const Eigen::VectorXd& x, bool derivatives) {
  level_ = Level::kNothing;
  ++evaluations_;
  x_ = x;
  const Point point = PointAt(x);
  if (derivatives) {
    for (size_t i = 0; i < chart_jacobians_.size(); ++i) {
      chart_jacobians_[i] = ChartJacobian(origin_.poses[i], x.segment<6>(6 * static_cast<int>(i)));
    }
    gradient_.setZero();
    std::fill(hessian_values_.begin(), hessian_values_.end(), 0.0);
  }
  cost_ = 0;
  for (const Row& row : rows_) {
    const int size = row.residual->size();
    auto r = residual_scratch_.head(size);
    auto raw = jacobian_scratch_.topLeftCorner(size, row.columns);
    auto J = chained_scratch_.topLeftCorner(size, row.columns);
    if (derivatives) {
      JacobianRef ref(raw);
      row.residual->Evaluate(point, r, &ref);
    } else {
      row.residual->Evaluate(point, r, nullptr);
    }
    if (!r.allFinite() || (derivatives && !raw.allFinite())) {
      not_finite_ = row.residual->name();
      return false;
    }
    if (derivatives) {
      int column = 0;
      for (const Span& span : row.spans) {
        if (span.pose >= 0) {
          // The chart's Jacobian is block diagonal.
          const math::Matrix6d& C = chart_jacobians_[span.pose];
          J.middleCols<3>(column).noalias() = raw.middleCols<3>(column).lazyProduct(C.topLeftCorner<3, 3>());
          J.middleCols<3>(column + 3).noalias() =
              raw.middleCols<3>(column + 3).lazyProduct(C.bottomRightCorner<3, 3>());
        } else {
          J.middleCols(column, span.size) = raw.middleCols(column, span.size);
        }
        column += span.size;
      }
    }
    if (row.role == Role::kCost) {
      cost_ += r.squaredNorm();
      if (!derivatives) continue;
      std::vector<int>& columns = columns_scratch_;
      columns.clear();
      int column = 0;
      for (const Span& span : row.spans) {
        gradient_.segment(span.offset, span.size).noalias() +=
            2 * J.middleCols(column, span.size).transpose() * r;
        columns.push_back(column);
        column += span.size;
      }
      for (const BlockProduct& product : row.products) {
        const auto i = static_cast<size_t>(product.row_block), j = static_cast<size_t>(product.column_block);
        double* value = hessian_values_.data() + product.first;
        for (int b = 0; b < row.spans[j].size; ++b) {
          for (int a = i == j ? b : 0; a < row.spans[i].size; ++a) {
            *value++ += 2 * J.col(columns[i] + a).dot(J.col(columns[j] + b));
          }
        }
      }
    } else {
      constraints_.segment(row.first_row, size) = r;
      if (!derivatives) continue;
      double* value = jacobian_values_.data() + row.first_value;
      for (int column = 0; column < row.columns; ++column) {
        for (int k = 0; k < size; ++k) *value++ = J(k, column);
      }
    }
  }
  level_ = derivatives ? Level::kDerivatives : Level::kValues;
  return true;
}

double VectorView::ViolationIn(Unit unit) const {
  double largest = 0;
  for (const Row& row : rows_) {
    if (row.role == Role::kCost || row.residual->unit() != unit) continue;
    for (int k = 0; k < row.residual->size(); ++k) {
      const double value = constraints_[row.first_row + k];
      largest = std::max(largest, row.role == Role::kEquality ? std::abs(value) : value);
    }
  }
  return largest;
}

}  // namespace tether::nlp
