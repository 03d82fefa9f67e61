#pragma once

namespace tether::geometry {

/// How exact geometry is that people write: π as 1.5708, 1.571 or 3.142, lengths to 0.1 mm. Whatever asks
/// whether *given* bodies are coplanar, parallel, level or upright asks it to within these, so that rounding
/// of that size never changes an answer. (What is computed is compared elsewhere, and more closely.)

/// Two lengths that are rounded to 0.1 mm differ by this at most, m.
inline constexpr double kInputLength = 1.5e-4;
/// An angle with three decimals, twice, rad.
inline constexpr double kInputAngle = 1e-3;

}  // namespace tether::geometry
