#pragma once

namespace tether::constraints {

/// Weights of the cost of a plan, α and β of paper A, eq. (4): of the hand's travel, 1/m², and of its
/// turning, 1/rad². What a choice adds to the cost is scored by the same.
inline constexpr double kTravelWeight = 0.5;
inline constexpr double kTurnWeight = 1.5;

/// A constraint holds, as the independent checker measures it, within these: m, rad. A millimetre is what a
/// gripper and a tracker are good for; rows are kept to kRowShare of it.
inline constexpr double kFeasibleLength = 1e-3;
inline constexpr double kFeasibleAngle = 5e-3;
inline constexpr double kRowShare = 0.1;

}  // namespace tether::constraints
