#pragma once

namespace tether {

/// Bounds of the numbers in documents. What lies beyond is a slip of the pen, and would overflow or never end
/// in what is computed from it: a robot's world is not larger, nor are its parts smaller.
inline constexpr double kGreatestNumber = 1e9;     ///< Of any number, in its unit.
inline constexpr double kSmallestPositive = 1e-9;  ///< Of any number that must be above zero.
inline constexpr double kSmallestLength = 1e-4;    ///< Of lengths above zero, m.
inline constexpr double kSmallestMass = 1e-6;      ///< kg; with kSmallestLength, what physics can still turn.
inline constexpr double kGreatestLength = 1e4;     ///< Of lengths, m, and of the entries of vectors.

}  // namespace tether
