#pragma once

#include <cmath>

#include "tether/qp/active_set.h"
#include "tether/qp/lanes.h"

/// The dual active-set method of Goldfarb and Idnani ("A numerically stable dual method for solving strictly
/// convex quadratic programs", Mathematical Programming 27, 1983), with three changes. H = L D Lᵀ needs one
/// division per column on its critical path. A row joins by one Householder reflection in place of a chain of
/// Givens rotations; J is kept by columns and by rows, so that neither Jᵀa nor J d sums across lanes. The end
/// is checked, and refined where rounding has piled up.
namespace tether::qp::TETHER_QP_KERNEL {
namespace {

constexpr double kHuge = 1e300;
/// A pivot below this part of its diagonal entry: H is not positive definite.
constexpr double kPivotTolerance = 1e-14;
/// Violations below this part of the terms of a row are rounding.
constexpr double kRowTolerance = 1e-14;
/// Violations below this part are no proof that a dependent row can't hold.
constexpr double kConflictTolerance = 4e-13;
/// A row whose part across the active ones is shorter than this part of it depends on them.
constexpr double kDependent = 1e-11;
/// Residuals above this part of their terms are refined.
constexpr double kRefineAbove = 1e-14;
constexpr int kMostRefinements = 4;

/// N is the number of variables where it is known at compile time, else 0; K packs of 8 hold a vector.
template <int N, int K>
class Kernel {
 public:
  explicit Kernel(Frame& frame) : f_(frame) {}

  Status Solve();

 private:
  static constexpr int kStride = 8 * K;
  static constexpr int kMost = N > 0 ? N : kStride;

  int n() const { return N > 0 ? N : f_.n; }

  bool Factorize();
  /// Puts in d, z and the return value what is needed to add `normal`: Jᵀa, J₂J₂ᵀa and aᵀJ₂J₂ᵀa.
  double Direction();
  /// Whether the row of the last Direction() depends on the active ones; `across` is what it returned.
  bool Depends(double across);
  bool NearlyDepends(double across) const;
  void BackSubstitute(const double* from, double* to) const;
  /// Makes the row of the last Direction() active.
  void Append(double across, int position, int sign, double side, double u);
  /// Removes active constraint k. Rotates w along with J.
  void Drop(int k);
  void LoadNormal(int position, int sign);
  double Side(int position, int sign) const;
  double NormalTimes(const double* x) const;

  /// Finds how much each position is violated, and the most. The first time it also looks for numbers that
  /// are not finite, then false, and for a row whose sides cross.
  template <bool kFirst>
  bool Price(double& most);
  /// Whether the sides of a row cross by more than rounding, which proves infeasibility.
  bool FindCrossed();
  int Position(double most) const;
  /// The position most violated beyond rounding; padded_m + stride if there is none.
  int Search() const;
  double RowScale(int position) const;

  Status Start();
  /// Drops constraints with negative multipliers until none is left; x follows.
  void DropNegative();
  /// One step of iterative refinement on the active set; returns the residual before it, relative.
  double Refine(bool only_measure);
  double Residual(double* rs, double* rp) const;

