#pragma once

namespace tether {

/// Bounds of the numbers in documents. Numbers beyond are mistakes, and would make computations overflow or
/// never end: a robot's world is not larger, nor are its parts smaller.
inline constexpr double kGreatestNumber = 1e9;     ///< Of any number, in its unit.
inline constexpr double kSmallestPositive = 1e-9;  ///< Of any number that must be above zero.
inline constexpr double kSmallestLength = 1e-4;    ///< Of lengths above zero, m.
inline constexpr double kSmallestMass =
    1e-6;  ///< kg; with kSmallestLength, the least inertia that the simulation can handle.
inline constexpr double kGreatestLength = 1e4;  ///< Of lengths, m, and of the entries of vectors.

}  // namespace tether
