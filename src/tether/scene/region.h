#pragma once

#include <map>
#include <string>
#include <vector>

#include "tether/geometry/polygon/polygon.h"
#include "tether/scene/scene.h"

namespace tether::scene {

/// How well an object fits in a region. Its footprint is its projection along the region's z axis; its foot
/// is its lowest point along that axis.
struct RegionFit {
  double outside = 0;  ///< How far the footprint reaches beyond the region's outline, m; negative: room left.
  double height = 0;  ///< How far the foot is from the region, m: from its plane, or from the solid's extent.

  /// The whole footprint is in the region (to 1 mm) and the foot stands there (to 1 cm).
  bool Holds() const { return outside <= kOutlineTolerance && height <= kHeightTolerance; }

  static constexpr double kOutlineTolerance = 1e-3;  // m
  static constexpr double kHeightTolerance = 1e-2;   // m
};

/// The fit of a body with `shape` at X_WO in a region at X_WR. The outline of a solid region is its
/// projection on its frame's xy plane.
RegionFit FitRegion(const RegionForm& form, const math::Pose& X_WR, const geometry::Shape& shape,
                    const math::Pose& X_WO);

/// The outline in the region's xy plane; of a round one the regular 64-gon around it.
geometry::Polygon OutlinePolygon(const RegionForm& form);

/// The area within a region's outline, m².
double OutlineArea(const RegionForm& form);

/// A region's pose in the world when objects are at `X_WO`: it moves with the object that it is attached to,
/// directly or over other regions.
math::Pose RegionPose(const Scene& scene, const std::map<std::string, math::Pose>& X_WO,
                      const Region& region);

/// The regions that the object is in, when objects are at `X_WO`: in(object, region). Without hubs and
/// regions attached to the object itself. Where they overlap, the smallest comes first.
std::vector<const Region*> FindRegionsOf(const Scene& scene, const std::map<std::string, math::Pose>& X_WO,
                                         const Object& object);

/// in(object, area): whether the object is in that region, or in one of that group.
bool IsIn(const Scene& scene, const std::map<std::string, math::Pose>& X_WO, const Object& object,
          const std::string& area);

}  // namespace tether::scene
