#pragma once

#include <optional>
#include <string>

#include "tether/geometry/shape.h"
#include "tether/robot/model.h"

namespace tether::execution {

/// Tolerance between the measured width between the fingers and that of what they hold, m.
inline constexpr double kWidthTolerance = 0.005;

/// How far apart the pads are when they have closed on a body at X_HO in the hand's frame: its extent along
/// the closing axis (y) within the pads' area, m. None if nothing of it is between the open fingers there.
std::optional<double> WidthBetweenFingers(const geometry::Shape& shape, const math::Pose& X_HO,
                                          const robot::Gripper& gripper);

/// For fingers at rest `opening` (m) apart: what they closed on, if it is not that body: "nothing", or
/// "something 31.0 mm wide, not 50.0"; empty if it may be that body. The opening of fingers on hinges is
/// known to 1.5 cm only. `least_width`, m: closed further, they hold nothing.
std::string WrongWidth(double opening, const geometry::Shape& shape, const math::Pose& X_HO,
                       const robot::Gripper& gripper, double least_width);

}  // namespace tether::execution
