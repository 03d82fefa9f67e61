#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <numbers>

#include "tether/common/text.h"
#include "tether/constraints/core/half_space_rows.h"
#include "tether/constraints/core/words.h"
#include "tether/constraints/grasps/grasp.h"
#include "tether/constraints/grasps/opposite_sides.h"
#include "tether/constraints/grasps/part_grasps.h"
#include "tether/constraints/grasps/surface.h"
#include "tether/constraints/kinds/kinds.h"
#include "tether/constraints/kinds/known.h"
#include "tether/geometry/distance/bounds.h"
#include "tether/geometry/distance/distance.h"
#include "tether/geometry/distance/query.h"
#include "tether/geometry/polygon/support.h"

namespace tether::constraints {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using geometry::Part;
using math::Pose;
using nlp::Role;

// An axis whose cosine with the vertical is below this is level.
constexpr double kAlong = 0.1;
// Room between the palm and the top of what is grasped, m.
constexpr double kPalmClearance = 0.005;
// Between the open hand and what else the grasped object is made of, m.
constexpr double kOtherPartClearance = 0.002;
// Fingers nearer to something else than this are worth avoiding, m.
constexpr double kFingerClearance = 0.01;
// Weights of scores, per m: clearance that the fingers lack; distance of the wrist beyond reach; width of the
// grasp, which decides between equals.
constexpr double kClearanceWeight = 10;
constexpr double kReachWeight = 10;
constexpr double kWidthWeight = 0.01;
// The most pairs of sides of one part that are offered.
constexpr size_t kMostOfPart = 8;

}  // namespace

std::vector<ClosingDirection> ClosingDirections(const geometry::Primitive& primitive,
                                                const Vector3d& approach_P) {
  const bool along_z = std::abs(approach_P.z()) > 0.9;
  if (const auto* box = std::get_if<geometry::Box>(&primitive)) {
    static const char* const names[] = {"x", "y", "z"};
    std::vector<ClosingDirection> widths;
    for (int i = 0; i < 3; ++i) {
      if (std::abs(approach_P[i]) < 0.1) widths.push_back({Vector3d::Unit(i), box->size[i], names[i]});
    }
    return widths;
  }
  if (const auto* sphere = std::get_if<geometry::Sphere>(&primitive)) {
    return {{std::nullopt, 2 * sphere->radius, "any direction"}};
  }
  if (std::holds_alternative<geometry::Hull>(primitive)) return {};
  const auto* capsule = std::get_if<geometry::Capsule>(&primitive);
  const double radius = capsule != nullptr ? capsule->radius : std::get<geometry::Cylinder>(primitive).radius;
  if (along_z) return {{std::nullopt, 2 * radius, "any direction"}};
  if (std::abs(approach_P.z()) > 0.1) return {};
  std::vector<ClosingDirection> all{{approach_P.cross(Vector3d::UnitZ()).normalized(), 2 * radius, "across"}};
  // A short one by its ends, which are flat.
  if (capsule == nullptr) {
    const double length = std::get<geometry::Cylinder>(primitive).length;
    if (length <= 2 * radius) all.push_back({Vector3d::UnitZ(), length, "along"});
  }
  return all;
}

