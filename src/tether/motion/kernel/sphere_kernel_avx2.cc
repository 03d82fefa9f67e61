#include "tether/motion/kernel/sphere_kernel.h"

// Clang has no such pragma: there the plain kernel serves.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
// From here on, so that nothing of the standard library is compiled for AVX2. Without FMA: it rounds
// otherwise.
#pragma GCC push_options
#pragma GCC target("avx2")
#include "tether/motion/kernel/sphere_kernel_body.h"

namespace tether::motion::internal {
namespace {

void AddUnsure(KernelAnswer& answer, int part, int other, uint32_t lanes);

/// Eight floats.
struct Wide {
  using F = float __attribute__((vector_size(32)));
  using I = int32_t __attribute__((vector_size(32)));
  static F Splat(float x) { return F{x, x, x, x, x, x, x, x}; }
  static I One() { return I{1, 1, 1, 1, 1, 1, 1, 1}; }
  static I Bits(F x) { return reinterpret_cast<I>(x); }
  static I IsBitSet(I x, int bit) { return (x & (One() * bit)) != 0; }
  static I Less(F a, F b) { return a < b; }
  static F Select(I mask, F a, F b) { return mask ? a : b; }
  static F Max(F a, F b) { return a < b ? b : a; }
  static F Abs(F x) { return reinterpret_cast<F>(Bits(x) & (One() * 0x7fffffff)); }
  static F Sqrt(F x) { return __builtin_ia32_sqrtps256(x); }
  static uint32_t Mask(I mask) {
    return static_cast<uint32_t>(__builtin_ia32_movmskps256(reinterpret_cast<F>(mask)));
  }
  static void Add(KernelAnswer& answer, int part, int other, uint32_t lanes) {
    AddUnsure(answer, part, other, lanes);
  }
};

}  // namespace

void CheckSpheresWide(const KernelTables& tables, const KernelSegment& segment, const KernelQuery& query,
                      KernelAnswer& answer) {
  answer.blocked = answer.unsure = 0;
  const float* t = query.t;
  const Wide::F at = {t[0], t[1], t[2], t[3], t[4], t[5], t[6], t[7]};
  KernelBody<Wide>::Check(tables, segment, query, at, (1u << query.lanes) - 1, answer);
}

#pragma GCC pop_options

namespace {
void AddUnsure(KernelAnswer& answer, int part, int other, uint32_t lanes) {
  answer.pairs.push_back({part, other, lanes});
}
}  // namespace

bool HaveWideKernel() { return __builtin_cpu_supports("avx2") != 0; }

}  // namespace tether::motion::internal

#else

namespace tether::motion::internal {
void CheckSpheresWide(const KernelTables& tables, const KernelSegment& segment, const KernelQuery& query,
                      KernelAnswer& answer) {
  CheckSpheresPlain(tables, segment, query, answer);
}
bool HaveWideKernel() { return false; }
}  // namespace tether::motion::internal

#endif
