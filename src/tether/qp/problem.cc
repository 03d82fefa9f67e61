#include "tether/qp/problem.h"

#include <algorithm>
#include <cassert>

namespace tether::qp {
namespace {

constexpr int RoundUp(int count) { return (count + 7) / 8 * 8; }

}  // namespace

Problem::Problem(int max_variables, int max_equalities, int max_inequalities)
    : max_n_(max_variables), max_equalities_(max_equalities), max_m_(max_inequalities) {
  assert(max_n_ >= 1 && max_n_ <= kMaxVariables && max_equalities_ >= 0 && max_m_ >= 0);
  const Eigen::Index stride = RoundUp(max_n_), m = RoundUp(max_m_);
  const Eigen::Index size =
      stride * (stride + 3) + RoundUp(max_equalities_) + max_equalities_ * stride + m * (max_n_ + 2);
  memory_.resize(size / 8);
  Resize(max_variables, max_equalities, max_inequalities);
}

void Problem::Resize(int variables, int equalities, int inequalities) {
  assert(variables >= 1 && variables <= max_n_);
  assert(equalities >= 0 && equalities <= max_equalities_ && inequalities >= 0 && inequalities <= max_m_);
  n_ = variables;
  num_equalities_ = equalities;
  m_ = inequalities;
  stride_ = RoundUp(n_);
  padded_m_ = RoundUp(m_);
  Eigen::Index next = 0;
  const auto take = [&](Eigen::Index size) {
    const Eigen::Index first = next;
    next += size;
    return first;
  };
  H_ = take(stride_ * stride_);
  g_ = take(stride_);
  E_ = take(num_equalities_ * stride_);
  e_ = take(RoundUp(num_equalities_));
  A_ = take(padded_m_ * n_);
  std::fill(at(0), at(next), 0.0);
  lower_ = take(padded_m_);
  x_lower_ = take(stride_);
  std::fill(at(lower_), at(next), -kInfinity);
  upper_ = take(padded_m_);
  x_upper_ = take(stride_);
  std::fill(at(upper_), at(next), kInfinity);
}

}  // namespace tether::qp
