#pragma once

#include <memory>
#include <string>
#include <vector>

#include "tether/geometry/shape.h"
#include "tether/math/pose.h"
#include "tether/robot/kinematics.h"
#include "tether/robot/model.h"

namespace tether::control {

/// A pose with its velocity: (velocity of the origin; angular velocity), both in the frame the pose is in.
struct MovingPose {
  math::Pose X;
  math::Vector6d V = math::Vector6d::Zero();
  bool seen = true;  ///< False: it has not been seen for long, and this is where it was last.
};

/// A solid that isn't the arm's.
struct Solid {
  std::string name;
  geometry::Shape shape;
  bool movable = false;
};

/// The convex parts of everything that may collide, with their poses in the arm's base frame B at this tick.
/// Bodies are numbered: the links' solids as in robot::ArmSolids, the hand, then the objects. Allocates
/// nothing after construction.
class ArmBodies {
 public:
  /// The bodies are those of the model, and `objects` in their order.
  ArmBodies(std::shared_ptr<const robot::Model> model, const std::vector<Solid>& objects);

  struct Part {
    geometry::Primitive primitive;
    math::Pose X_FP;    ///< In its body's frame.
    double radius = 0;  ///< Of a ball about its frame's origin that holds it, m.
    math::Pose X_BP;    ///< Now.
  };

  int num_bodies() const { return static_cast<int>(bodies_.size()); }
  int hand() const { return hand_; }
  int object(int index) const { return hand_ + 1 + index; }
  const std::string& name(int body) const { return at(body).name; }
  bool is_object(int body) const { return body > hand_; }
  /// The link that carries a body; 0: none, it moves on its own.
  int link(int body) const { return at(body).link; }
  const MovingPose& pose(int body) const { return at(body).pose; }
  /// The most parts a body may have.
  int max_parts(int body) const { return at(body).num_parts; }
  const Part* begin(int body) const { return parts_.data() + at(body).first_part; }
  const Part* end(int body) const { return begin(body) + at(body).num_parts; }

  /// From now on the object moves with the hand; its pose is still set by Place().
  void Hold(int object);
  void Release();
  int held() const { return held_; }  ///< Index of the object in the hand; −1: none.

  /// Where the arm is and how far its hand is open (m).
  void PlaceArm(const robot::Kinematics& kinematics, double opening);
  /// Where an object is, in the base frame.
  void Place(int object, const MovingPose& X_BO);

  /// A lower bound of the distance of two parts, m: exact to the parts' bounding balls.
  static double LowerBound(const Part& a, const Part& b);

 private:
  struct Body {
    std::string name;
    int link = 0;
    int first_part = 0;
    int num_parts = 0;
    MovingPose pose;
  };
  const Body& at(int body) const { return bodies_[static_cast<size_t>(body)]; }
  void AddParts(const geometry::Shape& shape);
  void PlaceParts(const Body& body);

  std::shared_ptr<const robot::Model> model_;
  std::vector<Body> bodies_;
  std::vector<Part> parts_;
  std::vector<int> hand_parts_;  ///< First part of the hand's solid, by opening.
  int hand_ = 0;
  int held_ = -1;
};

}  // namespace tether::control
