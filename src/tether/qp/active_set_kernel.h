#pragma once

#include <cmath>

#include "tether/qp/active_set.h"
#include "tether/qp/active_set_basis.h"
#include "tether/qp/lanes.h"

/// The dual active-set method of Goldfarb and Idnani ("A numerically stable dual method for solving strictly
/// convex quadratic programs", Mathematical Programming 27, 1983), with three changes. H = L D Lᵀ needs one
/// division per column on its critical path. A row joins by one Householder reflection in place of a chain of
/// Givens rotations; J is kept by columns and by rows, so that neither Jᵀa nor J d sums across lanes. The end
/// is checked, and refined where rounding has piled up.
namespace tether::qp::TETHER_QP_KERNEL {
namespace {

template <int N, int K>
template <bool kFirst>
TETHER_QP_INLINE bool Kernel<N, K>::Price(double& most) {
  Native best = Native{} - kHuge;
  Native taint = Native{}, crossing = Native{};
  const Vec<K> x = Load<K>(f_.x);
  const auto look = [&](const Native& value, const double* lower, const double* upper, int at) {
    const Native low = *reinterpret_cast<const Native*>(lower);
    const Native high = *reinterpret_cast<const Native*>(upper);
    const Native over = Larger(low - value, value - high) + *reinterpret_cast<const Native*>(f_.mask + at);
    *reinterpret_cast<Native*>(f_.violation + at) = over;
    best = Larger(over, best);
    if constexpr (kFirst) {
      // NaN where a number is NaN or must not be infinite; the lower side may be −∞, the upper one +∞.
      taint += value * 0.0;
      taint += (low < kHuge ? Native{} : low - low) + (high > -kHuge ? Native{} : high - high);
      crossing = Larger(low - high, crossing);
    }
  };
  for (int i = 0; i < f_.padded_m; i += kLanes) {
    const double* a = f_.A + i;
    Native value = *reinterpret_cast<const Native*>(a) * f_.x[0];
    For<N>(1, n(), [&](int j) { value += *reinterpret_cast<const Native*>(a + j * f_.padded_m) * f_.x[j]; });
    *reinterpret_cast<Native*>(f_.rows + i) = value;
    look(value, f_.lower + i, f_.upper + i, i);
  }
#pragma GCC unroll 16
  for (int p = 0; p < Vec<K>::kParts; ++p) {
    look(x.part[p], f_.x_lower + p * kLanes, f_.x_upper + p * kLanes, f_.padded_m + p * kLanes);
  }
  most = Largest(best);
  if constexpr (kFirst) {
    double sum = 0;
    for (int i = 0; i < kLanes; ++i) sum += taint[i];
    crossed_ = Largest(crossing) > 0;
    return sum == 0;
  }
  return true;
}

template <int N, int K>
bool Kernel<N, K>::FindCrossed() {
  for (int i = 0; i < f_.padded_m + kStride; ++i) {
    const int j = i - f_.padded_m;
    const double low = j < 0 ? f_.lower[i] : f_.x_lower[j], high = j < 0 ? f_.upper[i] : f_.x_upper[j];
    if (!(low - high > kConflictTolerance * (std::abs(low) + std::abs(high)))) continue;
    f_.q = 1;
    f_.fixed = 0;
    f_.position[0] = f_.conflict_position = i;
    f_.sign[0] = 1;
    f_.u[0] = 0;
    f_.r[0] = -1;
    f_.conflict_sign = -1;
    return true;
  }
  return false;
}

template <int N, int K>
TETHER_QP_INLINE int Kernel<N, K>::Position(double most) const {
  int position = 0;
  while (f_.violation[position] != most) ++position;
  return position;
}

template <int N, int K>
TETHER_QP_INLINE int Kernel<N, K>::ViolatedSign(int position) const {
  const bool is_row = position < f_.padded_m;
  const int index = is_row ? position : position - f_.padded_m;
  const double value = is_row ? f_.rows[index] : f_.x[index];
  const double low = is_row ? f_.lower[index] : f_.x_lower[index];
  const double high = is_row ? f_.upper[index] : f_.x_upper[index];
  return low - value > value - high ? 1 : -1;
}

template <int N, int K>
TETHER_QP_INLINE int Kernel<N, K>::Blocking() const {
  int blocking = -1;
  for (int k = f_.fixed; k < f_.q; ++k) {
    if (f_.r[k] * f_.norms[k] > 1e-13 * row_norm_ &&
        (blocking < 0 || f_.u[k] * f_.r[blocking] < f_.u[blocking] * f_.r[k])) {
      blocking = k;
    }
  }
  return blocking;
}

template <int N, int K>
double Kernel<N, K>::RowScale(int position) const {
  alignas(64) double size[kStride];
  Store<K>(size, Larger<K>(Absolute<K>(Load<K>(f_.x)), Absolute<K>(Load<K>(f_.x0))));
  if (position < 0) {
    const Vec<K> row = Absolute<K>(Load<K>(f_.E + (-1 - position) * kStride));
    return Sum<K>(Multiply<K>(row, Load<K>(size))) + std::abs(f_.e[-1 - position]);
  }
  double terms = 0, value = 0, low = 0, high = 0;
  if (position < f_.padded_m) {
    for (int j = 0; j < n(); ++j) terms += std::abs(f_.A[j * f_.padded_m + position]) * size[j];
    value = f_.rows[position];
    low = f_.lower[position];
    high = f_.upper[position];
  } else {
    const int j = position - f_.padded_m;
    terms = size[j];
    value = f_.x[j];
    low = f_.x_lower[j];
    high = f_.x_upper[j];
  }
  return terms + std::abs(low - value > value - high ? low : high);
}

template <int N, int K>
int Kernel<N, K>::Search() const {
  // After many iterations the method is probably cycling by rounding errors.
  const double tolerance = 4 * f_.iterations > f_.max_iterations ? 10 * kRowTolerance : kRowTolerance;
  const int count = f_.padded_m + kStride;
  int best = count;
  double most = 0;
  for (int i = 0; i < count; ++i) {
    if (f_.violation[i] > most && f_.violation[i] > tolerance * RowScale(i)) {
      most = f_.violation[i];
      best = i;
    }
  }
  return best;
}

template <int N, int K>
void Kernel<N, K>::DropNegative() {
  for (int k = 0; k < f_.q; ++k) {
    f_.w[k] = 0;
    for (int i = k; i < f_.q; ++i) f_.w[k] += f_.R[k * kStride + i] * f_.u[i];
  }
  for (;;) {
    int worst = -1;
    double least = 0;
    for (int k = f_.fixed; k < f_.q; ++k) {
      if (f_.u[k] * f_.norms[k] < least) {
        least = f_.u[k] * f_.norms[k];
        worst = k;
      }
    }
    if (worst < 0) return;
    Drop(worst);
    Store<K>(f_.x, f_.q == 0 ? Load<K>(f_.x0)
                             : SubtractScaled<K>(Load<K>(f_.x), Load<K>(f_.J + f_.q * kStride), f_.w[f_.q]));
    BackSubstitute(f_.w, f_.u);
  }
}

template <int N, int K>
Status Kernel<N, K>::Start() {
  for (int i = 0; i < f_.padded_m + kStride; i += 8) Store<1>(f_.mask + i, Zero<1>());
  Store<K>(f_.normal, Zero<K>());
  f_.q = f_.fixed = f_.iterations = 0;
  for (int k = 0; k < f_.num_equalities; ++k) {
    LoadNormal(-1 - k, 1);
    double over = Side(-1 - k, 1) - NormalTimes(f_.x);
    const double across = Direction();
    if (!(std::abs(over) < kHuge && row_norm_ < kHuge)) return Status::kBadInput;
    if (NearlyDepends(across) && Depends(across)) {
      if (std::abs(over) <= kConflictTolerance * RowScale(-1 - k)) continue;
      Refine(false);
      over = Side(-1 - k, 1) - NormalTimes(f_.x);
      if (std::abs(over) <= kConflictTolerance * RowScale(-1 - k)) continue;
      f_.conflict_position = -1 - k;
      f_.conflict_sign = over > 0 ? 1 : -1;
      BackSubstitute(f_.d, f_.r);
      for (int i = 0; i < f_.q; ++i) f_.r[i] *= f_.conflict_sign;
      return Status::kInfeasible;
    }
    f_.w[f_.q] = 0;
    Store<K>(f_.x, AddScaled<K>(Load<K>(f_.x), Load<K>(f_.z), over / across));
    const int q = f_.q;
    Append(across, -1 - k, 1, Side(-1 - k, 1), 0);
    f_.w[q] = over * f_.inverse_diagonal[q];
    f_.fixed = f_.q;
  }
  for (int i = 0; i < f_.num_warm && f_.q < n(); ++i) {
    const int position = f_.warm_position[i], sign = f_.warm_sign[i];
    const double side = Side(position, sign);
    if (!(std::abs(side) < kHuge)) continue;
    LoadNormal(position, sign);
    const double over = side - NormalTimes(f_.x);
    const double across = Direction();
    if (NearlyDepends(across)) continue;
    Store<K>(f_.x, AddScaled<K>(Load<K>(f_.x), Load<K>(f_.z), over / across));
    const int q = f_.q;
    Append(across, position, sign, side, 0);
    f_.w[q] = over * f_.inverse_diagonal[q];
  }
  if (f_.q > 0) {
    BackSubstitute(f_.w, f_.u);
    for (int k = f_.fixed; k < f_.q; ++k) {
      if (f_.u[k] < 0) {
        DropNegative();
        break;
      }
    }
  }
  return Status::kSolved;
}

template <int N, int K>
Status Kernel<N, K>::Solve() {
  if (!Factorize()) return Status::kBadInput;
  if (const Status status = Start(); status != Status::kSolved) return status;
  int refinements = 0;
  double most;
  if (!Price<true>(most)) return Status::kBadInput;
  if (crossed_ && FindCrossed()) return Status::kInfeasible;
  for (;;) {
    int position = 0;
    if (most > 0) {
      position = Position(most);
      if (most <= kRowTolerance * 1e3 * RowScale(position) || 4 * f_.iterations > f_.max_iterations) {
        position = Search();
      }
    }
    if (!(most > 0) || position == f_.padded_m + kStride) {
      if (Refine(refinements < kMostRefinements) <= kRefineAbove || ++refinements > kMostRefinements) break;
      for (int k = f_.fixed; k < f_.q; ++k) {
        if (f_.u[k] * f_.norms[k] < 0) {
          DropNegative();
          break;
        }
      }
      Price<false>(most);
      continue;
    }
    const int sign = ViolatedSign(position);
    LoadNormal(position, sign);
    const double side = Side(position, sign);
    double over = most;
    double u = 0;
    for (;;) {
      if (++f_.iterations > f_.max_iterations) return Status::kIterationLimit;
      const double across = Direction();
      const bool depends = f_.q == n() || (NearlyDepends(across) && Depends(across));
      BackSubstitute(f_.d, f_.r);
      const int blocking = Blocking();
      if (depends && blocking < 0) {
        // Proved infeasible, unless the violation is rounding.
        for (int k = 0; k < f_.q; ++k) f_.u[k] += u * f_.r[k];
        Refine(false);
        over = side - NormalTimes(f_.x);
        if (over > kConflictTolerance * RowScale(position)) {
          f_.conflict_position = position;
          f_.conflict_sign = sign;
          return Status::kInfeasible;
        }
        f_.mask[position] = -kHuge;
        DropNegative();
        break;
      }
      const double full = depends ? kHuge : over / across;
      const double partial = blocking < 0 ? kHuge : f_.u[blocking] / f_.r[blocking];
      const double step = full < partial ? full : partial;
      if (!(step < kHuge)) return Status::kBadInput;
      for (int k = 0; k < f_.q; ++k) {
        f_.u[k] -= step * f_.r[k];
        if (k >= f_.fixed && f_.u[k] < 0) f_.u[k] = 0;
      }
      u += step;
      if (!depends) Store<K>(f_.x, AddScaled<K>(Load<K>(f_.x), Load<K>(f_.z), step));
      if (full <= partial) {
        Append(across, position, sign, side, u);
        break;
      }
      Drop(blocking);
      if (!depends) over = side - NormalTimes(f_.x);
    }
    Price<false>(most);
  }
  for (int k = f_.fixed; k < f_.q; ++k) {
    if (f_.u[k] < 0) f_.u[k] = 0;
  }
  return Status::kSolved;
}

}  // namespace

Status SolveActiveSet(Frame& frame) {
  switch (frame.stride) {
    case 8:
      if (frame.n == 6) return Kernel<6, 1>(frame).Solve();
      if (frame.n == 7) return Kernel<7, 1>(frame).Solve();
      if (frame.n == 8) return Kernel<8, 1>(frame).Solve();
      return Kernel<0, 1>(frame).Solve();
    case 16:
      return Kernel<0, 2>(frame).Solve();
    default:
      return Kernel<0, 3>(frame).Solve();
  }
}

}  // namespace tether::qp::TETHER_QP_KERNEL
