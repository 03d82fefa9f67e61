#include "tether/geometry/hull/mesh_file.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <sstream>

#include <Eigen/Geometry>

#include "tether/common/error.h"
#include "tether/common/file.h"
#include "tether/common/text.h"

namespace tether::geometry {
namespace {

using Eigen::Vector3d;

[[noreturn]] void Refuse(const std::string& path, int line, const std::string& message,
                         const std::string& accepted) {
  throw InputError({{{path, line, line > 0 ? 1 : 0}, message, accepted}});
}

std::string Ending(const std::string& path) {
  const size_t dot = path.rfind('.');
  return LowerCase(dot == std::string::npos ? "" : path.substr(dot + 1));
}

/// Three finite numbers from the words of a line.
Vector3d ReadPoint(std::istringstream& words, const std::string& path, int line, const std::string& text) {
  Vector3d p;
  for (int i = 0; i < 3; ++i) {
    std::string word;
    words >> word;
    if (!ParseNumber(word, &p[i]) || !std::isfinite(p[i])) {
      Refuse(path, line, "'" + text.substr(0, 60) + "' is not a point", "three finite numbers");
    }
  }
  return p;
}

Mesh ReadObj(const std::string& text, const std::string& path) {
  Mesh mesh;
  std::istringstream lines(text);
  std::string line;
  for (int number = 1; std::getline(lines, line); ++number) {
    std::istringstream words(line);
    std::string keyword;
    words >> keyword;
    if (keyword == "v") mesh.points.push_back(ReadPoint(words, path, number, line));
    if (keyword != "f") continue;
    std::vector<int> corners;
    for (std::string word; words >> word;) {
      // index, index/texture, index/texture/normal or index//normal; negative ones count from the end
      char* end = nullptr;
      const long index = std::strtol(word.c_str(), &end, 10);
      const long count = static_cast<long>(mesh.points.size());
      const long corner = index < 0 ? count + index : index - 1;
      if (end == word.c_str() || (*end != '\0' && *end != '/') || corner < 0 || corner >= count) {
        Refuse(path, number, "the face has the corner '" + word + "'",
               "1 to " + std::to_string(count) + ", the points above it");
      }
      corners.push_back(static_cast<int>(corner));
    }
    if (corners.size() < 3) Refuse(path, number, "the face has fewer than three corners", "three or more");
    for (size_t i = 1; i + 1 < corners.size(); ++i) {
      mesh.triangles.emplace_back(corners[0], corners[i], corners[i + 1]);
    }
  }
  return mesh;
}

void AddTriangle(const Vector3d& a, const Vector3d& b, const Vector3d& c, Mesh* mesh) {
  const int first = static_cast<int>(mesh->points.size());
  mesh->points.insert(mesh->points.end(), {a, b, c});
  mesh->triangles.emplace_back(first, first + 1, first + 2);
}

/// A header of 80 bytes, a count, and per triangle twelve single-precision numbers and two bytes.
Mesh ReadBinaryStl(const std::string& bytes, uint32_t count, const std::string& path) {
  Mesh mesh;
  for (uint32_t t = 0; t < count; ++t) {
    std::array<float, 12> numbers;
    std::memcpy(numbers.data(), bytes.data() + 84 + 50 * size_t{t}, sizeof numbers);
    std::array<Vector3d, 3> p;
    for (size_t k = 0; k < 3; ++k) {
      p[k] = Vector3d(numbers[3 + 3 * k], numbers[4 + 3 * k], numbers[5 + 3 * k]);
      if (!p[k].allFinite()) {
        Refuse(path, 0, "triangle " + std::to_string(t + 1) + " has a corner that is not finite",
               "finite numbers");
      }
    }
    AddTriangle(p[0], p[1], p[2], &mesh);
  }
  return mesh;
}

Mesh ReadStl(const std::string& text, const std::string& path) {
  uint32_t count = 0;
  if (text.size() >= 84) std::memcpy(&count, text.data() + 80, sizeof count);
  if (text.size() >= 84 && text.size() == 84 + 50 * size_t{count}) return ReadBinaryStl(text, count, path);
  if (text.rfind("solid", 0) != 0) {
    Refuse(path, 0, "this is not an STL file",
           "text that begins with 'solid', or a binary file as long as its number of triangles says");
  }
  Mesh mesh;
  std::istringstream lines(text);
  std::string line;
  std::vector<Vector3d> corners;
  for (int number = 1; std::getline(lines, line); ++number) {
    std::istringstream words(line);
    std::string keyword;
    words >> keyword;
    if (keyword == "outer") corners.clear();
    if (keyword == "vertex") corners.push_back(ReadPoint(words, path, number, line));
    if (keyword != "endloop") continue;
    if (corners.size() != 3) {
      Refuse(path, number, "the loop has " + std::to_string(corners.size()) + " vertices", "three");
    }
    AddTriangle(corners[0], corners[1], corners[2], &mesh);
  }
  return mesh;
}

}  // namespace

Mesh ReadMesh(const std::string& path) {
  const std::string ending = Ending(path);
  if (ending != "obj" && ending != "stl") {
    Refuse(path, 0, "a mesh file can't end with '." + ending + "'", "a file that ends with .obj or .stl");
  }
  const std::string text = ReadFile(path);
  Mesh mesh = ending == "obj" ? ReadObj(text, path) : ReadStl(text, path);
  if (mesh.triangles.empty()) Refuse(path, 0, "the mesh file has no triangles", "at least four");
  return mesh;
}

double EnclosedVolume(const Mesh& mesh) {
  double volume = 0;
  for (const Eigen::Vector3i& t : mesh.triangles) {
    // From one corner of the mesh, which keeps the digits where it stands far from its origin.
    const Vector3d& o = mesh.points[0];
    volume += (mesh.points[t[0]] - o).dot((mesh.points[t[1]] - o).cross(mesh.points[t[2]] - o)) / 6;
  }
  return volume;
}

}  // namespace tether::geometry
