#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "tether/constraints/core/half_space_rows.h"
#include "tether/constraints/core/words.h"
#include "tether/constraints/grasps/surface.h"
#include "tether/constraints/grasps/upper_face.h"
#include "tether/constraints/kinds/contact_patch.h"
#include "tether/constraints/kinds/kinds.h"
#include "tether/constraints/kinds/placement.h"
#include "tether/geometry/distance/bounds.h"
#include "tether/geometry/distance/distance.h"
#include "tether/geometry/polygon/support.h"

namespace tether::constraints {
namespace {

using Eigen::Vector3d;
using geometry::FlatFacet;
using math::Pose;
using nlp::Role;

// A guess keeps this far from other things, m; where it can't, places around it are tried in rings of this
// width, m.
constexpr double kFreeDistance = 0.02;
constexpr double kRingWidth = 0.03;
constexpr int kRings = 6;
// Yaws that differ by less than this count as one option, rad; at most so many are offered.
constexpr double kDistinctYaw = 0.7;
constexpr size_t kMostYaws = 4;
// The centre of mass of what a tower's level carries stays this far inside the level's edges, m, but no
// further than this share of the level's inscribed circle. The most objects of a tower that are considered.
constexpr double kBalance = 0.008;
constexpr double kOfSize = 0.3;
constexpr size_t kMostOfTower = 8;
// A guess of what bridges several parts has its centre of mass this far inside of the contact, m.
constexpr double kBridge = 0.004;
// A guess goes this far from the edge towards the middle, m.
constexpr double kInwards = 0.05;

std::string NotSolid(const Context& context, FrameId object, FrameId on) {
  return "'" + context.Name(context.ShapeOf(object) == nullptr ? object : on) +
         "' is not solid: nothing rests there";
}

void GuessRestsOn(const Context& context, const Parameters& parameters, Pose& X_TC) {
  const FrameId object = parameters.Frame("object");
  const FrameId on = parameters.Frame("on");
  if (context.control() != object || context.target() != on) return;
  const auto placement = FindPlacement(context, object, on);
  if (!placement) return;
  const Vector3d down_T = X_TC.R * placement->foot.normal;
  const Pose turned(
      Eigen::Quaterniond::FromTwoVectors(down_T, -placement->support.normal).toRotationMatrix() * X_TC.R,
      X_TC.p);
  X_TC.R = turned.R;
  const double height = placement->support.offset + placement->foot.offset;
  X_TC.p += placement->support.normal * (height - placement->support.normal.dot(X_TC.p));
}

void BuildRestsOn(const Context& context, const Parameters& parameters, RowSink& sink) {
  const FrameId object = parameters.Frame("object");
  const FrameId on = parameters.Frame("on");
  const auto placement = FindPlacement(context, object, on);
  if (!placement) return sink.Decline(NotSolid(context, object, on));
  if (placement->foot.points.size() < 3) return sink.Decline(NoLowerFace(context, object));
  if (placement->support.points.size() < 3) return sink.Decline(NoUpperFace(context, on));
  const std::string label = "rests_on(" + context.Name(object) + ", " + context.Name(on) + ")";
  const std::vector<FrameAt> frames{{on, context.step()}, {object, context.step()}};
  const Vector3d& up = placement->support.normal;
  sink.Add(Role::kEquality, label + ": resting face parallel",
           MakeDirections(ParallelRows(placement->foot.normal, up)), frames);
  // A point of the resting face is at the height of the support.
  const Vector3d p_AQ = placement->foot.normal * placement->foot.offset;
  sink.Add(Role::kEquality, label + ": contact height",
           MakeHalfSpaces({{p_AQ, up, placement->support.offset}}), frames);
  if (placement->part >= 0) {
    sink.Exempt(context.step(), on, object, placement->part);
    for (const int part : placement->level) sink.Exempt(context.step(), on, object, part);
  } else {
    sink.Exempt(context.step(), object, on);
  }
}

void CheckRestsOn(const Context& context, const Parameters& parameters, Findings& findings) {
  const FrameId object = parameters.Frame("object");
  const FrameId on = parameters.Frame("on");
  const geometry::Shape* a = context.ShapeOf(object);
  const geometry::Shape* b = context.ShapeOf(on);
  if (a == nullptr || b == nullptr) return;
  const Pose X_WA = context.PoseAt({object, context.step()}), X_WB = context.PoseAt({on, context.step()});
  const std::string label = "rests_on(" + context.Name(object) + ", " + context.Name(on) + ")";
  const double distance = geometry::SignedDistance(*a, X_WA, *b, X_WB).distance;
  findings.Report(label + ": touching", nlp::Unit::kMetre, std::abs(distance), [&] {
    return context.Name(object) + " is " + InMillimetres(distance) + (distance > 0 ? " off " : " inside ") +
           context.Name(on);
  });
  const double tilt = std::acos(
      std::clamp((X_WA.R * context.DownFace(object)).dot(X_WB.R * context.DownFace(on)), -1.0, 1.0));
  findings.Report(label + ": upright", nlp::Unit::kRadian, tilt, [&] {
    return context.Name(object) + " leans by " + InDegrees(tilt) + " on " + context.Name(on);
  });
  // On top of it or of one of its parts, not at its side.
  const Vector3d up_W = -(X_WB.R * context.DownFace(on)), up_B = X_WB.R.transpose() * up_W;
  const double bottom = -geometry::Support(*a, -(X_WA.R.transpose() * up_W)) + up_W.dot(X_WA.p - X_WB.p);
  const double top = b->is_compound() ? FaceAtHeight(*UpperFacesOf(context, on), bottom).facet.offset
                                      : geometry::Support(*b, up_B);
  findings.Report(label + ": on top", nlp::Unit::kMetre, std::abs(bottom - top), [&] {
    return context.Name(object) + " is " + InMillimetres(bottom - top) +
           (bottom > top ? " above" : " below") + " the upper face of " + context.Name(on);
  });
}

/// All rows hold at X_BA.
bool Holds(const Demand& demand, const std::vector<FaceEdge>& edges, const Pose& X_BA) {
  for (const FaceEdge& edge : edges) {
    for (const Vector3d& p_AQ : demand.points_A) {
      if (edge.normal.dot(X_BA * p_AQ) > edge.offset - demand.margin) return false;
    }
  }
  return true;
}

/// The solids around an object that is put down, except what carries it.
class Surroundings {
 public:
  Surroundings(const Context& context, FrameId object, FrameId by)
      : shape_(*context.ShapeOf(object)), X_WB_(context.PoseAt({by, context.step() - 1})) {
    for (const ObjectId id : context.frames().objects()) {
      const FrameId frame = scene::Frames::Of(id);
      if (frame == object || frame == by) continue;
      const scene::Object& other = context.scene().object(id);
      const Pose X_WOther = context.PoseAt({frame, context.step() - 1});
      others_.push_back({&other.shape, X_WOther, geometry::BoundingBox(other.shape, X_WOther)});
    }
  }

