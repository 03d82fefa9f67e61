#pragma once

#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "tether/constraints/grasps/grasp.h"

namespace tether::constraints {

/// Dimensions and force of the fingers: the robot's, or without a robot those of a gripper of common size.
struct Fingers {
  double widest = 0;       ///< The widest that they can close on, with room beside it, m.
  double max_opening = 0;  ///< m
  double pad_half_width = 0;
  std::optional<double> pad_half_height;  ///< m; none without a robot.
  double max_force = 0;                   ///< N at each pad
  double pad_friction = 0;
};
/// Those of the robot's gripper; without a robot (null) those of a parallel gripper of common size.
Fingers FingersOf(const robot::Model* robot);

/// What the fingers have to hold, and with what force.
struct Load {
  double mass = 0;              ///< kg
  double friction = 0.8;        ///< Of its surface.
  std::optional<double> force;  ///< N at each pad; none: not known, and not asked for.
  double margin = 0;            ///< The grasp point is so far inside a part, m.
};

/// Gathers why the grasps of an object are excluded, to say why there is none.
class GraspFlaws {
 public:
  /// A width that does not fit between the fingers. `least` is a lower bound for all grasps of the part,
  /// tried or not.
  void TooWide(double width, double least, const Fingers& fingers);
  void TooLow(double height, double needed, bool proved);
  void TooHeavy(const Load& load, double held, bool proved);
  /// No two sides of a part face each other across the approach.
  void NoSides() { proved_ = false; }

  /// Why nothing can be held, in words: "a is 9.0 cm wide where it is narrowest; the gripper grasps up to 7.5
  /// cm".
  std::string Describe(const std::string& object) const;
  /// The reason holds for every grasp that the approach allows, not only for those that were tried.
  bool proved() const { return proved_; }

 private:
  double narrowest_ = std::numeric_limits<double>::infinity(), widest_taken_ = 0;
  double highest_ = -1, needed_ = 0;
  double mass_ = -1, held_ = 0, force_ = 0, friction_ = 0;
  bool proved_ = true;
};

/// The grasps of one part along an approach (unit, in the object's frame), unscored, that fit between the
/// fingers, whose pads don't reach below the object, and that hold its weight. Planner, checker and
/// executives all use it.
///
/// `down_O` is the direction of gravity in the object's frame. `only_approach`: no other approach is allowed,
/// so that a flaw may be a proof.
std::vector<Grasp> GraspsOfPart(const geometry::Shape& shape, int part, const Eigen::Vector3d& approach_O,
                                const Eigen::Vector3d& down_O, const Fingers& fingers, const Load& load,
                                bool only_approach, GraspFlaws& flaws);

/// The mass that two pads hold by friction while they close horizontally, with a reserve for accelerations,
/// kg.
double HeldMass(const Fingers& fingers, double force, double friction);

}  // namespace tether::constraints