namespace {

/// The rotation of a hand that approaches along `approach` and closes along ±`closing`, whichever is nearer
/// to `R_now` (the gripper is symmetric).
Matrix3d HandRotation(const Vector3d& approach, const Vector3d& closing, const Matrix3d& R_now) {
  Matrix3d R;
  R.col(2) = approach;
  R.col(1) = (closing - approach * approach.dot(closing)).normalized();
  R.col(0) = R.col(1).cross(R.col(2));
  Matrix3d R_turned = R;
  R_turned.col(0) *= -1;
  R_turned.col(1) *= -1;
  return math::AngleBetween(R, R_now) <= math::AngleBetween(R_turned, R_now) ? R : R_turned;
}

/// The hand's rotation for a grasp, in the object's frame.
Matrix3d GraspRotation(const Context& context, FrameId object, const Grasp& grasp) {
  const int before = context.step() - 1;
  const Matrix3d R_now =
      context.PoseAt({object, before}).R.transpose() * context.PoseAt({context.hand(), before}).R;
  // Without a preferred direction, keep the one that the hand has.
  const Vector3d closing = grasp.closing_O.value_or(R_now.col(1));
  const Vector3d across = closing - grasp.approach_O * grasp.approach_O.dot(closing);
  return HandRotation(grasp.approach_O, across.norm() > 1e-3 ? closing : grasp.approach_O.unitOrthogonal(),
                      R_now);
}

/// The approach directions to a part: unit vectors in the object's frame, along which the hand moves.
std::vector<Vector3d> ApproachesTo(const Part& part, const Vector3d& down_O, const std::string& which) {
  std::vector<Vector3d> all;
  if (which == "down" || which == "any") all.push_back(down_O);
  if (which == "down") return all;
  // Level ones: across the part's sides, and all round what is round.
  std::vector<Vector3d> level;
  for (int i = 0; i < 3; ++i) {
    const Vector3d axis = part.X_SP.R.col(i);
    if (std::abs(axis.dot(down_O)) < kAlong) level.insert(level.end(), {axis, -axis});
  }
  if (level.empty()) level = {down_O.unitOrthogonal(), -down_O.unitOrthogonal()};
  const bool box = std::holds_alternative<geometry::Box>(part.primitive);
  if (const size_t count = level.size(); !box && count == 4) {
    for (size_t i = 0; i < 2; ++i) {
      for (size_t j = 2; j < 4; ++j) level.push_back((level[i] + level[j]).normalized());
    }
  }
  if (which != "side") {
    for (const Vector3d& direction : level) all.push_back((down_O + direction).normalized());
  }
  if (which != "tilted") all.insert(all.end(), level.begin(), level.end());
  return all;
}

/// How far the angle between the hand's approach and straight down is from the nearest one that `which`
/// allows, rad.
double ApproachError(double tilt, const std::string& which) {
  const double quarter = std::numbers::pi / 4;
  double error = std::numeric_limits<double>::infinity();
  if (which == "down" || which == "any") error = std::min(error, tilt);
  if (which == "tilted" || which == "any") error = std::min(error, std::abs(tilt - quarter));
  if (which == "side" || which == "any") error = std::min(error, std::abs(tilt - 2 * quarter));
  return error;
}

/// The hand's pose for this grasp: over the part's centre, as deep as the palm allows.
double ScoreGrasp(const Context& context, FrameId object, const Part& part, const Grasp& grasp) {
  const Pose X_WO = context.PoseAt({object, context.step() - 1});
  const Pose X_WH = X_WO * Pose(GraspRotation(context, object, grasp), grasp.centre_O);
  const double turn = math::AngleBetween(X_WH.R, context.PoseAt({context.hand(), context.step() - 1}).R);
  double score = kWidthWeight * grasp.width + kTurnWeight * turn * turn;
  if (const geometry::Shape* hand = context.ShapeOf(context.hand())) {
    double clearance = kFingerClearance;
    for (const ObjectId id : context.frames().objects()) {
      const FrameId frame = scene::Frames::Of(id);
      if (frame == object) continue;
      const scene::Object& other = context.scene().object(id);
      const Pose X_WOther = context.PoseAt({frame, context.step() - 1});
      if (geometry::DistanceLowerBound(*hand, X_WH, other.shape, X_WOther) >= clearance) continue;
      clearance = std::min(clearance, geometry::SignedDistance(*hand, X_WH, other.shape, X_WOther).distance);
    }
    score += kClearanceWeight * (kFingerClearance - clearance);
  }
  if (context.robot() != nullptr) {
    const robot::Reach& reach = context.robot()->reach();
    const Vector3d p_WCentre = context.X_WBase() * reach.centre;
    // The part's point nearest to the shoulder bounds what can be reached.
    const Pose X_WP = X_WO * part.X_SP;
    const Vector3d p_WNear = geometry::DistanceToPoint(part.primitive, X_WP, p_WCentre).p_W;
    const Vector3d p_WWrist = p_WNear + X_WH.R * reach.wrist_hand;
    score += kReachWeight * std::max(0.0, (p_WWrist - p_WCentre).norm() - reach.max);
  }
  return score;
}

void GuessGraspable(const Context& context, const Parameters& parameters, Pose& X_TC) {
  const FrameId object = parameters.Frame("object");
  if (context.control() != context.hand() || context.target() != object) return;
  if (const auto grasp = ChosenGrasp(context, object)) X_TC.R = GraspRotation(context, object, *grasp);
}

/// The open hand keeps clear of what else the object is made of.
void AddOtherParts(const Context& context, const geometry::Shape& shape, int grasped,
                   const std::string& label, const std::vector<FrameAt>& frames, RowSink& sink) {
  const geometry::Shape* hand = context.ShapeOf(context.hand());
  if (hand == nullptr) return;
  for (size_t j = 0; j < shape.parts.size(); ++j) {
    if (static_cast<int>(j) == grasped) continue;
    for (const Part& part : hand->parts)
      sink.Add(Role::kInequality, label + ": hand clear of its other parts",
               MakePartDistance(shape.parts[j], part, kOtherPartClearance, -1), frames);
  }
}

/// Where no other constraint asks for the hand to be inside of what it grasps: the part is between the pads,
/// along the directions in which they are not centred on it.
void AddBetweenFingers(const Context& context, const Grasp& grasp, const Part& part, const std::string& label,
                       const std::vector<FrameAt>& frames, RowSink& sink) {
  const Vector3d up = -grasp.approach_O;
  std::vector<HalfSpaceRow> rows;
  const auto keep_inside = [&](const Vector3d& direction, double margin) {
    const double extent = PartSupport(part, direction) + PartSupport(part, -direction);
    for (const Vector3d& n : {direction, Vector3d(-direction)})
      rows.push_back({Vector3d::Zero(), n, PartSupport(part, n) - std::min(margin, 0.25 * extent)});
  };
  keep_inside(up, 0);
  // Bounds of a hull's sides say where along them the fingers are.
  if (grasp.closing_O && grasp.bounds_O.empty())
    keep_inside(up.cross(*grasp.closing_O), FingersOf(context.robot()).pad_half_width);
  AddHalfSpaces(Role::kInequality, label + ": between the fingers", rows, frames, sink);
}

void BuildGraspable(const Context& context, const Parameters& parameters, RowSink& sink) {
  const FrameId object = parameters.Frame("object");
  const geometry::Shape* shape = context.ShapeOf(object);
  if (shape == nullptr)
    return sink.Refute("'" + context.Name(object) + "' is not solid: there is nothing to grasp");
  const auto grasp = ChosenGrasp(context, object);
  if (!grasp) {
    GraspFlaws flaws;
    FindGrasps(context, object, &flaws);
    return flaws.proved() ? sink.Refute(flaws.Describe(context.Name(object)))
                          : sink.Decline(flaws.Describe(context.Name(object)));
  }
  const Part& part = shape->parts[grasp->part];
  const std::string label = "graspable(" + context.Name(object) + ")";
  const std::vector<FrameAt> frames{{object, context.step()}, {context.hand(), context.step()}};
  const Vector3d up = -grasp->approach_O;
  std::vector<Vector3d> centred;
  if (grasp->closing_O) {
    sink.Add(Role::kEquality, label + ": orientation of the hand",
             MakeRotationMatch(GraspRotation(context, object, *grasp)), frames);
    centred = {*grasp->closing_O};
  } else {
    sink.Add(Role::kEquality, label + ": approach direction",
             MakeDirections(ParallelRows(Vector3d::UnitZ(), grasp->approach_O)), frames);
    const Vector3d x = up.unitOrthogonal();
    centred = {x, up.cross(x)};
  }
  std::vector<HalfSpaceRow> rows;
  for (const Vector3d& n : centred) rows.push_back({Vector3d::Zero(), n, n.dot(grasp->centre_O)});
  sink.Add(Role::kEquality, label + ": centred between the fingers", MakeHalfSpaces(rows), frames);
  if (!grasp->bounds_O.empty()) {
    rows.clear();
    for (const FaceEdge& bound : grasp->bounds_O)
      rows.push_back({Vector3d::Zero(), bound.normal, bound.offset});
    AddHalfSpaces(Role::kInequality, label + ": fingers on its sides", rows, frames, sink);
  }
  AddOtherParts(context, *shape, grasp->part, label, frames, sink);
  if (!context.grip_margin(object)) AddBetweenFingers(context, *grasp, part, label, frames, sink);
  if (context.robot() == nullptr) return;
  const robot::Gripper& gripper = context.robot()->gripper();
  sink.Add(
      Role::kInequality, label + ": palm clear of its top",
      MakeHalfSpaces({{Vector3d::Zero(), -up, gripper.palm_depth - kPalmClearance - PartSupport(part, up)}}),
      frames);
  // Pads that reach below the object would close on what it stands on.
  sink.Add(
      Role::kInequality, label + ": pads not below it",
      MakeHalfSpaces({{Vector3d::Zero(), -up, geometry::Support(*shape, -up) - gripper.pad_half_height}}),
      frames);
}

std::optional<Alignment> AlignGraspable(const Context& context, const Parameters& parameters) {
  const FrameId object = parameters.Frame("object");
  if (context.control() != context.hand() || context.target() != object ||
      context.ShapeOf(object) == nullptr || parameters.Text("approach") != "down")
    return std::nullopt;
  return Alignment{Vector3d::UnitZ(), context.DownFace(object)};
}

void CheckGraspable(const Context& context, const Parameters& parameters, Findings& findings) {
  const FrameId object = parameters.Frame("object");
  const geometry::Shape* shape = context.ShapeOf(object);
  if (shape == nullptr) return;
  const std::string label = "graspable(" + context.Name(object) + ")";
  const Pose X_OH = math::Between(context.PoseAt({object, context.step()}),
                                  context.PoseAt({context.hand(), context.step()}));
  // "Down" is towards the face that the object stands on.
  const double tilt = std::acos(std::clamp(X_OH.R.col(2).dot(context.DownFace(object)), -1.0, 1.0));
  const std::string& approach = parameters.Text("approach");
  findings.Report(label + (approach == "down" ? ": approach from above" : ": approach"), nlp::Unit::kRadian,
                  ApproachError(tilt, approach), [&] {
                    return "the hand would come to " + context.Name(object) + " tilted by " +
                           InDegrees(ApproachError(tilt, approach));
                  });
  // The part between the fingers is the one that the grasp point is in; measure it along the closing axis.
  const int index = geometry::DistanceToPoint(*shape, Pose(), X_OH.p).part;
  const Part& part = shape->parts[index];
  const Vector3d closing = X_OH.R.col(1);
  const double upper = PartSupport(part, closing) - closing.dot(X_OH.p);
  const double lower = PartSupport(part, -closing) + closing.dot(X_OH.p);
  const double opening = FingersOf(context.robot()).max_opening;
  findings.Report(label + ": width between the fingers", nlp::Unit::kMetre, upper + lower - opening, [&] {
    return context.Name(object) + " is too wide there: " + InMillimetres(upper + lower) +
           ", and the fingers open " + InMillimetres(opening);
  });
  findings.Report(label + ": centred between the fingers", nlp::Unit::kMetre, 0.5 * std::abs(upper - lower),
                  [&] {
                    return context.Name(object) + " is not midway between the fingers, but " +
                           InMillimetres(0.5 * (upper - lower)) + " off";
                  });
  // Measured along the closing axis alone, what is beside the pads would be between them.
  const double outside = geometry::DistanceToPoint(part.primitive, part.X_SP, X_OH.p).distance;
  findings.Report(label + ": between the fingers", nlp::Unit::kMetre, outside, [&] {
    return "the point between the fingers would be " + InMillimetres(outside) + " beside " +
           context.Name(object);
  });
  if (std::holds_alternative<geometry::Hull>(part.primitive)) {
    // The fingers lie flat against what they close on.
    for (const Vector3d& outward : {closing, Vector3d(-closing)}) {
      const auto hit = geometry::CastRay(part.primitive, part.X_SP, X_OH.p, outward);
      const double angle = hit ? std::acos(std::clamp(hit->n_W.dot(outward), -1.0, 1.0)) : std::numbers::pi;
      findings.Report(label + ": fingers on its sides", nlp::Unit::kRadian, angle - kNearlyParallel,
                      [&] { return "a finger would not lie on a side of " + context.Name(object); });
    }
  }
  if (const geometry::Shape* hand = context.ShapeOf(context.hand())) {
    double inside = 0;
    for (size_t j = 0; j < shape->parts.size(); ++j) {
      if (static_cast<int>(j) == index) continue;
      const geometry::Shape other({shape->parts[j]});
      inside = std::max(inside, -geometry::SignedDistance(*hand, X_OH, other, Pose()).distance);
    }
    findings.Report(label + ": hand clear of its other parts", nlp::Unit::kMetre, inside, [&] {
      return "the open hand would be " + InMillimetres(inside) + " inside another part of " +
             context.Name(object);
    });
  }
  if (context.robot() == nullptr) return;
  const robot::Gripper& gripper = context.robot()->gripper();
  const Vector3d down = X_OH.R.col(2);
  findings.Report(label + ": palm clear of its top", nlp::Unit::kMetre,
                  PartSupport(part, -down) + down.dot(X_OH.p) - gripper.palm_depth, [&] {
                    return context.Name(object) + " is too high to be grasped there: the palm would be " +
                           InMillimetres(PartSupport(part, -down) + down.dot(X_OH.p) - gripper.palm_depth) +
                           " inside its top";
                  });
  const double below = down.dot(X_OH.p) + gripper.pad_half_height - geometry::Support(*shape, down);
  findings.Report(label + ": pads not below it", nlp::Unit::kMetre, below, [&] {
    return context.Name(object) + " is too low to be grasped there: the fingers' pads would reach " +
           InMillimetres(below) + " below it";
  });
}

}  // namespace

