#pragma once

#include <cstddef>

// Compiled once for every machine and once for those with AVX2, chosen when the program starts. Each number
// is computed by the same operations in the same order in both, so the results are the same bits.
#if defined(__x86_64__) && defined(__gnu_linux__) && !defined(__clang__) && !defined(__SANITIZE_ADDRESS__)
#define TETHER_MULTIVERSION __attribute__((target_clones("avx2", "default")))
#else
#define TETHER_MULTIVERSION
#endif
#define TETHER_KERNEL inline __attribute__((always_inline))

/// Kernels on dense blocks of 6 × 6 doubles, column by column.
namespace tether::nlp::block {

/// A column of a block: six lanes, as four and two. Loads and stores need no alignment.
struct Column {
  // A vector may alias the doubles that it consists of. NOLINTBEGIN(modernize-use-using)
  typedef double Four __attribute__((vector_size(32), aligned(8), may_alias));
  typedef double Two __attribute__((vector_size(16), aligned(8), may_alias));
  // NOLINTEND(modernize-use-using)
  Four head;
  Two tail;
};

TETHER_KERNEL Column Load(const double* from) {
  return {*reinterpret_cast<const Column::Four*>(from), *reinterpret_cast<const Column::Two*>(from + 4)};
}
TETHER_KERNEL void Store(const Column& column, double* to) {
  *reinterpret_cast<Column::Four*>(to) = column.head;
  *reinterpret_cast<Column::Two*>(to + 4) = column.tail;
}
TETHER_KERNEL void AddScaled(const Column& column, double factor, Column& sum) {
  sum.head += column.head * factor;
  sum.tail += column.tail * factor;
}
TETHER_KERNEL void SubtractScaled(const Column& column, double factor, Column& sum) {
  sum.head -= column.head * factor;
  sum.tail -= column.tail * factor;
}

/// target −= left · rightᵀ.
TETHER_KERNEL void SubtractProduct(const double* left, const double* right, double* target) {
  for (int j = 0; j < 6; ++j) {
    Column sum = Load(target + 6 * j);
    for (int k = 0; k < 6; ++k) SubtractScaled(Load(left + 6 * k), right[6 * k + j], sum);
    Store(sum, target + 6 * j);
  }
}

/// A ← A · L⁻ᵀ, where L is lower triangular.
TETHER_KERNEL void SolveFromRight(const double* L, double* A) {
  for (int j = 0; j < 6; ++j) {
    Column column = Load(A + 6 * j);
    for (int k = 0; k < j; ++k) SubtractScaled(Load(A + 6 * k), L[6 * k + j], column);
    const double factor = 1 / L[7 * j];
    column.head *= factor;
    column.tail *= factor;
    Store(column, A + 6 * j);
  }
}

/// y −= A x.
TETHER_KERNEL void SubtractTimes(const double* A, const double* x, double* y) {
  Column sum = Load(y);
  for (int k = 0; k < 6; ++k) SubtractScaled(Load(A + 6 * k), x[k], sum);
  Store(sum, y);
}

/// The sum over six products.
TETHER_KERNEL double Dot(const double* a, const double* b) {
  const Column left = Load(a), right = Load(b);
  const Column::Four four = left.head * right.head;
  const Column::Two two = left.tail * right.tail;
  return ((four[0] + four[2]) + two[0]) + ((four[1] + four[3]) + two[1]);
}

/// y −= Aᵀ x.
TETHER_KERNEL void SubtractTransposedTimes(const double* A, const double* x, double* y) {
  for (int k = 0; k < 6; ++k) y[k] -= Dot(A + 6 * k, x);
}

/// target += Σ over `count` rows of wᵣ leftᵣ rightᵣᵀ, where left and right are six entries of each row, from
/// its offsets on.
TETHER_KERNEL void AddWeightedProducts(const double* const* rows, const double* weights, size_t count,
                                       size_t left, size_t right, double* target) {
  Column sum[6];
  for (int j = 0; j < 6; ++j) sum[j] = Load(target + 6 * j);
  for (size_t r = 0; r < count; ++r) {
    const Column column = Load(rows[r] + left);
    const double* g = rows[r] + right;
    for (int j = 0; j < 6; ++j) AddScaled(column, weights[r] * g[j], sum[j]);
  }
  for (int j = 0; j < 6; ++j) Store(sum[j], target + 6 * j);
}

}  // namespace tether::nlp::block
