#include "tether/qp/solver.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace tether::qp {
namespace {

constexpr int RoundUp(int count) { return (count + 7) / 8 * 8; }

bool HasAvx2() {
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
  return __builtin_cpu_supports("avx2") != 0;
#else
  return false;
#endif
}

}  // namespace

std::string ToString(Status status) {
  switch (status) {
    case Status::kNotSolved:
      return "not solved";
    case Status::kSolved:
      return "solved";
    case Status::kInfeasible:
      return "infeasible";
    case Status::kIterationLimit:
      return "iteration limit";
    case Status::kBadInput:
      return "bad input";
  }
  return "";
}

std::string ToString(RowKind kind) {
  switch (kind) {
    case RowKind::kEquality:
      return "equality";
    case RowKind::kInequality:
      return "inequality";
    case RowKind::kBound:
      return "bound";
  }
  return "";
}

Solver::Solver(int max_variables, int max_equalities, int max_inequalities, const SolverOptions& options)
    : max_n_(max_variables), max_equalities_(max_equalities), max_m_(max_inequalities), options_(options) {
  assert(max_n_ >= 1 && max_n_ <= kMaxVariables && max_equalities_ >= 0 && max_m_ >= 0);
  kernel_ = &baseline::SolveActiveSet;
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
  if (options.instructions == Instructions::kBest && HasAvx2()) kernel_ = &avx2::SolveActiveSet;
#endif
  const int stride = RoundUp(max_n_), rows = RoundUp(max_m_);
  memory_.resize((4 * stride * stride + 13 * stride + 3 * rows + 2 * stride) / 8);
  double* next = reinterpret_cast<double*>(memory_.data());
  const auto take = [&](int size) {
    double* first = next;
    next += size;
    return first;
  };
  for (double** matrix : {&frame_.J, &frame_.Jt, &frame_.R, &frame_.normals}) *matrix = take(stride * stride);
  for (double** vector : {&frame_.inverse_diagonal, &frame_.x, &frame_.x0, &frame_.d, &frame_.z, &frame_.r,
                          &frame_.v, &frame_.normal, &frame_.sides, &frame_.u, &frame_.norms, &frame_.w}) {
    *vector = take(stride);
  }
  frame_.rows = take(rows);
  frame_.violation = take(rows + stride);
  frame_.mask = take(rows + stride);
  frame_.position = position_.data();
  frame_.sign = sign_.data();
}

RowWeight Solver::Row(int position, double weight) const {
  if (position < 0) return {RowKind::kEquality, -1 - position, weight};
  if (position < frame_.padded_m) return {RowKind::kInequality, position, weight};
  return {RowKind::kBound, position - frame_.padded_m, weight};
}

Status Solver::Solve(const Problem& problem, Start start) {
  return Solve(problem, problem.lower().data(), problem.upper().data(), start);
}

Status Solver::Solve(const Problem& problem, const double* lower, const double* upper, Start start) {
  assert(problem.num_variables() <= max_n_ && problem.num_equalities() <= max_equalities_ &&
         problem.num_inequalities() <= max_m_);
  Frame& f = frame_;
  f.n = problem.num_variables();
  f.stride = problem.stride();
  f.m = problem.num_inequalities();
  f.padded_m = problem.padded_rows();
  f.num_equalities = problem.num_equalities();
  f.H = problem.H().data();
  f.g = problem.g().data();
  f.A = problem.A().data();
  f.lower = lower;
  f.upper = upper;
  f.x_lower = problem.x_lower().data();
  f.x_upper = problem.x_upper().data();
  f.E = problem.E().data();
  f.e = problem.e().data();
  f.max_iterations =
      options_.max_iterations > 0 ? options_.max_iterations : 50 + 5 * (f.n + f.m + f.num_equalities);
  f.num_warm = 0;
  if (start == Start::kWarm) {
    for (const RowWeight& row : active_) {
      if (row.kind == RowKind::kEquality || row.weight == 0) continue;
      if (row.index >= (row.kind == RowKind::kBound ? f.n : f.m)) continue;
      warm_position_[f.num_warm] = row.kind == RowKind::kBound ? f.padded_m + row.index : row.index;
      warm_sign_[f.num_warm++] = row.weight > 0 ? 1 : -1;
    }
  }
  f.warm_position = warm_position_.data();
  f.warm_sign = warm_sign_.data();
  f.q = f.fixed = 0;
  status_ = kernel_(f);
  active_.Clear();
  for (int k = 0; k < f.q; ++k) active_.Add(Row(f.position[k], f.sign[k] * f.u[k]));
  conflict_.Clear();
  if (status_ == Status::kInfeasible) CollectConflict();
  return status_;
}

void Solver::CollectConflict() {
  const Frame& f = frame_;
  double largest = 1;
  for (int k = 0; k < f.q; ++k) largest = std::max(largest, std::abs(f.r[k]));
  conflict_.Add(Row(f.conflict_position, f.conflict_sign / largest));
  for (int k = 0; k < f.q; ++k) {
    // Of an inequality the wrong sign is rounding.
    if (f.r[k] != 0 && (f.r[k] < 0 || k < f.fixed))
      conflict_.Add(Row(f.position[k], -f.sign[k] * f.r[k] / largest));
  }
}

}  // namespace tether::qp