std::vector<Grasp> FindGrasps(const Context& context, FrameId object, GraspFlaws* flaws) {
  std::vector<Grasp> grasps;
  const geometry::Shape* shape = context.ShapeOf(object);
  if (shape == nullptr) return grasps;
  const Fingers fingers = FingersOf(context.robot());
  Load load;
  load.margin = context.grip_margin(object).value_or(0);
  if (const scene::Object* body = context.ObjectAt(object); body != nullptr && body->mass) {
    load.mass = *body->mass;
    load.friction = body->friction;
    load.force = context.grip_force(object);
  }
  const Vector3d down_O = context.DownFace(object);
  GraspFlaws unasked;
  const auto better = [](const Grasp& a, const Grasp& b) { return a.score < b.score - 1e-9; };
  for (size_t i = 0; i < shape->parts.size(); ++i) {
    const Part& part = shape->parts[i];
    std::vector<Grasp> of_part;
    const std::vector<Vector3d> approaches = ApproachesTo(part, down_O, context.approach());
    for (const Vector3d& approach_O : approaches) {
      for (Grasp& grasp : GraspsOfPart(*shape, static_cast<int>(i), approach_O, down_O, fingers, load,
                                       context.approach() == "down", flaws != nullptr ? *flaws : unasked)) {
        if (shape->is_compound()) grasp.label = "part " + std::to_string(i + 1) + ", " + grasp.label;
        if (approaches.size() > 1) {
          char text[80];
          const Vector3d along_P = part.X_SP.R.transpose() * approach_O;
          FormatInto(text, sizeof text, ", along (%.1f, %.1f, %.1f)", along_P.x(), along_P.y(), along_P.z());
          grasp.label += text;
        }
        grasp.score = ScoreGrasp(context, object, part, grasp);
        of_part.push_back(std::move(grasp));
      }
    }
    std::stable_sort(of_part.begin(), of_part.end(), better);
    const size_t most = kMostOfPart * (approaches.size() > 1 ? 2 : 1);
    if (of_part.size() > most) of_part.resize(most);
    std::move(of_part.begin(), of_part.end(), std::back_inserter(grasps));
  }
  std::stable_sort(grasps.begin(), grasps.end(), better);
  return grasps;
}