  Frame& f_;
  double row_norm_ = 0;  // of Jᵀa
  bool crossed_ = false;
};

template <int N, int K>
bool Kernel<N, K>::Factorize() {
  // Rows of the Schur complement and of L⁻¹. The first entry of each row of the former is never needed again,
  // so the right-hand side travels there.
  Vec<K> schur[kMost], inverse[kMost];
  alignas(64) double pivots[kStride] = {};
  alignas(64) double l[kStride];
  const double first = f_.H[0];
  for (int i = 0; i < n(); ++i) {
    schur[i] = Load<K>(f_.H + i * kStride);
    schur[i].part[0][0] = -f_.g[i];
    inverse[i] = Zero<K>();
    inverse[i].part[i / kLanes][i % kLanes] = 1;
  }
  Vec<K> x = Zero<K>();
  bool good = true;
  For<N>(0, n(), [&](int j) {
    const double pivot = j == 0 ? first : schur[j].part[j / kLanes][j % kLanes];
    const double diagonal = f_.H[j * kStride + j];
    good = good && pivot > kPivotTolerance * diagonal && pivot < kHuge;
    const double reciprocal = 1 / pivot;
    pivots[j] = reciprocal;
    Store<K>(l, Scale<K>(schur[j], reciprocal));
    x = AddScaled<K>(x, inverse[j], l[0]);
    For<N>(j + 1, n(), [&](int i) {
      const double c = l[i];
#pragma GCC unroll 16
      for (int p = 0; p < Vec<K>::kParts; ++p) {
        if (p == 0 || (p + 1) * kLanes > i) schur[i].part[p] -= schur[j].part[p] * c;
        if (p * kLanes <= j) inverse[i].part[p] -= inverse[j].part[p] * c;
      }
    });
  });
  if (!good) return false;
  for (double& pivot : pivots) pivot = std::sqrt(pivot);
  Store<K>(f_.x, x);
  Store<K>(f_.x0, x);
  For<N>(0, n(), [&](int k) { Store<K>(f_.J + k * kStride, Scale<K>(inverse[k], pivots[k])); });
  for (int i = 0; i < n(); ++i) Store<K>(f_.Jt + i * kStride, Zero<K>());
  For<N>(0, n(), [&](int k) {
    for (int i = 0; i <= k; ++i) f_.Jt[i * kStride + k] = f_.J[k * kStride + i];
  });
  return Sum<K>(Scale<K>(x, 0)) == 0;
}

template <int N, int K>
TETHER_QP_INLINE void Kernel<N, K>::LoadNormal(int position, int sign) {
  if (position < 0) {
    Store<K>(f_.normal, Scale<K>(Load<K>(f_.E + (-1 - position) * kStride), sign));
  } else if (position < f_.padded_m) {
    const double* a = f_.A + position;
    For<N>(0, n(), [&](int j) { f_.normal[j] = sign * a[j * f_.padded_m]; });
  } else {
    Store<K>(f_.normal, Zero<K>());
    f_.normal[position - f_.padded_m] = sign;
  }
}

template <int N, int K>
TETHER_QP_INLINE double Kernel<N, K>::Side(int position, int sign) const {
  if (position < 0) return sign * f_.e[-1 - position];
  if (position < f_.padded_m) return sign > 0 ? f_.lower[position] : -f_.upper[position];
  return sign > 0 ? f_.x_lower[position - f_.padded_m] : -f_.x_upper[position - f_.padded_m];
}

template <int N, int K>
TETHER_QP_INLINE double Kernel<N, K>::NormalTimes(const double* x) const {
  return Sum<K>(Multiply<K>(Load<K>(f_.normal), Load<K>(x)));
}

template <int N, int K>
TETHER_QP_INLINE double Kernel<N, K>::Direction() {
  Vec<K> even = Zero<K>(), odd = Zero<K>();
  For<N>(0, n(), [&](int i) {
    Vec<K>& sum = i % 2 == 0 ? even : odd;
    sum = AddScaled<K>(sum, Load<K>(f_.Jt + i * kStride), f_.normal[i]);
  });
  const Vec<K> d = Add<K>(even, odd);
  Store<K>(f_.d, d);
  // Entries of d below q are zeroed in v, without a branch on q.
  Store<K>(f_.v, d);
  for (int k = 0; k < f_.q; ++k) f_.v[k] = 0;
  double across = 0;
  for (int k = f_.q; k < n(); ++k) across += f_.d[k] * f_.d[k];
  double along = 0;
  for (int k = 0; k < f_.q; ++k) along += f_.d[k] * f_.d[k];
  row_norm_ = std::sqrt(along + across);
  Vec<K> z0 = Zero<K>(), z1 = Zero<K>();
  For<N>(0, n(), [&](int k) {
    Vec<K>& sum = k % 2 == 0 ? z0 : z1;
    sum = AddScaled<K>(sum, Load<K>(f_.J + k * kStride), f_.v[k]);
  });
  Store<K>(f_.z, Add<K>(z0, z1));
  return across;
}

template <int N, int K>
TETHER_QP_INLINE bool Kernel<N, K>::NearlyDepends(double across) const {
  return !(across > 1e-12 * row_norm_ * row_norm_);
}

template <int N, int K>
bool Kernel<N, K>::Depends(double across) {
  if (f_.q == n()) return true;
  // Rounding of Jᵀa, bounded by |J|ᵀ|a|.
  double noise = 0;
  for (int i = 0; i < n(); ++i) {
    const Vec<K> row = Load<K>(f_.Jt + i * kStride);
    noise += std::abs(f_.normal[i]) * std::sqrt(Sum<K>(Multiply<K>(row, row)));
  }
  const double length = std::sqrt(across);
  return !(length > kDependent * row_norm_ && length > 1e-15 * n() * noise);
}

template <int N, int K>
TETHER_QP_INLINE void Kernel<N, K>::BackSubstitute(const double* from, double* to) const {
  for (int k = f_.q - 1; k >= 0; --k) {
    double sum = from[k];
    for (int i = k + 1; i < f_.q; ++i) sum -= f_.R[k * kStride + i] * to[i];
    to[k] = sum * f_.inverse_diagonal[k];
  }
}

template <int N, int K>
TETHER_QP_INLINE void Kernel<N, K>::Append(double across, int position, int sign, double side, double u) {
  const int q = f_.q;
  const double length = std::sqrt(across);
  const double s = f_.d[q] < 0 ? -1.0 : 1.0;
  // Reflection of the last n − q columns by v = d₂ + s ‖d₂‖ e_q; the new column is −s z / ‖d₂‖.
  f_.v[q] += s * length;
  const double scale = 1 / (across + length * std::abs(f_.d[q]));
  const Vec<K> v = Scale<K>(Load<K>(f_.v), scale);
  const Vec<K> t = AddScaled<K>(Load<K>(f_.z), Load<K>(f_.J + q * kStride), s * length);
  Store<K>(f_.v, v);
  Store<K>(f_.z, t);
  For<N>(0, n(), [&](int k) {
    double* column = f_.J + k * kStride;
    Store<K>(column, SubtractScaled<K>(Load<K>(column), t, f_.v[k]));
  });
  For<N>(0, n(), [&](int i) {
    double* row = f_.Jt + i * kStride;
    Store<K>(row, SubtractScaled<K>(Load<K>(row), v, f_.z[i]));
  });
  for (int k = 0; k < q; ++k) f_.R[k * kStride + q] = f_.d[k];
  f_.R[q * kStride + q] = -s * length;
  f_.inverse_diagonal[q] = -s * length / across;
  f_.norms[q] = row_norm_;
  f_.u[q] = u;
  f_.position[q] = position;
  f_.sign[q] = sign;
  f_.sides[q] = side;
  Store<K>(f_.normals + q * kStride, Load<K>(f_.normal));
  if (position >= 0) f_.mask[position] = -kHuge;
  ++f_.q;
}

template <int N, int K>
void Kernel<N, K>::Drop(int k) {
  if (f_.position[k] >= 0) f_.mask[f_.position[k]] = 0;
  const int q = --f_.q;
  for (int i = k; i < q; ++i) {
    f_.u[i] = f_.u[i + 1];
    f_.position[i] = f_.position[i + 1];
    f_.sign[i] = f_.sign[i + 1];
    f_.sides[i] = f_.sides[i + 1];
    f_.norms[i] = f_.norms[i + 1];
    Store<K>(f_.normals + i * kStride, Load<K>(f_.normals + (i + 1) * kStride));
    for (int row = 0; row <= i + 1; ++row) f_.R[row * kStride + i] = f_.R[row * kStride + i + 1];
  }
  for (int i = k; i < q; ++i) {
    double* upper = f_.R + i * kStride;
    double* lower = upper + kStride;
    const double h = std::sqrt(upper[i] * upper[i] + lower[i] * lower[i]);
    const double c = upper[i] / h, s = lower[i] / h;
    upper[i] = h;
    f_.inverse_diagonal[i] = 1 / h;
    for (int j = i + 1; j < q; ++j) {
      const double a = upper[j], b = lower[j];
      upper[j] = c * a + s * b;
      lower[j] = c * b - s * a;
    }
    const double a = f_.w[i], b = f_.w[i + 1];
    f_.w[i] = c * a + s * b;
    f_.w[i + 1] = c * b - s * a;
    double* first = f_.J + i * kStride;
    double* second = first + kStride;
    for (int row = 0; row < n(); ++row) {
      const double p = first[row], r = second[row];
      first[row] = c * p + s * r;
      second[row] = c * r - s * p;
      f_.Jt[row * kStride + i] = first[row];
      f_.Jt[row * kStride + i + 1] = second[row];
    }
  }
}

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
      // NaN where a number is NaN or infinite that may not be; sides may be infinite, each its own way.
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
  // A method that has run for long is going round in rounding errors.
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
TETHER_QP_INLINE double Kernel<N, K>::Residual(double* rs, double* rp) const {
  Vec<K> even = Load<K>(f_.g), odd = Zero<K>();
  Vec<K> even_terms = Absolute<K>(even), odd_terms = Zero<K>();
  For<N>(0, n(), [&](int j) {
    const Vec<K> column = Load<K>(f_.H + j * kStride);
    Vec<K>& sum = j % 2 == 0 ? even : odd;
    Vec<K>& terms = j % 2 == 0 ? even_terms : odd_terms;
    sum = AddScaled<K>(sum, column, f_.x[j]);
    terms = AddScaled<K>(terms, Absolute<K>(column), std::abs(f_.x[j]));
  });
  Vec<K> sum = Add<K>(even, odd), terms = Add<K>(even_terms, odd_terms);
  const Vec<K> x = Load<K>(f_.x);
  const Vec<K> size = Larger<K>(Absolute<K>(x), Absolute<K>(Load<K>(f_.x0)));
  double worst = 0;
  for (int k = 0; k < f_.q; ++k) {
    const Vec<K> normal = Load<K>(f_.normals + k * kStride);
    sum = SubtractScaled<K>(sum, normal, f_.u[k]);
    terms = AddScaled<K>(terms, Absolute<K>(normal), std::abs(f_.u[k]));
    rp[k] = f_.sides[k] - Sum<K>(Multiply<K>(normal, x));
    const double scale = Sum<K>(Multiply<K>(Absolute<K>(normal), size)) + std::abs(f_.sides[k]);
    if (std::abs(rp[k]) > worst * scale) worst = std::abs(rp[k]) / scale;
  }
  Store<K>(rs, sum);
  // Entries without terms are zero and exact.
  alignas(64) double terms_of[kStride];
  Store<K>(terms_of, terms);
  if (Largest<K>(SubtractScaled<K>(Absolute<K>(sum), terms, kRefineAbove)) <= 0 && worst <= kRefineAbove) {
    return worst;
  }
  for (int i = 0; i < n(); ++i) {
    if (std::abs(rs[i]) > worst * terms_of[i]) worst = std::abs(rs[i]) / terms_of[i];
  }
  return worst;
}

template <int N, int K>
double Kernel<N, K>::Refine(bool only_measure) {
  alignas(64) double rs[kStride], rp[kStride], y[kStride];
  const double residual = Residual(rs, rp);
  if (only_measure && residual <= kRefineAbove) return residual;
  // With dx = J y: Rᵀ y₁ = rp, y₂ = −J₂ᵀ rs, R du = y₁ + J₁ᵀ rs.
  for (int k = 0; k < n(); ++k) {
    y[k] = -Sum<K>(Multiply<K>(Load<K>(f_.J + k * kStride), Load<K>(rs)));
  }
  for (int k = 0; k < f_.q; ++k) {
    double sum = rp[k];
    for (int i = 0; i < k; ++i) sum -= f_.R[i * kStride + k] * f_.w[i];
    f_.w[k] = sum * f_.inverse_diagonal[k];
    rp[k] = f_.w[k] - y[k];
    y[k] = f_.w[k];
  }
  Vec<K> x = Load<K>(f_.x);
  for (int k = 0; k < n(); ++k) x = AddScaled<K>(x, Load<K>(f_.J + k * kStride), y[k]);
  Store<K>(f_.x, x);
  alignas(64) double du[kStride];
  BackSubstitute(rp, du);
  for (int k = 0; k < f_.q; ++k) f_.u[k] += du[k];
  return residual;
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
    const bool is_row = position < f_.padded_m;
    const int index = is_row ? position : position - f_.padded_m;
    const double value = is_row ? f_.rows[index] : f_.x[index];
    const double low = is_row ? f_.lower[index] : f_.x_lower[index];
    const double high = is_row ? f_.upper[index] : f_.x_upper[index];
    const int sign = low - value > value - high ? 1 : -1;
    LoadNormal(position, sign);
    const double side = sign > 0 ? low : -high;
    double over = most;
    double u = 0;
    for (;;) {
      if (++f_.iterations > f_.max_iterations) return Status::kIterationLimit;
      const double across = Direction();
      const bool depends = f_.q == n() || (NearlyDepends(across) && Depends(across));
      BackSubstitute(f_.d, f_.r);
      // The largest step of the multipliers that leaves them non-negative.
      int blocking = -1;
      double u_block = 0, r_block = 0;
      for (int k = f_.fixed; k < f_.q; ++k) {
        if (f_.r[k] * f_.norms[k] > 1e-13 * row_norm_ &&
            (blocking < 0 || f_.u[k] * r_block < u_block * f_.r[k])) {
          blocking = k;
          u_block = f_.u[k];
          r_block = f_.r[k];
        }
      }
      if (depends && blocking < 0) {
        // Proved infeasible, unless it is rounding that is violated.
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
      const double partial = blocking < 0 ? kHuge : u_block / r_block;
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
