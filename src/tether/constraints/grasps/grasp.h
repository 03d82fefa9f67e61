#pragma once

#include <optional>
#include <string>
#include <vector>

#include "tether/constraints/core/context.h"
#include "tether/constraints/grasps/surface.h"

namespace tether::constraints {

/// A grasp candidate of two parallel fingers: which part they close on, from which approach, along which of
/// the part's directions.
struct Grasp {
  int part = 0;
  Eigen::Vector3d approach_O;                ///< Unit, in the object's frame: the hand's z axis.
  std::optional<Eigen::Vector3d> closing_O;  ///< Unit, in the object's frame: ± the hand's y axis. None: any.
  double width = 0;                          ///< Between the fingers, m.
  Eigen::Vector3d centre_O = Eigen::Vector3d::Zero();  ///< Where the hand is best, in the object's frame.
  std::vector<FaceEdge>
      bounds_O;  ///< Where the fingers meet flat sides: normal · p ≤ offset. Empty: anywhere.
  std::string label;
  double score = 0;  ///< Lower is better: little turning, fingers clear, within reach, narrow.
};

/// A direction of a part, in its own frame P, along which parallel fingers can close on it.
struct ClosingDirection {
  std::optional<Eigen::Vector3d> axis_P;  ///< Unit, of either sign. None: any across the approach.
  double width = 0;                       ///< Between the fingers, m.
  const char* name = "";
};

/// The closing directions for an approach along the unit vector `approach_P`, in the part's frame; empty if
/// there are none, and for hulls (see FindOppositeSides).
std::vector<ClosingDirection> ClosingDirections(const geometry::Primitive& primitive,
                                                const Eigen::Vector3d& approach_P);

class GraspFlaws;

/// The grasp candidates, best first. Where there are none, `flaws`, if given, says why.
std::vector<Grasp> FindGrasps(const Context& context, FrameId object, GraspFlaws* flaws = nullptr);

/// The grasp chosen for this step and object, shared by all constraints of the step; none if there is none.
std::optional<Grasp> ChosenGrasp(const Context& context, FrameId object);

/// The part of ChosenGrasp, or the first part when nothing can be grasped.
int GraspedPart(const Context& context, FrameId object);

}  // namespace tether::constraints
