#include "tether/qp/hierarchy.h"

#include <algorithm>
#include <cassert>
#include <climits>
#include <cmath>

namespace tether::qp {
namespace {

/// Rows of a proof with at least this part of the largest weight get all of the level's violation.
constexpr double kFreezeWeight = 1e-7;
/// A conflict by less than this part of its terms is rounding, of rows that meet at their exact violations.
constexpr double kRounding = 1e-11;

}  // namespace

HierarchySolver::HierarchySolver(int max_variables, int max_equalities, int max_inequalities,
                                 const SolverOptions& options)
    : solver_(max_variables, max_equalities, max_inequalities, options), max_solves_(options.max_solves) {
  const size_t lines = static_cast<size_t>(max_inequalities + 7) / 8;
  memory_.resize(2 * lines);
  lower_ = reinterpret_cast<double*>(memory_.data());
  upper_ = lower_ + 8 * lines;
  all_violations_.resize(max_inequalities);
  state_.resize(max_inequalities);
}

void HierarchySolver::SetSides(int row) {
  const double v = violations_[row];
  const bool aside = state_[row] == Row::kAside;
  lower_[row] = aside ? -kInfinity : problem_->lower()[row] - v;
  upper_[row] = aside ? kInfinity : problem_->upper()[row] + v;
}

Status HierarchySolver::Relaxed(Start start) {
  if (max_solves_ > 0 && solves_ >= max_solves_) return Status::kIterationLimit;
  ++solves_;
  const Status status = solver_.Solve(*problem_, lower_, upper_, start);
  iterations_ += solver_.iterations();
  return status;
}

Status HierarchySolver::Solve(const Problem& problem, std::span<const int> levels, Start start) {
  Begin(problem, levels);
  solves_ = 1;
  status_ = solver_.Solve(problem, start);
  iterations_ = solver_.iterations();
  if (status_ != Status::kInfeasible) return status_;
  return Relax(LastLevel(solver_.conflict()));
}

Status HierarchySolver::SolveConflict(const Problem& problem, std::span<const int> levels, int last_level) {
  Begin(problem, levels);
  return Relax(last_level);
}

void HierarchySolver::Begin(const Problem& problem, std::span<const int> levels) {
  const int m = problem.num_inequalities();
  assert(static_cast<int>(levels.size()) == m && levels.size() <= all_violations_.size());
  problem_ = &problem;
  levels_ = levels;
  violations_ = {all_violations_.data(), levels.size()};
  std::fill(violations_.begin(), violations_.end(), 0.0);
  num_relaxed_ = solves_ = iterations_ = 0;
  for (int i = m; i < problem.padded_rows(); ++i) {
    lower_[i] = -kInfinity;
    upper_[i] = kInfinity;
  }
}

// The levels before the last one of a proof need not be in conflict: all of them are tried at once.
Status HierarchySolver::Relax(int level) {
  for (;;) {
    // If the proof has only rows that must hold, the problem is infeasible.
    if (level == 0) return status_ = Status::kInfeasible;
    for (size_t i = 0; i < levels_.size(); ++i) {
      assert(levels_[i] >= 0);
      state_[i] = levels_[i] < level ? Row::kFrozen : Row::kAside;
      SetSides(static_cast<int>(i));
    }
    status_ = Relaxed(Start::kWarm);
    if (status_ == Status::kSolved) break;
    if (status_ != Status::kInfeasible) return status_;
    level = LastLevel(solver_.conflict());
  }
  while (level < INT_MAX) {
    status_ = MinimizeLevel(level);
    if (status_ != Status::kSolved) return status_;
    int next = INT_MAX;
    for (const int other : levels_) {
      if (other > level) next = std::min(next, other);
    }
    level = next;
  }
  return status_;
}

int HierarchySolver::LastLevel(const RowWeights& proof) const {
  int last = 0;
  for (const RowWeight& row : proof) {
    if (IsSoft(row)) last = std::max(last, levels_[static_cast<size_t>(row.index)]);
  }
  return last;
}

double HierarchySolver::SideOf(const RowWeight& row) const {
  const bool low = row.weight > 0;
  switch (row.kind) {
    case RowKind::kEquality:
      return problem_->e()[row.index];
    case RowKind::kInequality:
      return (low ? lower_ : upper_)[row.index];
    case RowKind::kBound:
      break;
  }
  return (low ? problem_->x_lower() : problem_->x_upper())[row.index];
}

bool HierarchySolver::IsSoft(const RowWeight& row) const {
  return row.kind == RowKind::kInequality && levels_[row.index] > 0;
}

Status HierarchySolver::MinimizeLevel(int level) {
  const int m = static_cast<int>(levels_.size());
  const auto set_free = [&](double v) {
    for (int i = 0; i < m; ++i) {
      const auto row = static_cast<size_t>(i);
      if (levels_[row] != level || state_[row] == Row::kFrozen) continue;
      state_[row] = Row::kFree;
      violations_[row] = v;
      SetSides(i);
    }
  };
  const auto is_free = [&](const RowWeight& row) {
    return row.kind == RowKind::kInequality && state_[row.index] == Row::kFree;
  };
  double v = 0;
  set_free(0);
  RowWeights proof;
  // Each round freezes a row, each proof within one is a new set of rows.
  for (int round = 0; round < 50 + 20 * m; ++round) {
    const Status status = Relaxed(Start::kWarm);
    if (status == Status::kSolved) {
      if (v == 0) {
        for (int i = 0; i < m; ++i) {
          const auto row = static_cast<size_t>(i);
          if (levels_[row] == level) state_[row] = Row::kFrozen;
        }
        return status;
      }
      double largest = 0;
      for (const RowWeight& row : proof) {
        if (is_free(row)) largest = std::max(largest, std::abs(row.weight));
      }
      for (const RowWeight& row : proof) {
        if (is_free(row) && std::abs(row.weight) >= kFreezeWeight * largest) {
          state_[row.index] = Row::kFrozen;
          ++num_relaxed_;
        }
      }
      bool any = false;
      for (int i = 0; i < m; ++i) any = any || state_[static_cast<size_t>(i)] == Row::kFree;
      if (!any) return status;
      v = 0;
      set_free(0);
      continue;
    }
    if (status != Status::kInfeasible) return status;
    proof = solver_.conflict();
    double gap = 0, terms = 0, free = 0, soft = 0;
    for (const RowWeight& row : proof) {
      const double side = row.weight * SideOf(row);
      gap += side;
      terms += std::abs(side);
      // A side less its violation is rounded like the larger of both.
      if (IsSoft(row)) terms += std::abs(row.weight) * violations_[row.index];
      if (is_free(row)) free += std::abs(row.weight);
      if (IsSoft(row)) soft += std::abs(row.weight);
    }
    if (!(soft > 0)) return status;
    if (gap <= kRounding * terms) {
      // All of them are relaxed a little, those of earlier levels too.
      const double slack = (2 * std::max(gap, 0.0) + 1e-14 * terms) / soft;
      for (const RowWeight& row : proof) {
        if (!IsSoft(row) || is_free(row)) continue;
        violations_[row.index] += slack;
        SetSides(row.index);
      }
      if (free > 0) v += slack;
    } else {
      if (!(free > 0)) return status;
      v += gap / free;
    }
    set_free(v);
  }
  return Status::kIterationLimit;
}

}  // namespace tether::qp
