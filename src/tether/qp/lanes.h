#pragma once

// Vectors of 8·K numbers for the kernels of the active-set method, cut into vectors of the instruction set.
// Every operation acts lane by lane and every sum has one fixed order, so all instruction sets give the same
// bits. Each kernel compiles its own copy: TETHER_QP_KERNEL names its namespace, TETHER_QP_LANES its width.
#ifndef TETHER_QP_KERNEL
#define TETHER_QP_KERNEL baseline
#define TETHER_QP_LANES 2
#endif

#define TETHER_QP_INLINE inline __attribute__((always_inline))

namespace tether::qp::TETHER_QP_KERNEL {

inline constexpr int kLanes = TETHER_QP_LANES;
// A vector may alias the doubles that it consists of. NOLINTNEXTLINE(modernize-use-using)
typedef double Native __attribute__((vector_size(8 * TETHER_QP_LANES)));

/// body(i) for i from `first` to before N, or before n where N is zero; unrolled where N is known.
template <int N, class Body>
TETHER_QP_INLINE void For(int first, int n, const Body& body) {
  if constexpr (N > 0) {
#pragma GCC unroll 8
    for (int i = first; i < N; ++i) body(i);
  } else {
    for (int i = first; i < n; ++i) body(i);
  }
}

template <int K>
struct Vec {
  static constexpr int kParts = 8 * K / kLanes;
  Native part[kParts];
};

template <int K>
TETHER_QP_INLINE Vec<K> Load(const double* from) {
  Vec<K> out;
#pragma GCC unroll 16
  for (int i = 0; i < Vec<K>::kParts; ++i) out.part[i] = *reinterpret_cast<const Native*>(from + kLanes * i);
  return out;
}

template <int K>
TETHER_QP_INLINE void Store(double* to, const Vec<K>& a) {
#pragma GCC unroll 16
  for (int i = 0; i < Vec<K>::kParts; ++i) *reinterpret_cast<Native*>(to + kLanes * i) = a.part[i];
}

template <int K>
TETHER_QP_INLINE Vec<K> Zero() {
  Vec<K> out;
#pragma GCC unroll 16
  for (int i = 0; i < Vec<K>::kParts; ++i) out.part[i] = Native{};
  return out;
}

template <int K>
TETHER_QP_INLINE Vec<K> Scale(const Vec<K>& a, double s) {
  Vec<K> out;
#pragma GCC unroll 16
  for (int i = 0; i < Vec<K>::kParts; ++i) out.part[i] = a.part[i] * s;
  return out;
}

/// y + s a
template <int K>
TETHER_QP_INLINE Vec<K> AddScaled(const Vec<K>& y, const Vec<K>& a, double s) {
  Vec<K> out;
#pragma GCC unroll 16
  for (int i = 0; i < Vec<K>::kParts; ++i) out.part[i] = y.part[i] + a.part[i] * s;
  return out;
}

/// y − s a
template <int K>
TETHER_QP_INLINE Vec<K> SubtractScaled(const Vec<K>& y, const Vec<K>& a, double s) {
  Vec<K> out;
#pragma GCC unroll 16
  for (int i = 0; i < Vec<K>::kParts; ++i) out.part[i] = y.part[i] - a.part[i] * s;
  return out;
}

template <int K>
TETHER_QP_INLINE Vec<K> Multiply(const Vec<K>& a, const Vec<K>& b) {
  Vec<K> out;
#pragma GCC unroll 16
  for (int i = 0; i < Vec<K>::kParts; ++i) out.part[i] = a.part[i] * b.part[i];
  return out;
}

template <int K>
TETHER_QP_INLINE Vec<K> Add(const Vec<K>& a, const Vec<K>& b) {
  Vec<K> out;
#pragma GCC unroll 16
  for (int i = 0; i < Vec<K>::kParts; ++i) out.part[i] = a.part[i] + b.part[i];
  return out;
}

TETHER_QP_INLINE Native Larger(const Native& a, const Native& b) { return a > b ? a : b; }

template <int K>
TETHER_QP_INLINE Vec<K> Larger(const Vec<K>& a, const Vec<K>& b) {
  Vec<K> out;
#pragma GCC unroll 16
  for (int i = 0; i < Vec<K>::kParts; ++i) out.part[i] = Larger(a.part[i], b.part[i]);
  return out;
}

/// |a|, the larger of a and −a.
template <int K>
TETHER_QP_INLINE Vec<K> Absolute(const Vec<K>& a) {
  Vec<K> out;
#pragma GCC unroll 16
  for (int i = 0; i < Vec<K>::kParts; ++i) out.part[i] = Larger(a.part[i], -a.part[i]);
  return out;
}

/// The sum of all lanes: halves are added to one another until one lane is left, packs in turn.
template <int K>
TETHER_QP_INLINE double Sum(const Vec<K>& a) {
  double sum = 0;
  for (int k = 0; k < K; ++k) {
    const Native* p = a.part + k * (8 / kLanes);
    double total;
    if constexpr (kLanes == 2) {
      const Native s = (p[0] + p[2]) + (p[1] + p[3]);
      total = s[0] + s[1];
    } else {
      const Native s = p[0] + p[1];
      total = (s[0] + s[2]) + (s[1] + s[3]);
    }
    sum = k == 0 ? total : sum + total;
  }
  return sum;
}

/// The largest lane.
TETHER_QP_INLINE double Largest(const Native& a) {
  double best = a[0];
#pragma GCC unroll 8
  for (int i = 1; i < kLanes; ++i) best = a[i] > best ? a[i] : best;
  return best;
}

template <int K>
TETHER_QP_INLINE double Largest(const Vec<K>& a) {
  Native best = a.part[0];
#pragma GCC unroll 16
  for (int i = 1; i < Vec<K>::kParts; ++i) best = Larger(a.part[i], best);
  return Largest(best);
}

}  // namespace tether::qp::TETHER_QP_KERNEL
