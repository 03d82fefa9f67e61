// Standard headers come first: what they define must not be compiled for a larger instruction set.
#include <cmath>

#include "tether/qp/active_set.h"

#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
#pragma GCC target("avx2")
#define TETHER_QP_KERNEL avx2
#define TETHER_QP_LANES 4
#include "tether/qp/active_set_kernel.h"
#endif
