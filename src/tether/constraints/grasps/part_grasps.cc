#include "tether/constraints/grasps/part_grasps.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "tether/common/text.h"
#include "tether/constraints/grasps/opposite_sides.h"
#include "tether/geometry/hull/polytope.h"
#include "tether/geometry/polygon/polygon.h"
#include "tether/robot/gravity.h"
#include "tether/scene/friction.h"

namespace tether::constraints {
namespace {

using Eigen::Vector3d;
using geometry::Part;

// Room for the fingers to pass beside what they close on, both sides together, m.
constexpr double kOpeningSlack = 0.005;
// Without a robot model: a parallel gripper of common size.
constexpr double kDefaultOpening = 0.08;
constexpr double kDefaultPadHalfWidth = 0.01;
// Pads may reach below the object by this much before that is a reason: constraints are kept to tolerances,
// m.
constexpr double kLowSlack = 0.002;
// The reserve for accelerations of lifting and carrying, over what gravity needs.
constexpr double kWeightReserve = 1.25;

std::string Text(const char* format, auto... arguments) {
  char text[240];
  FormatInto(text, sizeof text, format, arguments...);
  return text;
}

/// Two numbers that are not the same, with as many decimals, from `decimals` on, as it takes to see that.
std::pair<std::string, std::string> Apart(double a, double b, int decimals) {
  std::string first, second;
  for (; decimals <= 6 && first == second; ++decimals) {
    first = Text("%.*f", decimals, a);
    second = Text("%.*f", decimals, b);
  }
  return {first, second};
}

/// A lower bound on the width of any grasp of the part, m: square to `approach_P` if that is the only
/// approach, else in any direction.
double LeastWidth(const geometry::Primitive& primitive, const Vector3d& approach_P, bool only_approach) {
  if (const auto* box = std::get_if<geometry::Box>(&primitive)) {
    double least = std::numeric_limits<double>::infinity();
    for (int i = 0; i < 3; ++i) {
      if (!only_approach || std::abs(approach_P[i]) < 0.9) least = std::min(least, box->size[i]);
    }
    return least;
  }
  if (const auto* sphere = std::get_if<geometry::Sphere>(&primitive)) return 2 * sphere->radius;
  if (const auto* capsule = std::get_if<geometry::Capsule>(&primitive)) return 2 * capsule->radius;
  if (const auto* cylinder = std::get_if<geometry::Cylinder>(&primitive)) {
    const bool upright = only_approach && std::abs(approach_P.z()) > 0.9;
    return upright ? 2 * cylinder->radius : std::min(2 * cylinder->radius, cylinder->length);
  }
  const geometry::Polytope& polytope = *std::get<geometry::Hull>(primitive).polytope;
  if (only_approach) {
    const Vector3d x = approach_P.unitOrthogonal(), y = approach_P.cross(x);
    std::vector<Eigen::Vector2d> points;
    for (const Vector3d& p : polytope.vertices) points.emplace_back(x.dot(p), y.dot(p));
    const geometry::Polygon outline = geometry::ConvexHull(std::move(points));
    double least = std::numeric_limits<double>::infinity();
    for (const geometry::HalfPlane& edge : geometry::EdgeHalfPlanes(outline)) {
      double width = 0;
      for (const Eigen::Vector2d& p : outline) width = std::max(width, edge.offset - edge.normal.dot(p));
      least = std::min(least, width);
    }
    return least;
  }
  // A ball inside of it.
  double radius = std::numeric_limits<double>::infinity();
  for (const geometry::Polytope::Face& face : polytope.faces)
    radius = std::min(radius, face.offset - face.normal.dot(polytope.centroid));
  return 2 * radius;
}

/// How far inside a part of this height the grasp point has to be, m.
double MarginIn(const Part& part, double margin, double height) {
  return std::holds_alternative<geometry::Hull>(part.primitive) ? 0 : std::min(margin, 0.25 * height);
}

std::vector<Grasp> ShapesOfGrasps(const Part& part, const Vector3d& approach_O, const Fingers& fingers) {
  std::vector<Grasp> grasps;
  Grasp grasp;
  grasp.approach_O = approach_O;
  if (std::holds_alternative<geometry::Hull>(part.primitive)) {
    for (OppositeSides& sides : FindOppositeSides(part, approach_O, fingers.pad_half_width)) {
      grasp.closing_O = sides.closing;
      grasp.width = sides.width;
      grasp.centre_O = sides.centre;
      grasp.bounds_O = std::move(sides.bounds);
      grasp.label = "fingers close on " + sides.name;
      grasps.push_back(grasp);
    }
    return grasps;
  }
  grasp.centre_O = part.X_SP.p;
  for (const ClosingDirection& direction :
       ClosingDirections(part.primitive, part.X_SP.R.transpose() * approach_O)) {
    grasp.closing_O.reset();
    if (direction.axis_P) grasp.closing_O = part.X_SP.R * *direction.axis_P;
    grasp.width = direction.width;
    grasp.label = std::string("fingers close along ") + direction.name;
    grasps.push_back(grasp);
  }
  return grasps;
}

}  // namespace

Fingers FingersOf(const robot::Model* robot) {
  if (robot == nullptr)
    return {kDefaultOpening - kOpeningSlack, kDefaultOpening, kDefaultPadHalfWidth, std::nullopt, 0, 0};
  const robot::Gripper& gripper = robot->gripper();
  const double opening = std::min(gripper.max_opening, gripper.max_width + kOpeningSlack);
  return {opening - kOpeningSlack, opening,           gripper.pad_half_width,
          gripper.pad_half_height, gripper.max_force, gripper.pad_friction};
}

double HeldMass(const Fingers& fingers, double force, double friction) {
  return 2 * scene::PairFriction(fingers.pad_friction, friction) * std::min(force, fingers.max_force) /
         (kWeightReserve * robot::kGravity);
}

void GraspFlaws::TooWide(double width, double least, const Fingers& fingers) {
  narrowest_ = std::min(narrowest_, width);
  widest_taken_ = fingers.widest;
  proved_ = proved_ && least > fingers.max_opening;
}

void GraspFlaws::TooLow(double height, double needed, bool proved) {
  highest_ = std::max(highest_, height);
  needed_ = needed;
  proved_ = proved_ && proved;
}

void GraspFlaws::TooHeavy(const Load& load, double held, bool proved) {
  mass_ = load.mass;
  held_ = held;
  force_ = *load.force;
  friction_ = load.friction;
  proved_ = proved_ && proved;
}

std::string GraspFlaws::Describe(const std::string& object) const {
  const char* name = object.c_str();
  if (mass_ >= 0) {
    const auto [mass, held] = Apart(mass_, held_, 2);
    return Text(
        "%s is too heavy for the grip: it weighs %s kg, and pads that press with %.0f N hold %s kg of what "
        "has a friction of %.2f",
        name, mass.c_str(), force_, held.c_str(), friction_);
  }
  if (highest_ >= 0) {
    const auto [height, needed] = Apart(1e3 * highest_, 1e3 * needed_, 1);
    return Text(
        "%s is too low to grasp: it is %s mm high, and the fingers' pads need %s mm to stay clear of what it "
        "lies on",
        name, height.c_str(), needed.c_str());
  }
  if (std::isfinite(narrowest_)) {
    const auto [width, widest] = Apart(100 * narrowest_, 100 * widest_taken_, 1);
    return Text("%s is %s cm wide where it is narrowest; the gripper grasps up to %s cm", name, width.c_str(),
                widest.c_str());
  }
  return "no two sides of " + object + " face each other across the fingers' approach";
}

std::vector<Grasp> GraspsOfPart(const geometry::Shape& shape, int index, const Vector3d& approach_O,
                                const Vector3d& down_O, const Fingers& fingers, const Load& load,
                                bool only_approach, GraspFlaws& flaws) {
  const Part& part = shape.parts[index];
  // From the lowest of the object to the highest grasp point that the part offers: for all closing directions
  // alike.
  const double height = PartSupport(part, -approach_O) + geometry::Support(shape, approach_O);
  const double needed = fingers.pad_half_height.value_or(0);
  const double margin = MarginIn(part, load.margin, height);
  if (height - margin < needed - kLowSlack) {
    flaws.TooLow(height, needed + margin, only_approach);
    return {};
  }
  const bool weighed = load.force && fingers.pad_half_height;
  const double held = weighed ? HeldMass(fingers, *load.force, load.friction) : 0;
  const auto too_heavy = [&](double closing_down) {
    // Friction need not hold the component of the weight along the closing direction.
    return weighed && load.mass * std::sqrt(std::max(0.0, 1 - closing_down * closing_down)) > held;
  };
  const double steepest = std::sqrt(std::max(0.0, 1 - std::pow(approach_O.dot(down_O), 2)));
  if (too_heavy(steepest)) {
    flaws.TooHeavy(load, held, only_approach);
    return {};
  }
  const auto least = [&] {
    return LeastWidth(part.primitive, part.X_SP.R.transpose() * approach_O, only_approach);
  };
  std::vector<Grasp> grasps = ShapesOfGrasps(part, approach_O, fingers);
  if (grasps.empty()) {
    const double width = least();
    if (width > fingers.max_opening) {
      flaws.TooWide(width, width, fingers);
    } else {
      flaws.NoSides();
    }
  }
  std::erase_if(grasps, [&](Grasp& grasp) {
    grasp.part = index;
    if (grasp.width > fingers.widest) {
      flaws.TooWide(grasp.width, least(), fingers);
      return true;
    }
    if (too_heavy(grasp.closing_O ? grasp.closing_O->dot(down_O) : 0)) {
      flaws.TooHeavy(load, held, false);
      return true;
    }
    return false;
  });
  return grasps;
}

}  // namespace tether::constraints
