#pragma once

#include <string>

#include "tether/common/document/reader.h"
#include "tether/geometry/shape.h"

namespace tether::geometry {

/// Reads `hull: [[x, y, z], ...]`: the convex hull of the points, m. After a mistake, which is reported, any
/// hull.
geometry::Hull ReadHull(const Value& value, const std::string& what, Diagnostics& diagnostics);

/// Options of `mesh: FILE`.
struct MeshOptions {
  double scale = 1;   ///< m per unit of the file.
  bool fill = false;  ///< Whether the hull of a mesh with hollows is accepted in its place.
};

/// Reads `mesh: FILE`, the convex hull of an OBJ or STL file. Relative paths start from `folder`.
geometry::Hull ReadMeshHull(const Value& value, const MeshOptions& options, const std::string& folder,
                            const std::string& what, Diagnostics& diagnostics);

}  // namespace tether::geometry
