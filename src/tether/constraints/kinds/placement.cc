#include "tether/constraints/kinds/placement.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include <Eigen/Geometry>

#include "tether/constraints/grasps/surface.h"
#include "tether/constraints/grasps/upper_face.h"
#include "tether/constraints/kinds/contact_patch.h"
#include "tether/constraints/kinds/known.h"
#include "tether/geometry/input_tolerance.h"
#include "tether/geometry/polygon/polygon.h"

namespace tether::constraints {
namespace {

using Eigen::Vector3d;
using geometry::FlatFacet;
using math::Pose;

// A footprint counts as fitting only with at least this much room, m.
constexpr double kLeastSlack = 5e-4;
// Polygons with more corners than kMostCorners stand for discs if their inscribed circle has this share of
// the radius of the circle about them, and get one row per edge of the other polygon.
constexpr double kRound = 0.97;
// Room that a hand needs above what it puts down, m; scores of faces where there is less, and of each face
// further down.
constexpr double kRoomForHand = 0.12;
constexpr double kNarrowScore = 0.5;
constexpr double kLowerScore = 0.05;
constexpr double kNextScore = 0.001;
// The centre of mass of what bridges several parts is this far inside of the contact, m.
constexpr double kBridge = 0.004;
// And inside of their hull by this share of its inscribed circle.
constexpr double kAcross = 0.8;
constexpr int kBridgeTurns = 24;
// Scores of faces: across several parts where the object is long enough; a face that its foot does not fit
// on; across parts that it hardly reaches.
constexpr double kAcrossScore = 0.25;
constexpr double kHollowScore = 0.3;

Demand FindDemand(const geometry::Shape& shape, const Placement& placement, double margin) {
  const FlatFacet &foot = placement.foot, &support = placement.support;
  Demand demand;
  // An object that bridges several parts does so about their middle; its yaw is left to the guess.
  if (placement.hollow) {
    demand.points_A = {geometry::CentreOfMass(shape)};
    demand.margin = kAcross * InradiusOf(support);
    return demand;
  }
  const auto fits = [&](double inset) {
    return geometry::FitsInside(foot.polygon, geometry::Shrink(support.polygon, inset)).has_value();
  };
  if (foot.points.size() >= 3 && fits(kLeastSlack)) {
    // Half of the room there is, so that the rows keep an interior.
    double low = kLeastSlack, high = 2 * margin;
    if (fits(high)) {
      low = high;
    } else {
      for (int i = 0; i < 12; ++i) {
        const double middle = 0.5 * (low + high);
        (fits(middle) ? low : high) = middle;
      }
    }
    demand.margin = std::min(margin, 0.5 * low);
    demand.whole_footprint = true;
    if (foot.points.size() > kMostCorners) {
      const Vector3d centre = CentroidOf(foot);
      double radius = 0;
      for (const Vector3d& vertex : foot.points) radius = std::max(radius, (vertex - centre).norm());
      if (InradiusOf(foot) > kRound * radius) {
        demand.points_A = {centre};
        demand.margin += radius;
        return demand;
      }
    }
    demand.points_A = foot.points;
    return demand;
  }
  // ERRATA A13: else the true centre of mass, at least the margin inside, and well inside of a small support.
  const double inradius = InradiusOf(support);
  demand.points_A = {geometry::CentreOfMass(shape)};
  demand.margin = std::min(std::max(margin, 0.6 * inradius), 0.9 * inradius);
  return demand;
}

double HeightOf(const geometry::Shape& shape, const Vector3d& down) {
  return geometry::Support(shape, down) + geometry::Support(shape, -down);
}

/// Whether some yaw exists at which the object, in the middle of a hollow face, is carried by the parts that
/// it touches.
bool Bridges(const Context& context, FrameId object, FrameId on, const UpperFace& face) {
  return *context.known().bridges.Get({object, on}, [&] {
    const geometry::Shape &a = *context.ShapeOf(object), &b = *context.ShapeOf(on);
    const Vector3d& up = face.facet.normal;
    const Vector3d down = context.DownFace(object);
    const Eigen::Matrix3d R = Eigen::Quaterniond::FromTwoVectors(down, -up).toRotationMatrix();
    for (int i = 0; i < kBridgeTurns; ++i) {
      Pose X_BA(math::ExpSO3(up * (2 * M_PI * i / kBridgeTurns)) * R, Vector3d::Zero());
      X_BA.p = CentroidOf(face.facet) - X_BA.R * geometry::CentreOfMass(a);
      const Eigen::Vector2d centre = face.facet.Project(X_BA * geometry::CentreOfMass(a));
      if (geometry::ContainmentMargin(ContactHull(a, down, X_BA, b, face.facet), centre) >= kBridge)
        return true;
    }
    return false;
  });
}

/// Which of several upper faces the object is put on at this step; those first where there is room above for
/// it and a hand, and none where it does not fit itself.
int ChooseFace(const Context& context, FrameId object, FrameId on, const std::vector<UpperFace>& faces) {
  const double height = HeightOf(*context.ShapeOf(object), context.DownFace(object));
  const double foot =
      InradiusOf(geometry::SupportPolygon(*context.ShapeOf(object), context.DownFace(object)));
  int level = 0;
  std::vector<int> which;
  std::vector<Option> options;
  for (size_t i = 0; i < faces.size(); ++i) {
    if (i > 0 && faces[i - 1].facet.offset > faces[i].facet.offset + geometry::kInputLength) ++level;
    if (faces[i].facet.points.size() < 3 || faces[i].headroom <= height) continue;
    const bool roomy = faces[i].headroom > height + kRoomForHand;
    which.push_back(static_cast<int>(i));
    const double hardly = !faces[i].hollow ? (InradiusOf(faces[i].facet) < foot ? kHollowScore : 0)
                          : Bridges(context, object, on, faces[i]) ? kAcrossScore
                                                                   : 2 * kHollowScore;
    options.push_back({"on " + faces[i].name, (roomy ? 0 : kNarrowScore) + hardly + kLowerScore * level +
                                                  kNextScore * static_cast<double>(i)});
  }
  if (which.empty()) return 0;
  std::vector<size_t> order(which.size());
  std::iota(order.begin(), order.end(), size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](size_t a, size_t b) { return options[a].score < options[b].score; });
  std::vector<Option> sorted;
  for (const size_t i : order) sorted.push_back(options[i]);
  const ChoiceKey key{ChoiceKey::Kind::kFace, object, on, context.step()};
  return which[order[ToIndex(context.Choose(key, sorted))]];
}

/// The face that carries the object before this step.
int PresentFace(const Context& context, FrameId object, FrameId on, const std::vector<UpperFace>& faces) {
  const int before = context.step() - 1;
  const Pose X_BA = math::Between(context.PoseAt({on, before}), context.PoseAt({object, before}));
  const Vector3d& up = faces.front().facet.normal;
  const double lowest =
      up.dot(X_BA.p) - geometry::Support(*context.ShapeOf(object), -(X_BA.R.transpose() * up));
  return static_cast<int>(&FaceUnder(faces, lowest, X_BA * geometry::CentreOfMass(*context.ShapeOf(object))) -
                          faces.data());
}

}  // namespace

