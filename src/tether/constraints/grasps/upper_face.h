#pragma once

#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "tether/constraints/core/context.h"
#include "tether/geometry/polygon/support.h"

namespace tether::constraints {

/// A face on which something can be put, in the frame of the solid that has it.
struct UpperFace {
  geometry::FlatFacet facet;
  int part =
      -1;  ///< Of a compound, the part that has it; −1: the highest face, over all parts that reach it.
  /// From there up to the nearest part of the same solid above some of it, m.
  double headroom = std::numeric_limits<double>::infinity();
  /// The hull of what several parts have at one height, most of it air: a bin's rim, two bars. What stands on
  /// it must bridge them.
  bool hollow = false;
  std::string name;  ///< "the top of shelf", "part 1 of shelf"
};

/// The highest face of a solid first, flat or not; then, from the top down, those of parts below it that are
/// level and have some room above. Where the highest is hollow, those of the parts that reach it follow too.
std::vector<UpperFace> UpperFaces(const std::string& name, const geometry::Shape& shape,
                                  const Eigen::Vector3d& up);

/// The same for a frame of the scene, computed once.
std::shared_ptr<const std::vector<UpperFace>> UpperFacesOf(const Context& context, FrameId name);

/// The face that carries a body whose lowest point is at this height over the solid's origin, m: the nearest.
const UpperFace& FaceAtHeight(const std::vector<UpperFace>& faces, double height);
/// The same of several at one height: the one below the body's centre of mass (in the solid's frame), else
/// the one that is the hull of all.
const UpperFace& FaceUnder(const std::vector<UpperFace>& faces, double height,
                           const Eigen::Vector3d& centre_of_mass);

/// Why nothing can be put on `name`: "ramp has no flat upper face: what is tilted or round carries nothing".
std::string NoUpperFace(const Context& context, FrameId name);
/// The same of what would be put down.
std::string NoLowerFace(const Context& context, FrameId name);

}  // namespace tether::constraints
