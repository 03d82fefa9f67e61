#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

namespace tether::geometry {

/// The triangles of a mesh file, in the file's unit.
struct Mesh {
  std::vector<Eigen::Vector3d> points;
  std::vector<Eigen::Vector3i> triangles;  ///< Indices of points, counter-clockwise seen from outside.
};

/// Reads a Wavefront OBJ file (`v` and `f` lines; polygons are cut into triangles; materials, normals and
/// texture coordinates are passed over) or an STL file, binary or text, by its ending. Throws InputError with
/// the file and, in a text, the line: for a file that can't be read, has no triangles, numbers that are not
/// finite, or faces of points that are not there.
Mesh ReadMesh(const std::string& path);

/// The volume that the triangles enclose, m³ for points in m: meaningful for closed surfaces, negative if
/// they are inside out.
double EnclosedVolume(const Mesh& mesh);

}  // namespace tether::geometry
