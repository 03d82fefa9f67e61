#pragma once

#include <algorithm>

namespace tether::scene {

/// The Coulomb coefficient between two surfaces: that of the slipperier one, so that a surface with a
/// friction of 0 slides on everything. Simulation and planner use the same rule.
inline double PairFriction(double a, double b) { return std::min(a, b); }

}  // namespace tether::scene
