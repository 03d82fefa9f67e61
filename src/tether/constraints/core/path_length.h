#pragma once

#include "tether/constraints/core/pose_function.h"

namespace tether::constraints {

/// A vector in the direction of f's value v whose square is the length of v, for costs that are sums of
/// squares: v / (‖v‖² + ε²)^¼ with ε = 1 mm (or mrad) of v's unit, which rounds the tip off at v = 0. Paper
/// A's eq. (4) with lengths in place of their squares.
PoseFunctionPtr MakeRootOfLength(PoseFunctionPtr f);

}  // namespace tether::constraints
