#include "tether/constraints/grasps/upper_face.h"

#include <algorithm>
#include <cmath>

#include "tether/constraints/grasps/surface.h"
#include "tether/constraints/kinds/contact_patch.h"
#include "tether/constraints/kinds/known.h"
#include "tether/geometry/input_tolerance.h"
#include "tether/geometry/polygon/polygon.h"

namespace tether::constraints {
namespace {

using Eigen::Vector3d;
using geometry::FlatFacet;
using geometry::Part;

// A face without this much room above is inside of something, m.
constexpr double kLeastRoom = 0.01;
// Faces with a smaller inscribed circle are edges, m.
constexpr double kLeastRadius = 1e-3;
// Several patches that fill this share of their hull are one face, as are boards side by side.
constexpr double kFilled = 0.97;
// A face this far from level is tilted, rad.
constexpr double kTilted = 0.02;

/// Of a part's outline along the face's normal, what lies over the face.
geometry::Polygon Over(const FlatFacet& face, const Part& part) {
  constexpr int kDirections = 32;
  std::vector<Eigen::Vector2d> points;
  for (int i = 0; i < kDirections; ++i) {
    const double angle = 2 * M_PI * i / kDirections;
    const Vector3d d = std::cos(angle) * face.axis_x + std::sin(angle) * face.axis_y;
    points.push_back(
        face.Project(part.X_SP * geometry::SupportPoint(part.primitive, part.X_SP.R.transpose() * d)));
  }
  geometry::Polygon common = geometry::ConvexHull(std::move(points));
  for (const geometry::HalfPlane& edge : geometry::EdgeHalfPlanes(face.polygon))
    common = geometry::Cut(common, edge);
  return common;
}

}  // namespace

std::vector<UpperFace> UpperFaces(const std::string& name, const geometry::Shape& shape, const Vector3d& up) {
  std::vector<UpperFace> faces;
  faces.push_back({geometry::SupportPolygon(shape, up), -1, std::numeric_limits<double>::infinity(), false,
                   shape.is_compound() ? "the top of " + name : name});
  if (!shape.is_compound()) return faces;
  const bool hollow = FilledShare(shape, faces.front().facet) < kFilled;
  faces.front().hollow = hollow;
  const double top = faces.front().facet.offset;
  for (size_t i = 0; i < shape.parts.size(); ++i) {
    UpperFace face;
    face.facet = geometry::SupportPolygon(geometry::Shape(std::vector<Part>{shape.parts[i]}), up);
    face.part = static_cast<int>(i);
    face.name = "part " + std::to_string(i + 1) + " of " + name;
    const double height = face.facet.offset;
    if (face.facet.points.size() < 3 || (!hollow && height > top - kLeastRoom)) continue;
    if (InradiusOf(face.facet) < kLeastRadius) continue;
    bool covered = false;
    for (size_t j = 0; j < shape.parts.size() && !covered; ++j) {
      const Part& other = shape.parts[j];
      if (j == i || PartSupport(other, up) <= height + geometry::kInputLength) continue;
      const geometry::Polygon over = Over(face.facet, other);
      if (over.size() < 3 || geometry::Area(over) < 1e-6) continue;
      const double room = -PartSupport(other, -up) - height;
      // Parts that stand on the face cover some of it; parts above it bound the headroom.
      if (room > kLeastRoom) {
        face.headroom = std::min(face.headroom, room);
      } else {
        covered = geometry::Area(over) > 0.9 * geometry::Area(face.facet.polygon);
      }
    }
    if (!covered) faces.push_back(std::move(face));
  }
  std::stable_sort(faces.begin() + 1, faces.end(), [](const UpperFace& a, const UpperFace& b) {
    return a.facet.offset > b.facet.offset + geometry::kInputLength;
  });
  return faces;
}

std::shared_ptr<const std::vector<UpperFace>> UpperFacesOf(const Context& context, FrameId name) {
  return context.known().upper_faces.Get(
      name, [&] { return UpperFaces(context.Name(name), *context.ShapeOf(name), -context.DownFace(name)); });
}

const UpperFace& FaceAtHeight(const std::vector<UpperFace>& faces, double height) {
  return *std::min_element(faces.begin(), faces.end(), [&](const UpperFace& a, const UpperFace& b) {
    return std::abs(a.facet.offset - height) < std::abs(b.facet.offset - height) - 1e-9;
  });
}

const UpperFace& FaceUnder(const std::vector<UpperFace>& faces, double height,
                           const Vector3d& centre_of_mass) {
  const UpperFace& nearest = FaceAtHeight(faces, height);
  const UpperFace* best = &nearest;
  double best_inside = 0;
  for (const UpperFace& face : faces) {
    if (face.hollow || std::abs(face.facet.offset - nearest.facet.offset) > geometry::kInputLength) continue;
    const double inside = geometry::ContainmentMargin(face.facet.polygon, face.facet.Project(centre_of_mass));
    if (inside <= best_inside) continue;
    best = &face;
    best_inside = inside;
  }
  return *best;
}

namespace {

/// "stands tilted" or "is round where it would carry something".
std::string WhyNotFlat(const Context& context, FrameId name, const Vector3d& direction) {
  const geometry::Shape& shape = *context.ShapeOf(name);
  for (const geometry::FlatFacet& face : geometry::RestingFaces(shape, geometry::CentreOfMass(shape))) {
    const double angle = std::acos(std::clamp(face.normal.dot(direction.normalized()), -1.0, 1.0));
    if (angle < 0.25 * M_PI && angle > kTilted)
      return ": it is tilted by " + std::to_string(std::lround(angle * 180 / M_PI)) + " degrees";
  }
  return ": it is round or an edge there";
}

}  // namespace

std::string NoUpperFace(const Context& context, FrameId name) {
  return context.Name(name) + " has no flat upper face" + WhyNotFlat(context, name, -context.DownFace(name));
}

std::string NoLowerFace(const Context& context, FrameId name) {
  return context.Name(name) + " has no flat lower face to rest on" +
         WhyNotFlat(context, name, context.DownFace(name));
}

}  // namespace tether::constraints
