#pragma once

#include <string>

namespace tether::constraints {

/// Magnitudes as they are written in reasons: "12.3 mm" and "3.1 degrees".
std::string InMillimetres(double metres);
std::string InDegrees(double radians);

}  // namespace tether::constraints
