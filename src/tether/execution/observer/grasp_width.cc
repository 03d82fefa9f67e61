#include "tether/execution/observer/grasp_width.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "tether/common/text.h"
#include "tether/geometry/distance/query.h"

namespace tether::execution {
namespace {

using Eigen::Vector3d;

// Rays from each pad per direction, an odd number: one goes through the middle.
constexpr int kRays = 7;
// Where fingers turn on hinges, their tips' distance is known to this only, m.
constexpr double kHingedTolerance = 0.015;

}  // namespace

std::optional<double> WidthBetweenFingers(const geometry::Shape& shape, const math::Pose& X_HO,
                                          const robot::Gripper& gripper) {
  const double open = 0.5 * gripper.max_opening + 1e-3;
  double most = -std::numeric_limits<double>::infinity(), least = -most;
  for (int i = 0; i < kRays; ++i) {
    for (int k = 0; k < kRays; ++k) {
      const double x = gripper.pad_half_width * (2.0 * i / (kRays - 1) - 1);
      const double z = gripper.pad_half_height * (2.0 * k / (kRays - 1) - 1);
      for (const double side : {1.0, -1.0}) {
        const auto hit = geometry::CastRay(shape, X_HO, Vector3d(x, side * open, z), Vector3d(0, -side, 0),
                                           geometry::RayStart::kIgnore, 2 * open);
        if (!hit) continue;
        most = std::max(most, hit->p_W.y());
        least = std::min(least, hit->p_W.y());
      }
    }
  }
  if (most < least) return std::nullopt;
  return most - least;
}

std::string WrongWidth(double opening, const geometry::Shape& shape, const math::Pose& X_HO,
                       const robot::Gripper& gripper, double least_width) {
  if (opening < least_width) return "nothing";
  const auto width = WidthBetweenFingers(shape, X_HO, gripper);
  const double tolerance = gripper.hinged() ? kHingedTolerance : kWidthTolerance;
  if (width && std::abs(opening - *width) <= tolerance) return "";
  char text[80];
  if (width) {
    FormatInto(text, sizeof text, "something %.1f mm wide (not %.1f mm)", 1e3 * opening, 1e3 * *width);
  } else {
    FormatInto(text, sizeof text, "something else, %.1f mm wide", 1e3 * opening);
  }
  return text;
}

}  // namespace tether::execution
