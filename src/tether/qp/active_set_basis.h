#pragma once

#include <cmath>

#include "tether/qp/active_set.h"
#include "tether/qp/lanes.h"

/// The class of the active-set kernel (active_set_kernel.h), and its linear algebra: the factorisation of H,
/// the basis J and the triangle R of the active rows, and refinement on them.
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
  /// Computes for `normal` a: d = Jᵀa, z = J₂J₂ᵀa, and returns aᵀJ₂J₂ᵀa.
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

  /// Finds how much each position is violated, and the most. The first time it also checks that all numbers
  /// are finite (else false), and whether a row's sides cross.
  template <bool kFirst>
  bool Price(double& most);
  /// Whether the sides of a row cross by more than rounding, which proves infeasibility.
  bool FindCrossed();
  int Position(double most) const;
  /// Which side of a violated row or bound is violated: 1 for the lower one, −1 for the upper one.
  int ViolatedSign(int position) const;
  /// The active constraint whose multiplier becomes zero first along r; −1 if none does.
  int Blocking() const;
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
  // so the right-hand side is kept there.
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

}  // namespace
}  // namespace tether::qp::TETHER_QP_KERNEL