  /// Distance from the object at X_BA to the nearest thing, m; if that is no more than `least`, just that.
  double RoomAround(const Pose& X_BA, double least) const {
    const Pose X_WA = X_WB_ * X_BA;
    const geometry::Aabb box = geometry::BoundingBox(shape_, X_WA);
    double room = std::numeric_limits<double>::infinity();
    // The nearest by its box first: most of the others are then known to be further off.
    size_t first = 0;
    std::vector<double> apart;
    for (const Other& other : others_) {
      apart.push_back(box.DistanceTo(other.box));
      if (apart.back() < apart[first]) first = apart.size() - 1;
    }
    for (size_t i = 0; i < others_.size(); ++i) {
      const size_t k = i == 0 ? first : i <= first ? i - 1 : i;
      const Other& other = others_[k];
      // Where bounding boxes overlap, the bound says nothing.
      if (apart[k] > 0 && apart[k] >= room) continue;
      room = std::min(room, geometry::SignedDistance(shape_, X_WA, *other.shape, other.X_W).distance);
      if (room <= least) break;
    }
    return room;
  }

 private:
  struct Other {
    const geometry::Shape* shape;
    Pose X_W;
    geometry::Aabb box;
  };
  const geometry::Shape& shape_;
  Pose X_WB_;
  std::vector<Other> others_;
};

/// Turns about the support's normal to try, from R_BA, the smallest first: steps of 15° in both directions,
/// and those that align an edge of the foot with one of the support, which a tight fit needs.
std::vector<double> YawsToTry(const Placement& placement, const std::vector<FaceEdge>& edges,
                              const Eigen::Matrix3d& R_BA) {
  const Vector3d& up = placement.support.normal;
  std::vector<double> yaws{std::numbers::pi};
  for (int twelfths = -11; twelfths < 12; ++twelfths) yaws.push_back(twelfths * std::numbers::pi / 12);
  if (edges.size() <= kMostCorners && placement.foot.points.size() <= kMostCorners) {
    for (const FaceEdge& foot_edge : EdgesOf(placement.foot)) {
      const Vector3d from = R_BA * foot_edge.normal;
      for (const FaceEdge& edge : edges)
        yaws.push_back(std::atan2(up.dot(from.cross(edge.normal)), from.dot(edge.normal)));
    }
  }
  std::stable_sort(yaws.begin(), yaws.end(), [](double a, double b) { return std::abs(a) < std::abs(b); });
  return yaws;
}

/// The demand can be met in any direction: the circle about the foot fits.
bool TurnsFreely(const Demand& demand, const Placement& placement) {
  if (demand.points_A.size() == 1) return true;
  const Vector3d centre = CentroidOf(placement.foot);
  double radius = 0;
  for (const Vector3d& p_AQ : demand.points_A) radius = std::max(radius, (p_AQ - centre).norm());
  return radius + demand.margin <= InradiusOf(placement.support);
}

void GuessSupported(const Context& context, const Parameters& parameters, Pose& X_TC) {
  const FrameId object = parameters.Frame("object");
  const FrameId by = parameters.Frame("by");
  if (context.control() != object || context.target() != by) return;
  const auto placement = FindPlacement(context, object, by);
  if (!placement || placement->support.points.size() < 3) return;
  const auto shared_demand = DemandOf(context, object, by, *placement, parameters.Number("margin"));
  const Demand& demand = *shared_demand;
  const std::vector<FaceEdge> edges = EdgesOf(placement->support);
  const Vector3d& up = placement->support.normal;
  const Pose start = X_TC;
  // What bridges several parts has its centre of mass over where it touches them.
  const auto carried = [&](const Pose& X) {
    if (!placement->hollow) return true;
    const geometry::Shape &a = *context.ShapeOf(object), &b = *context.ShapeOf(by);
    const geometry::Polygon contact = ContactHull(a, placement->foot.normal, X, b, placement->support);
    const Eigen::Vector2d centre = placement->support.Project(X * geometry::CentreOfMass(a));
    return geometry::ContainmentMargin(contact, centre) >= kBridge;
  };
  // For each yaw, the nearest place on the line to the middle where the demand holds.
  const auto place = [&](const Vector3d& from, double yaw) {
    Pose X(math::ExpSO3(up * yaw) * start.R, from);
    Vector3d goal = CentroidOf(placement->support) -
                    X.R * (demand.whole_footprint ? CentroidOf(placement->foot) : demand.points_A.front());
    goal += up * up.dot(from - goal);
    for (int i = 0; i <= 40; ++i) {
      X.p = from + (goal - from) * (i / 40.0);
      if (!Holds(demand, edges, X) || !carried(X)) continue;
      X_TC = X;
      // Not at the very edge: further towards the middle, where there is room.
      const Vector3d rest = goal - X.p;
      Demand roomy = demand;
      roomy.margin += kInwards;
      if (rest.norm() > 0 && !Holds(roomy, edges, X)) X_TC.p += rest * std::min(0.7, kInwards / rest.norm());
      return true;
    }
    return false;
  };
  // Where a tight fit leaves only some yaws, which of them is best may depend on later steps.
  std::vector<double> yaws;
  std::vector<Option> options;
  for (const double yaw : YawsToTry(*placement, edges, start.R)) {
    const bool near_another = std::any_of(yaws.begin(), yaws.end(), [&](double other) {
      return std::abs(std::remainder(yaw - other, 2 * std::numbers::pi)) < kDistinctYaw;
    });
    if (near_another || !place(start.p, yaw)) continue;
    yaws.push_back(yaw);
    options.push_back({"turned by " + std::to_string(std::lround(yaw * 180 / std::numbers::pi)) + " degrees",
                       kTurnWeight * yaw * yaw});
    if (yaws.size() == kMostYaws || TurnsFreely(demand, *placement)) break;
  }
  if (yaws.empty()) {
    X_TC.p = start.p + CentroidOf(placement->support) - start * CentroidOf(placement->foot);
    return;
  }
  const ChoiceKey key{ChoiceKey::Kind::kTurn, object, {}, context.step()};
  const double yaw = yaws[ToIndex(context.Choose(key, options))];
  place(start.p, yaw);
  // If something stands there, look around in widening rings for where it is clearest.
  const Vector3d x = up.unitOrthogonal(), y = up.cross(x);
  const Pose first = X_TC;
  Pose best = X_TC;
  const Surroundings surroundings(context, object, by);
  double best_room = surroundings.RoomAround(best, -std::numeric_limits<double>::infinity());
  for (int ring = 1; ring <= kRings && best_room < kFreeDistance; ++ring) {
    for (int i = 0; i < 12; ++i) {
      const double angle = i * std::numbers::pi / 6;
      place(first.p + kRingWidth * ring * (std::cos(angle) * x + std::sin(angle) * y), yaw);
      const double room = surroundings.RoomAround(X_TC, best_room);
      if (room > best_room + 1e-9) {
        best = X_TC;
        best_room = room;
      }
    }
  }
  X_TC = best;
}

/// A tower that the object is put on top of, from the object down to what carries the whole.
struct Tower {
  std::vector<FrameId> objects;  // the object first
  std::vector<double> masses;    // kg
};

/// From the object down over those that can be moved to the first that can't; at most as many as a function
/// has frames for.
Tower TowerUnder(const Context& context, FrameId object) {
  Tower tower;
  for (FrameId frame = object; tower.objects.size() < kMostOfTower; frame = context.ParentOf(frame)) {
    const scene::Object* found = context.ObjectAt(frame);
    if (found == nullptr) break;
    tower.objects.push_back(frame);
    tower.masses.push_back(found->mass.value_or(0));
    if (!found->movable()) break;
  }
  return tower;
}

/// What must stay over one level of a tower.
struct Balance {
  std::string label;
  PoseFunctionPtr function;
  std::vector<FrameAt> frames;
};

/// Each pair of neighbours in the tower but the topmost, whose centre of mass `supported` looks at by itself,
/// carries the common centre of mass of all above, `margin` inside of both faces that meet there, but no
/// further than a share of their size.
std::vector<Balance> BalancesOf(const Context& context, FrameId object, double margin) {
  std::vector<Balance> all;
  const Tower tower = TowerUnder(context, object);
  double mass = 0;
  for (size_t level = 1; level < tower.objects.size(); ++level) {
    mass += tower.masses[level - 1];
    if (level == 1 || mass <= 0) continue;
    const auto placement = FindFlatPlacement(context, tower.objects[level - 1], tower.objects[level]);
    if (!placement) continue;
    const double inset =
        std::min({margin, kOfSize * InradiusOf(placement->foot), kOfSize * InradiusOf(placement->support)});
    // Over the carrier's upper face, and over the foot of what stands on it.
    for (const size_t base : {level, level - 1}) {
      std::vector<Plane> planes;
      for (const FaceEdge& edge : EdgesOf(base == level ? placement->support : placement->foot))
        planes.push_back({edge.normal, edge.offset - inset});
      std::vector<FrameAt> frames{{tower.objects[base], context.step()}};
      std::vector<SharedPoint> points;
      for (size_t i = 0; i < level; ++i) {
        frames.push_back({tower.objects[i], context.step()});
        points.push_back(
            {geometry::CentreOfMass(*context.ShapeOf(tower.objects[i])), tower.masses[i] / mass});
      }
      all.push_back({"balance on " + context.Name(tower.objects[level]),
                     MakeMeanHalfSpaces(std::move(planes), std::move(points)), std::move(frames)});
    }
  }
  return all;
}

void BuildSupported(const Context& context, const Parameters& parameters, RowSink& sink) {
  const FrameId object = parameters.Frame("object");
  const FrameId by = parameters.Frame("by");
  const auto placement = FindPlacement(context, object, by);
  if (!placement) return sink.Decline(NotSolid(context, object, by));
  if (placement->support.points.size() < 3) return sink.Decline(NoUpperFace(context, by));
  const auto shared_demand = DemandOf(context, object, by, *placement, parameters.Number("margin"));
  const Demand& demand = *shared_demand;
  std::vector<HalfSpaceRow> rows;
  for (const FaceEdge& edge : EdgesOf(placement->support)) {
    for (const Vector3d& p_AQ : demand.points_A)
      rows.push_back({p_AQ, edge.normal, edge.offset - demand.margin});
  }
  AddHalfSpaces(Role::kInequality,
                "supported(" + context.Name(object) + ", " + context.Name(by) +
                    "): " + (demand.whole_footprint ? "footprint" : "centre of mass"),
                rows, {{by, context.step()}, {object, context.step()}}, sink);
  if (context.control() != object) return;
  for (Balance& balance : BalancesOf(context, object, kBalance)) {
    sink.Add(Role::kInequality,
             "supported(" + context.Name(object) + ", " + context.Name(by) + "): " + balance.label,
             std::move(balance.function), std::move(balance.frames));
  }
}

void CheckSupported(const Context& context, const Parameters& parameters, Findings& findings) {
  const FrameId object = parameters.Frame("object");
  const FrameId by = parameters.Frame("by");
  const geometry::Shape* a = context.ShapeOf(object);
  const geometry::Shape* b = context.ShapeOf(by);
  if (a == nullptr || b == nullptr) return;
  const Pose X_BA =
      math::Between(context.PoseAt({by, context.step()}), context.PoseAt({object, context.step()}));
  // In the plane of the support.
  FlatFacet support = geometry::SupportPolygon(*b, -context.DownFace(by));
  if (b->is_compound()) {
    const Vector3d& up = support.normal;
    const double bottom = up.dot(X_BA.p) - geometry::Support(*a, -(X_BA.R.transpose() * up));
    support = FaceAtHeight(*UpperFacesOf(context, by), bottom).facet;
  }
  const Eigen::Vector2d centre = support.Project(X_BA * geometry::CentreOfMass(*a));
  double inside = geometry::ContainmentMargin(support.polygon, centre);
  // Over where the two touch, which of several parts is less than the hull of their tops.
  const geometry::Polygon contact = ContactHull(*a, context.DownFace(object), X_BA, *b, support);
  if (!contact.empty()) inside = std::min(inside, geometry::ContainmentMargin(contact, centre));
  if (contact.empty() && inside >= 0) inside = std::min(-kInwards, -InradiusOf(support));
  findings.Report("supported(" + context.Name(object) + ", " + context.Name(by) + ")", nlp::Unit::kMetre,
                  -inside, [&] {
                    return "the centre of mass of " + context.Name(object) + " is " + InMillimetres(inside) +
                           " beyond the edge of " + context.Name(by);
                  });
  if (context.control() != object) return;
  for (const Balance& balance : BalancesOf(context, object, 0)) {
    std::vector<Pose> poses;
    for (const FrameAt& frame : balance.frames) poses.push_back(context.PoseAt(frame));
    Eigen::VectorXd r(balance.function->size());
    balance.function->Evaluate(poses, r, nullptr);
    findings.Report("supported(" + context.Name(object) + ", " + context.Name(by) + "): " + balance.label,
                    nlp::Unit::kMetre, r.maxCoeff(), [&] {
                      return "the tower under " + context.Name(object) +
                             " would fall: its centre of mass is " + InMillimetres(r.maxCoeff()) +
                             " too far out (" + balance.label + ")";
                    });
  }
}

/// The placement of a `rests_on` whose object this step puts down; null if it does not, or if a face there is
/// not flat.
std::shared_ptr<const Placement> PlacementHere(const Context& context, const Parameters& parameters) {
  const FrameId object = parameters.Frame("object");
  const FrameId on = parameters.Frame("on");
  if (context.control() != object || context.target() != on) return nullptr;
  return FindFlatPlacement(context, object, on);
}

/// At the height at which it touches, anywhere.
std::optional<Column> LocateRestsOn(const Context& context, const Parameters& parameters) {
  const auto placement = PlacementHere(context, parameters);
  if (!placement || HasFaces(context, parameters.Frame("on"))) return std::nullopt;
  const Vector3d& up = placement->support.normal;
  return Column{up * (placement->support.offset + placement->foot.offset), up,
                std::numeric_limits<double>::infinity(), 0};
}

std::optional<Alignment> AlignRestsOn(const Context& context, const Parameters& parameters) {
  const auto placement = PlacementHere(context, parameters);
  if (!placement) return std::nullopt;
  return Alignment{placement->foot.normal, -placement->support.normal};
}

/// Over the support, at any height. The demand's points are inside by its margin; the middle of a footprint
/// is inside by the radius of its circumscribed circle as well.
std::optional<Column> LocateSupported(const Context& context, const Parameters& parameters) {
  const FrameId object = parameters.Frame("object");
  const FrameId by = parameters.Frame("by");
  if (context.control() != object || context.target() != by || HasFaces(context, by)) return std::nullopt;
  const auto placement = FindPlacement(context, object, by);
  if (!placement || placement->support.points.size() < 3) return std::nullopt;
  const auto demand = DemandOf(context, object, by, *placement, parameters.Number("margin"));
  const bool corners = demand->whole_footprint && demand->points_A.size() > 1;
  const double inset = demand->margin + (corners ? InradiusOf(placement->foot) : 0);
  const Vector3d p_AQ = corners ? CentroidOf(placement->foot) : demand->points_A.front();
  const Vector3d centre = CentroidOf(placement->support);
  double radius = 0;
  for (const Eigen::Vector2d& corner : geometry::Shrink(placement->support.polygon, inset))
    radius = std::max(radius, (placement->support.Lift(corner) - centre).norm());
  // The object may be turned about the vertical.
  const Vector3d& down_A = placement->foot.normal;
  radius += (p_AQ - down_A * down_A.dot(p_AQ)).norm();
  return Column{centre, placement->support.normal, radius, std::numeric_limits<double>::infinity()};
}

}  // namespace

Kind RestsOnKind() {
  return {"rests_on",
          "The object stands on the other: the face that it last stood on is parallel to the other's upper "
          "face and touches it. A compound may have several upper faces: which one is a choice, first those "
          "with room above "
          "for the object and a hand. Three smooth "
          "rows, in place of a signed distance whose witness points are not unique between parallel faces.",
          "Paper A, eqs. (8), (12); ERRATA A7, A12",
          {{"object", ParameterDoc::Type::kFrame, true, 0, 0, 0, {}, "what is put down"},
           {"on", ParameterDoc::Type::kFrame, true, 0, 0, 0, {}, "what it stands on"}},
          GuessRestsOn,
          BuildRestsOn,
          CheckRestsOn,
          LocateRestsOn,
          AlignRestsOn};
}

Kind SupportedKind() {
  return {"supported",
          "The object is over the upper face of what carries it: its whole footprint where that fits, by the "
          "margin or half of the room there "
          "is; else its true centre of mass, at least the margin inside. One row per edge of the polygon. Of "
          "a tower, the "
          "common centre of mass of all that lies above a level stays over it too.",
          "Paper A, eq. (10); ERRATA A12, A13, A14",
          {{"object", ParameterDoc::Type::kFrame, true, 0, 0, 0, {}, "what is carried"},
           {"by", ParameterDoc::Type::kFrame, true, 0, 0, 0, {}, "what carries it"},
           {"margin", ParameterDoc::Type::kNumber, false, 0.01, 0, 1, {}, "distance inside the edge, m"}},
          GuessSupported,
          BuildSupported,
          CheckSupported,
          LocateSupported};
}

}  // namespace tether::constraints
