#pragma once

#include <memory>
#include <string>
#include <vector>

#include "tether/constraints/core/context.h"
#include "tether/geometry/polygon/support.h"

namespace tether::constraints {

/// How much of `object` must be over the support: its whole footprint where that fits, else its centre of
/// mass.
struct Demand {
  std::vector<Eigen::Vector3d> points_A;  ///< Points of the object that must be over the support …
  double margin = 0;                      ///< … by this much, m.
  bool whole_footprint = false;
};

/// Where one thing rests on another.
struct Placement {
  geometry::FlatFacet foot;     ///< Of the object, in its frame.
  geometry::FlatFacet support;  ///< Of what it stands on, in that frame.
  int part = -1;                ///< Of what it stands on, as in UpperFace.
  bool hollow = false;          ///< As in UpperFace.
  std::vector<int> level;       ///< The other parts at that height, which may be touched too.
};

/// Where `object` rests on `on`: on the face chosen at this step if it is put down at it, else on the face
/// that it was on before. Null if one of the two is not solid.
std::shared_ptr<const Placement> FindPlacement(const Context& context, FrameId object, FrameId on);
/// The same, but null too if a face there is not flat.
std::shared_ptr<const Placement> FindFlatPlacement(const Context& context, FrameId object, FrameId on);
/// `on` has several faces to put something on: which is a choice.
bool HasFaces(const Context& context, FrameId on);

/// The demand on where `object` stands on its support, with the margin asked for, m: less where a footprint
/// has less room (ERRATA A13).
std::shared_ptr<const Demand> DemandOf(const Context& context, FrameId object, FrameId by,
                                       const Placement& placement, double margin);

/// Polygons with more corners than this may stand for discs.
inline constexpr size_t kMostCorners = 8;

}  // namespace tether::constraints
