#pragma once

namespace tether::geometry {

/// How exact geometry is that people write: π as 1.5708, 1.571 or 3.142, lengths to 0.1 mm. Whatever asks
/// whether *given* bodies are coplanar or level asks it to within this, and thresholds of angles are coarser
/// than such rounding, so that it never changes an answer. (What is computed is compared elsewhere, and more
/// closely.)

/// Two lengths that are rounded to 0.1 mm differ by this at most, m.
inline constexpr double kInputLength = 1.5e-4;

}  // namespace tether::geometry
