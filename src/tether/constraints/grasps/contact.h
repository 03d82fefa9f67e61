#pragma once

#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "tether/constraints/core/context.h"
#include "tether/constraints/grasps/surface.h"

namespace tether::constraints {

/// A candidate contact of a tool with the side of an object: which side, with which part of the tool.
/// Directions are unit vectors.
struct Contact {
  Eigen::Vector3d normal_B;  ///< Outward normal of the object's side, in the object's frame; level.
  double offset_B = 0;       ///< normal · x on that side, m.
  /// Heights over the object's origin between which the side can be pressed, m.
  double lowest_B = -std::numeric_limits<double>::infinity();
  double highest_B = std::numeric_limits<double>::infinity();
  int tool_part = 0;
  Eigen::Vector3d centre_A =
      Eigen::Vector3d::Zero();  ///< In the tool, straight behind the middle of the contact.
  double tool_depth = 0;        ///< From there to the contact, m.
  /// In the tool's frame, square to its down face. A line of contact (a lying capsule): along it. A face: its
  /// outward normal. None: a point of contact (a sphere, or something round standing upright).
  enum class Form { kPoint, kLine, kFace } form = Form::kPoint;
  Eigen::Vector3d direction_A = Eigen::Vector3d::Zero();
  /// Half the width and height of what of the tool is in contact: level and across the push, and upwards, m.
  double half_width = 0, half_height = 0;
  /// Where the side is: along up × normal, and upwards, m from the object's origin.
  Extent reach_B{0, 0}, heights_B{0, 0};
  std::string label;
  double score = 0;
};

/// The contacts of `tool` with a side of `object` at `step`, best first: pushing from there moves the object
/// towards the robot, or else towards the world's origin.
std::vector<Contact> FindContacts(const Context& context, FrameId tool, FrameId object, int step);

/// The contact chosen for that step, shared by all constraints on it.
std::optional<Contact> ChosenContact(const Context& context, FrameId tool, FrameId object, int step);

}  // namespace tether::constraints
