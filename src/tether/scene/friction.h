#pragma once

#include <algorithm>

namespace tether::scene {

/// The Coulomb coefficient with which two surfaces hold each other: that of the slipperier one, so that what
/// has a friction of 0 slides on everything. The rule of the simulation and of the planner alike.
inline double PairFriction(double a, double b) { return std::min(a, b); }

}  // namespace tether::scene