std::optional<Grasp> ChosenGrasp(const Context& context, FrameId object) {
  const auto grasps = context.known_of_program().grasps.Get({object, context.step()},
                                                            [&] { return FindGrasps(context, object); });
  if (grasps->empty()) return std::nullopt;
  std::vector<Option> options;
  for (const Grasp& grasp : *grasps) options.push_back({grasp.label, grasp.score});
  const ChoiceKey key{ChoiceKey::Kind::kGrasp, object, {}, context.step()};
  return (*grasps)[ToIndex(context.Choose(key, options))];
}

int GraspedPart(const Context& context, FrameId object) {
  const auto grasp = ChosenGrasp(context, object);
  return grasp ? grasp->part : 0;
}

Kind GraspableKind() {
  return {
      "graspable",
      "The hand is where its two fingers can close on the object. Its approach is straight down, towards "
      "the face that the object stands on; with `approach: side` level; with `tilted` half-way between; "
      "with `any` any of these. The fingers close along a direction in which the object fits between "
      "them, the object is centred, the palm is clear, the open hand is clear of the object's other "
      "parts, and the pads do not reach below the object. Friction of the pads holds its weight, with a "
      "quarter to spare, at the force of the step's `gripper` verb. A hull is grasped by two of its sides "
      "that lie opposite each other, parallel to within 0.1 rad. The planned orientation is executed. "
      "Directions are tried from the one that turns the hand least, with the fingers clear and the wrist "
      "within reach; of equal ones, the narrowest first.",
      "Paper A, section VI-B; ERRATA A13",
      {{"object", ParameterDoc::Type::kFrame, true, 0, 0, 0, {}, "what is grasped"},
       {"approach",
        ParameterDoc::Type::kText,
        false,
        0,
        0,
        0,
        {"down", "side", "tilted", "any"},
        "direction of approach"}},
      GuessGraspable,
      BuildGraspable,
      CheckGraspable,
      nullptr,
      AlignGraspable};
}

}  // namespace tether::constraints
