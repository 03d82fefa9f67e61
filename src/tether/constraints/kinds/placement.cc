#include "tether/constraints/kinds/placement.h"

#include <algorithm>
#include <numeric>

#include "tether/constraints/grasps/surface.h"
#include "tether/constraints/grasps/upper_face.h"
#include "tether/geometry/input_tolerance.h"
#include "tether/geometry/polygon/polygon.h"

namespace tether::constraints {
namespace {

using Eigen::Vector3d;
using geometry::FlatFacet;
using math::Pose;

// A footprint that fits with less room than this is not asked to fit, m.
constexpr double kLeastSlack = 5e-4;
// Polygons with more corners than kMostCorners stand for discs if their inscribed circle has this share of
// the radius of the circle about them, and get one row per edge of the other polygon.
constexpr double kRound = 0.97;
// Room that a hand needs above what it puts down, m; scores of faces where there is less, and of each face
// further down.
constexpr double kRoomForHand = 0.12;
constexpr double kNarrowScore = 0.5;
constexpr double kLowerScore = 0.05;
// A top of which the parts that reach it make up less than this share is a rim or a few posts …
constexpr double kSolidShare = 0.75;
// … where hardly anything stands.
constexpr double kHollowScore = 0.3;

Demand FindDemand(const geometry::Shape& shape, const FlatFacet& foot, const FlatFacet& support,
                  double margin) {
  Demand demand;
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

/// The top of a compound is mostly air, as a bin's rim is.
bool IsHollow(const Context& context, const std::string& on, const UpperFace& top) {
  return *context.memo().Get<bool>("hollow(" + on + ")", [&] {
    double covered = 0;
    for (const geometry::Part& part : context.ShapeOf(on)->parts) {
      const geometry::Shape alone(std::vector<geometry::Part>{part});
      const FlatFacet facet = geometry::SupportPolygon(alone, top.facet.normal);
      if (facet.points.size() >= 3 && facet.offset > top.facet.offset - geometry::kInputLength)
        covered += geometry::Area(facet.polygon);
    }
    return covered < kSolidShare * geometry::Area(top.facet.polygon);
  });
}

/// Which of several upper faces the object is put on at this step; those first where there is room above for
/// it and a hand, and none where it does not fit itself.
int ChooseFace(const Context& context, const std::string& object, const std::string& on,
               const std::vector<UpperFace>& faces) {
  const double height = HeightOf(*context.ShapeOf(object), context.DownFace(object));
  std::vector<int> which;
  std::vector<Option> options;
  for (size_t i = 0; i < faces.size(); ++i) {
    if (faces[i].facet.points.size() < 3 || faces[i].headroom <= height) continue;
    const bool roomy = faces[i].headroom > height + kRoomForHand;
    which.push_back(static_cast<int>(i));
    const bool hollow = faces[i].part < 0 && IsHollow(context, on, faces[i]);
    options.push_back({"on " + faces[i].name, (roomy ? 0 : kNarrowScore) + (hollow ? kHollowScore : 0) +
                                                  kLowerScore * static_cast<double>(i)});
  }
  if (which.empty()) return 0;
  std::vector<size_t> order(which.size());
  std::iota(order.begin(), order.end(), size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](size_t a, size_t b) { return options[a].score < options[b].score; });
  std::vector<Option> sorted;
  for (const size_t i : order) sorted.push_back(options[i]);
  const std::string key = "face(" + object + "," + on + ")@" + std::to_string(context.step());
  return which[order[static_cast<size_t>(context.Choose(key, sorted))]];
}

/// The face of what carries the object that it is on before this step.
int PresentFace(const Context& context, const std::string& object, const std::string& on,
                const std::vector<UpperFace>& faces) {
  const int before = context.step() - 1;
  const Pose X_BA = math::Between(context.PoseAt({on, before}), context.PoseAt({object, before}));
  const Vector3d& up = faces.front().facet.normal;
  const double lowest =
      up.dot(X_BA.p) - geometry::Support(*context.ShapeOf(object), -(X_BA.R.transpose() * up));
  return static_cast<int>(&FaceAtHeight(faces, lowest) - faces.data());
}

}  // namespace

std::shared_ptr<const Placement> FindPlacement(const Context& context, const std::string& object,
                                               const std::string& on) {
  const geometry::Shape* a = context.ShapeOf(object);
  const geometry::Shape* b = context.ShapeOf(on);
  if (a == nullptr || b == nullptr) return nullptr;
  std::string key = "placement(" + object + "," + on + ")";
  int face = 0;
  if (b->is_compound()) {
    const auto faces = UpperFacesOf(context, on);
    if (faces->size() > 1) {
      face = context.control() == object && context.target() == on ? ChooseFace(context, object, on, *faces)
                                                                   : PresentFace(context, object, on, *faces);
      key += std::to_string(face);
    }
  }
  return context.memo().Get<Placement>(key, [&] {
    const auto foot = geometry::SupportPolygon(*a, context.DownFace(object));
    if (!b->is_compound()) return Placement{foot, geometry::SupportPolygon(*b, -context.DownFace(on))};
    const UpperFace& chosen = (*UpperFacesOf(context, on))[static_cast<size_t>(face)];
    return Placement{foot, chosen.facet, chosen.part};
  });
}

bool HasFaces(const Context& context, const std::string& on) {
  const geometry::Shape* shape = context.ShapeOf(on);
  return shape != nullptr && shape->is_compound() && UpperFacesOf(context, on)->size() > 1;
}

std::shared_ptr<const Placement> FindFlatPlacement(const Context& context, const std::string& object,
                                                   const std::string& on) {
  auto placement = FindPlacement(context, object, on);
  const bool flat = placement && placement->foot.points.size() >= 3 && placement->support.points.size() >= 3;
  return flat ? placement : nullptr;
}

std::shared_ptr<const Demand> DemandOf(const Context& context, const std::string& object,
                                       const std::string& by, const Placement& placement, double margin) {
  const std::string key = "demand(" + object + "," + by + "," + std::to_string(placement.part) + "," +
                          std::to_string(margin) + ")";
  return context.memo().Get<Demand>(
      key, [&] { return FindDemand(*context.ShapeOf(object), placement.foot, placement.support, margin); });
}

}  // namespace tether::constraints
