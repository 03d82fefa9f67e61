#include "tether/motion/kernel/sphere_kernel.h"

#include <bit>
#include <cmath>

#include "tether/motion/kernel/sphere_kernel_body.h"

namespace tether::motion::internal {
namespace {

/// One float.
struct Plain {
  using F = float;
  using I = int32_t;
  static F Splat(float x) { return x; }
  static I One() { return 1; }
  static I Bits(F x) { return std::bit_cast<I>(x); }
  static I IsBitSet(I x, int bit) { return (x & bit) != 0 ? -1 : 0; }
  static I Less(F a, F b) { return a < b ? -1 : 0; }
  static F Select(I mask, F a, F b) { return mask != 0 ? a : b; }
  static F Max(F a, F b) { return a < b ? b : a; }
  static F Abs(F x) { return std::bit_cast<F>(std::bit_cast<I>(x) & 0x7fffffff); }
  static F Sqrt(F x) { return std::sqrt(x); }
  static uint32_t Mask(I mask) { return mask != 0 ? 0xffffffffu : 0; }
  static void Add(KernelAnswer& answer, int part, int other, uint32_t lanes) {
    answer.pairs.push_back({part, other, lanes});
  }
};

}  // namespace

void CheckSpheresPlain(const KernelTables& tables, const KernelSegment& segment, const KernelQuery& query,
                       KernelAnswer& answer) {
  answer.blocked = answer.unsure = 0;
  for (int i = 0; i < query.lanes && answer.blocked == 0; ++i)
    KernelBody<Plain>::Check(tables, segment, query, query.t[i], 1u << i, answer);
}

}  // namespace tether::motion::internal
