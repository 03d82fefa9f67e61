#pragma once

namespace tether::geometry {

/// The precision of geometry that people write: π as 1.5708, 1.571 or 3.142, lengths to 0.1 mm. Tests whether
/// *given* bodies are coplanar or level have this tolerance, and thresholds of angles are coarser than such
/// rounding, so that rounding never changes a result. (Computed values are compared more closely.)

/// Two lengths that are rounded to 0.1 mm differ by this at most, m.
inline constexpr double kInputLength = 1.5e-4;

}  // namespace tether::geometry
