#include "tether/geometry/hull/hull_reader.h"

#include <cmath>
#include <filesystem>

#include "tether/common/text.h"
#include "tether/geometry/hull/mesh_file.h"
#include "tether/geometry/hull/polytope.h"

namespace tether::geometry {
namespace {

// A mesh that fills less of its hull than all but this share has hollows.
constexpr double kHollow = 0.02;
// A hull may fall short of its points by this share of its extent, where they have too many corners.
constexpr double kLeftOut = 0.01;

const char* const kPoints = "at least four points [x, y, z] that are not all in one plane, m";

geometry::Hull Substitute() { return *geometry::MakeHull({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}).hull; }

/// The hull of points, or a substitute after a report.
geometry::Hull Build(const std::vector<Eigen::Vector3d>& points, const Location& where,
                     const std::string& what, Diagnostics& diagnostics) {
  const geometry::HullResult made = geometry::MakeHull(points);
  if (!made.hull) {
    diagnostics.Add(where, "the points of " + what + " " + made.problem, kPoints);
    return Substitute();
  }
  if (made.left_out > kLeftOut * made.hull->polytope->radius) {
    char text[80];
    FormatInto(text, sizeof text, "; with %d it is up to %.2g m too small", geometry::kMaxHullVertices,
               made.left_out);
    diagnostics.Add(where, what + " has too many corners" + text,
                    "a hull that " + std::to_string(geometry::kMaxHullVertices) +
                        " corners describe to 1 % of its extent");
  }
  return *made.hull;
}

}  // namespace

geometry::Hull ReadHull(const Value& value, const std::string& what, Diagnostics& diagnostics) {
  if (!value.is_array()) {
    diagnostics.Add(value.where(), what + " is " + value.KindName(), kPoints);
    return Substitute();
  }
  std::vector<Eigen::Vector3d> points;
  for (const Value& item : value.items()) {
    const auto point = ReadVector(item, 3, "a point of " + what, diagnostics);
    if (!point) return Substitute();
    points.emplace_back(*point);
  }
  return Build(points, value.where(), what, diagnostics);
}

geometry::Hull ReadMeshHull(const Value& value, const MeshOptions& options, const std::string& folder,
                            const std::string& what, Diagnostics& diagnostics) {
  const std::string file = ReadText(value, what, diagnostics);
  if (file.empty()) return Substitute();
  geometry::Mesh mesh;
  try {
    mesh = geometry::ReadMesh((std::filesystem::path(folder) / file).string());
  } catch (const InputError& error) {
    // A missing file is reported at the line that names it; a mistake in a file at its own place.
    for (const Diagnostic& diagnostic : error.diagnostics()) {
      const bool inside = diagnostic.where.line > 0;
      diagnostics.Add(inside ? diagnostic.where : value.where(),
                      inside ? diagnostic.message : what + ", '" + file + "': " + diagnostic.message,
                      diagnostic.accepted);
    }
    return Substitute();
  }
  for (Eigen::Vector3d& p : mesh.points) p *= options.scale;
  const geometry::Hull hull = Build(mesh.points, value.where(), what + ", '" + file + "',", diagnostics);
  const double share = std::abs(geometry::EnclosedVolume(mesh)) / hull.polytope->volume;
  if (share < 1 - kHollow && !options.fill) {
    char text[64];
    FormatInto(text, sizeof text, "it fills %.0f %% of its hull", 100 * share);
    diagnostics.Add(value.where(), what + ", '" + file + "', is not convex: " + text,
                    "a closed convex mesh, a list of convex parts, or 'fill: true' to take the hull of it");
  }
  return hull;
}

}  // namespace tether::geometry
