#pragma once

#include <limits>

namespace tether::math {

/// What a least or greatest value begins with, and what bounds nothing.
inline constexpr double kInfinity = std::numeric_limits<double>::infinity();

}  // namespace tether::math