std::shared_ptr<const Placement> FindPlacement(const Context& context, FrameId object, FrameId on) {
  const geometry::Shape* a = context.ShapeOf(object);
  const geometry::Shape* b = context.ShapeOf(on);
  if (a == nullptr || b == nullptr) return nullptr;
  int face = 0;
  if (b->is_compound()) {
    const auto faces = UpperFacesOf(context, on);
    if (faces->size() > 1) {
      face = context.control() == object && context.target() == on ? ChooseFace(context, object, on, *faces)
                                                                   : PresentFace(context, object, on, *faces);
    }
  }
  return context.known().placements.Get({object, on, face}, [&] {
    const auto foot = geometry::SupportPolygon(*a, context.DownFace(object));
    if (!b->is_compound())
      return Placement{foot, geometry::SupportPolygon(*b, -context.DownFace(on)), -1, false, {}};
    const UpperFace& chosen = (*UpperFacesOf(context, on))[ToIndex(face)];
    Placement placement{foot, chosen.facet, chosen.part, chosen.hollow, {}};
    for (const UpperFace& other : *UpperFacesOf(context, on)) {
      if (other.part >= 0 && std::abs(other.facet.offset - chosen.facet.offset) <= geometry::kInputLength)
        placement.level.push_back(other.part);
    }
    return placement;
  });
}

bool HasFaces(const Context& context, FrameId on) {
  const geometry::Shape* shape = context.ShapeOf(on);
  return shape != nullptr && shape->is_compound() && UpperFacesOf(context, on)->size() > 1;
}

std::shared_ptr<const Placement> FindFlatPlacement(const Context& context, FrameId object, FrameId on) {
  auto placement = FindPlacement(context, object, on);
  const bool flat = placement && placement->foot.points.size() >= 3 && placement->support.points.size() >= 3;
  return flat ? placement : nullptr;
}

std::shared_ptr<const Demand> DemandOf(const Context& context, FrameId object, FrameId by,
                                       const Placement& placement, double margin) {
  return context.known().demands.Get({object, by, placement.part, margin},
                                     [&] { return FindDemand(*context.ShapeOf(object), placement, margin); });
}

}  // namespace tether::constraints
