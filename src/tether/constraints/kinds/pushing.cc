#include <algorithm>
#include <cmath>

#include "tether/constraints/core/half_space_rows.h"
#include "tether/constraints/core/words.h"
#include "tether/constraints/grasps/contact.h"
#include "tether/constraints/grasps/surface.h"
#include "tether/constraints/grasps/upper_face.h"
#include "tether/constraints/kinds/kinds.h"
#include "tether/geometry/distance/distance.h"
#include "tether/scene/friction.h"

namespace tether::constraints {
namespace {

using Eigen::Vector3d;
using math::Pose;
using nlp::Role;

// What pushes is at the object if it is no further away, m: the planner's tolerance of one row.
constexpr double kTouching = 1e-3;
// Between a tool that pushes and the surface that it passes over, m: room for the tool to sag.
constexpr double kToolHeight = 0.004;
// The least distance of the push from the ends of a line or face of contact, m.
constexpr double kEndMargin = 0.01;
// The share of half the friction angle that a planned push may use.
constexpr double kConeShare = 0.5;
// A point of contact may be this far beside the centre of mass, m.
constexpr double kPointOffset = 0.002;
// A touch is so far within a side at least, and so near to the line where something round is touched, m.
constexpr double kOnSide = 0.002;
constexpr double kOnRound = 0.0005;
// A first guess of how far to push, m.
constexpr double kGuessedPush = 0.2;

Vector3d ToolDown(const Context& context, FrameId tool) {
  return tool == context.hand() ? Vector3d(Vector3d::UnitZ()) : context.DownFace(tool);
}

/// Heights over the object's origin between which the middle of the tool may press: above its lower edge, not
/// above its centre of mass where the side reaches down there, and on the side.
std::pair<double, double> PressHeights(const geometry::Shape& object, const Vector3d& up_B,
                                       const Contact& contact) {
  const double low = std::max(-geometry::Support(object, -up_B) + 0.002, contact.lowest_B);
  const double high = std::max(low + 0.002, up_B.dot(geometry::CentreOfMass(object)));
  return {std::min(low, contact.highest_B), std::min(high, contact.highest_B)};
}

std::string NoContact(const Context& context, FrameId a, FrameId b) {
  for (const FrameId name : {a, b}) {
    if (context.ShapeOf(name) == nullptr)
      return "'" + context.Name(name) + "' is not solid: nothing touches it";
  }
  return "no upright side of " + context.Name(b) + " that a part of " + context.Name(a) + " can lie against";
}

void GuessTouch(const Context& context, const Parameters& parameters, Pose& X_TC) {
  const FrameId a = parameters.Frames("between")[0];
  const FrameId b = parameters.Frames("between")[1];
  if (context.control() != a || context.target() != b) return;
  const auto contact = ChosenContact(context, a, b, context.step());
  if (!contact) return;
  const Vector3d up_B = -context.DownFace(b);
  // Levelled first, then turned about the vertical until line or face lie against the side.
  X_TC.R =
      Eigen::Quaterniond::FromTwoVectors(X_TC.R * ToolDown(context, a), -up_B).toRotationMatrix() * X_TC.R;
  if (contact->form != Contact::Form::kPoint) {
    const Vector3d direction_B = X_TC.R * contact->direction_A;
    Vector3d goal = -contact->normal_B;
    if (contact->form == Contact::Form::kLine) {
      goal = up_B.cross(contact->normal_B);
      if (goal.dot(direction_B) < 0) goal = -goal;
      // Both directions serve for a line; the rest of the tool should lie on the side that the push goes to.
      const Vector3d arm_A = geometry::CentreOfMass(*context.ShapeOf(a)) - contact->centre_A;
      const Eigen::Matrix3d turn = Eigen::Quaterniond::FromTwoVectors(direction_B, goal).toRotationMatrix();
      if ((turn * X_TC.R * arm_A).dot(contact->normal_B) > 1e-6) goal = -goal;
    }
    const double angle = std::atan2(up_B.dot(direction_B.cross(goal)), direction_B.dot(goal));
    X_TC.R = math::ExpSO3(up_B * angle) * X_TC.R;
  }
  const auto [low, high] = PressHeights(*context.ShapeOf(b), up_B, *contact);
  const Vector3d com_B = geometry::CentreOfMass(*context.ShapeOf(b));
  const Vector3d across = up_B.cross(contact->normal_B);
  const Vector3d p_BCentre = contact->normal_B * (contact->offset_B + contact->tool_depth) +
                             across * across.dot(com_B) + up_B * (0.5 * (low + high));
  X_TC.p = p_BCentre - X_TC.R * contact->centre_A;
}

void BuildTouch(const Context& context, const Parameters& parameters, RowSink& sink) {
  const FrameId a = parameters.Frames("between")[0];
  const FrameId b = parameters.Frames("between")[1];
  const std::string label = "touch(" + context.Name(a) + ", " + context.Name(b) + ")";
  const auto contact = ChosenContact(context, a, b, context.step());
  if (!contact) return sink.Decline(NoContact(context, a, b));
  const Vector3d up_B = -context.DownFace(b);
  const std::vector<FrameAt> frames{{b, context.step()}, {a, context.step()}};
  std::vector<DirectionRow> rows = ParallelRows(ToolDown(context, a), up_B);
  const Vector3d across = up_B.cross(contact->normal_B);
  if (contact->form == Contact::Form::kLine) rows.push_back({contact->direction_A, contact->normal_B, 0});
  if (contact->form == Contact::Form::kFace) rows.push_back({contact->direction_A, across, 0});
  sink.Add(Role::kEquality, label + ": level and square to the side", MakeDirections(rows), frames);
  sink.Add(Role::kEquality, label + ": contact",
           MakeHalfSpaces({{contact->centre_A, contact->normal_B, contact->offset_B + contact->tool_depth}}),
           frames);
  // Not only the plane of the side: on the side itself, by a little more than the tolerance.
  const double half = contact->half_width, rise = contact->half_height;
  const Extent along{contact->reach_B.low - half + kOnSide, contact->reach_B.high + half - kOnSide};
  const Extent heights{contact->heights_B.low - rise + kOnSide, contact->heights_B.high + rise - kOnSide};
  const double middle = 0.5 * (along.low + along.high), level = 0.5 * (heights.low + heights.high);
  AddHalfSpaces(Role::kInequality, label + ": on the side",
                {{contact->centre_A, across, std::max(along.high, middle + kOnRound)},
                 {contact->centre_A, -across, -std::min(along.low, middle - kOnRound)},
                 {contact->centre_A, up_B, std::max(heights.high, level + kOnRound)},
                 {contact->centre_A, -up_B, -std::min(heights.low, level - kOnRound)}},
                frames, sink);
  sink.Exempt(context.step(), a, b, contact->tool_part);
}

void CheckTouch(const Context& context, const Parameters& parameters, Findings& findings) {
  const FrameId a = parameters.Frames("between")[0];
  const FrameId b = parameters.Frames("between")[1];
  const geometry::Shape* shape_a = context.ShapeOf(a);
  const geometry::Shape* shape_b = context.ShapeOf(b);
  if (shape_a == nullptr || shape_b == nullptr) return;
  const double distance = geometry::SignedDistance(*shape_a, context.PoseAt({a, context.step()}), *shape_b,
                                                   context.PoseAt({b, context.step()}))
                              .distance;
  findings.Report("touch(" + context.Name(a) + ", " + context.Name(b) + ")", nlp::Unit::kMetre,
                  std::abs(distance), [&] {
                    return context.Name(a) + " is " + InMillimetres(distance) +
                           (distance > 0 ? " away from " : " inside ") + context.Name(b);
                  });
}

double HalfFrictionAngle(const Context& context, FrameId tool, FrameId object) {
  const scene::Object* a = context.ObjectAt(tool);
  const scene::Object* b = context.ObjectAt(object);
  double friction = b != nullptr ? b->friction : 0.5;
  if (a != nullptr) friction = scene::PairFriction(friction, a->friction);
  return 0.5 * std::atan(friction);
}

void BuildPushNormal(const Context& context, const Parameters& parameters, RowSink& sink) {
  const FrameId a = parameters.Frame("tool");
  const FrameId b = parameters.Frame("object");
  const FrameId c = parameters.Frame("on");
  const int before = context.step() - 1, after = context.step();
  const std::string label = "push_normal(" + context.Name(a) + ", " + context.Name(b) + ")";
  const auto contact = ChosenContact(context, a, b, before);
  if (!contact) return sink.Decline(NoContact(context, a, b));
  const Vector3d up_B = -context.DownFace(b);
  const Vector3d& n = contact->normal_B;
  const Vector3d across = up_B.cross(n);

  // Real contacts creep sideways long before they slip, so a planned push uses only part of what ERRATA A13
  // allows. Linear in the displacement, so that a push of no length is allowed and has no direction to be
  // undefined (ERRATA A5).
  const double k = std::tan(kConeShare * HalfFrictionAngle(context, a, b));
  sink.Add(Role::kInequality, label + ": direction within half the friction angle",
           MakeDisplacement({across + k * n, -across + k * n}),
           {{c, before}, {b, before}, {c, after}, {b, after}});

  // Seen along the push, the contact spans the centre of mass.
  const Vector3d com_B = geometry::CentreOfMass(*context.ShapeOf(b));
  std::vector<HalfSpaceRow> rows;
  if (contact->form == Contact::Form::kPoint) {
    const double middle = across.dot(com_B);
    rows.push_back({contact->centre_A, across, middle + kPointOffset});
    rows.push_back({contact->centre_A, -across, -middle + kPointOffset});
    sink.Add(Role::kInequality, label + ": behind the centre of mass", MakeHalfSpaces(rows),
             {{b, before}, {a, before}});
  } else {
    const Vector3d along_A = contact->form == Contact::Form::kLine
                                 ? contact->direction_A
                                 : Vector3d(ToolDown(context, a).cross(contact->direction_A).normalized());
    // The object's own half-width, so that the tool reaches over the side that it presses, or half of the
    // tool's.
    const double side =
        std::max(kEndMargin, geometry::Support(*context.ShapeOf(b), across) - across.dot(com_B));
    const double half = contact->half_width - std::min(side, 0.5 * contact->half_width);
    const double middle = along_A.dot(contact->centre_A);
    rows.push_back({com_B, along_A, middle + half});
    rows.push_back({com_B, -along_A, -middle + half});
    sink.Add(Role::kInequality, label + ": behind the centre of mass", MakeHalfSpaces(rows),
             {{a, before}, {b, before}});
  }

  // High enough over the surface, low enough not to tip the object.
  const auto [low, high] = PressHeights(*context.ShapeOf(b), up_B, *contact);
  sink.Add(Role::kInequality, label + ": height of the contact",
           MakeHalfSpaces({{contact->centre_A, up_B, high}, {contact->centre_A, -up_B, -low}}),
           {{b, before}, {a, before}});
  if (const geometry::Shape* surface = context.ShapeOf(c)) {
    const Vector3d up_C = -context.DownFace(c);
    const Vector3d down_A = ToolDown(context, a);
    const Vector3d p_ALow = down_A * geometry::Support(*context.ShapeOf(a), down_A);
    sink.Add(Role::kInequality, label + ": tool over " + context.Name(c),
             MakeHalfSpaces({{p_ALow, -up_C, -geometry::Support(*surface, up_C) - kToolHeight}}),
             {{c, before}, {a, before}});
  }
  sink.Exempt(after, a, b, contact->tool_part);
  // Its height over the surface has a row of its own; the two stay parallel.
  sink.Exempt(before, a, c);
  sink.Exempt(after, a, c);
}

void CheckPushNormal(const Context& context, const Parameters& parameters, Findings& findings) {
  const FrameId a = parameters.Frame("tool");
  const FrameId b = parameters.Frame("object");
  const FrameId c = parameters.Frame("on");
  const int before = context.step() - 1, after = context.step();
  const geometry::Shape* shape_a = context.ShapeOf(a);
  const geometry::Shape* shape_b = context.ShapeOf(b);
  if (shape_a == nullptr || shape_b == nullptr) return;
  const Pose X_WC = context.PoseAt({c, before}), X_WB = context.PoseAt({b, before});
  const Vector3d from = X_WC.Inverse() * X_WB.p;
  const Vector3d to = context.PoseAt({c, after}).Inverse() * context.PoseAt({b, after}).p;
  const Vector3d push_W = X_WC.R * (to - from);
  const std::string label = "push_normal(" + context.Name(a) + ", " + context.Name(b) + ")";
  if (push_W.norm() > 1e-3) {
    // From A, the tool, to B: the contact presses along the normal.
    const geometry::Distance touch =
        geometry::SignedDistance(*shape_a, context.PoseAt({a, before}), *shape_b, X_WB);
    const double angle = std::acos(std::clamp(touch.n_W.dot(push_W.normalized()), -1.0, 1.0));
    findings.Report(label + ": direction within half the friction angle", nlp::Unit::kRadian,
                    angle - HalfFrictionAngle(context, a, b), [&] {
                      // The direction is not why where the tool does not even get there.
                      if (touch.distance > kTouching)
                        return context.Name(a) + " does not get to " + context.Name(b) +
                               " to push it: it would be " + InMillimetres(touch.distance) + " away";
                      return context.Name(b) + " would slip off " + context.Name(a) + ": the push is " +
                             InDegrees(angle) + " off the side's normal, and friction holds " +
                             InDegrees(HalfFrictionAngle(context, a, b));
                    });
  }
}

void GuessSlide(const Context& context, const Parameters& parameters, Pose& X_TC) {
  const FrameId b = parameters.Frame("object");
  const FrameId c = parameters.Frame("on");
  if (context.control() != b || context.target() != c) return;
  const Vector3d up_C = -context.DownFace(c);
  const Pose X_CW = context.PoseAt({c, context.step() - 1}).Inverse();
  Vector3d toward = X_CW * context.X_WBase().p - X_TC.p;
  toward -= up_C * up_C.dot(toward);
  const double far = toward.norm();
  if (far < 1e-6) return;
  // Along the side's normal that is nearest to the direction to the robot: the contact, chosen for the step
  // before, can push so.
  Vector3d best = toward / far;
  double best_cosine = 0.7;
  const geometry::Shape* shape = context.ShapeOf(b);
  for (const geometry::Part& part : shape->parts) {
    for (const FlatSide& side : FlatSides(part)) {
      const Vector3d n = X_TC.R * -side.normal;
      if (n.dot(toward) / far > best_cosine && std::abs(n.dot(up_C)) < 0.1) {
        best = n;
        best_cosine = n.dot(toward) / far;
      }
    }
  }
  X_TC.p += best * std::min(kGuessedPush, 0.5 * far);
}

void BuildSlide(const Context& context, const Parameters& parameters, RowSink& sink) {
  const FrameId b = parameters.Frame("object");
  const FrameId c = parameters.Frame("on");
  const geometry::Shape* shape_b = context.ShapeOf(b);
  const geometry::Shape* shape_c = context.ShapeOf(c);
  if (shape_b == nullptr || shape_c == nullptr)
    return sink.Decline("'" + context.Name(shape_b == nullptr ? b : c) +
                        "' is not solid: nothing slides there");
  const int before = context.step() - 1, after = context.step();
  const std::string label = "slide(" + context.Name(b) + ", " + context.Name(c) + ")";
  const std::vector<FrameAt> frames{{c, before}, {b, before}, {c, after}, {b, after}};
  sink.Add(Role::kEquality, label + ": without turning", MakeRotationChange(), frames);
  const Vector3d up_C = -context.DownFace(c);
  sink.Add(Role::kEquality, label + ": along the surface", MakeDisplacementInTarget({up_C}), frames);
  const geometry::FlatFacet support = geometry::SupportPolygon(*shape_c, up_C);
  const geometry::FlatFacet foot = geometry::SupportPolygon(*shape_b, context.DownFace(b));
  if (support.points.size() < 3) return sink.Decline(NoUpperFace(context, c));
  std::vector<HalfSpaceRow> rows;
  std::vector<Vector3d> points = foot.points;
  if (points.empty() || points.size() > 8) points = {geometry::CentreOfMass(*shape_b)};
  for (const FaceEdge& edge : EdgesOf(support)) {
    for (const Vector3d& p_BQ : points) rows.push_back({p_BQ, edge.normal, edge.offset});
  }
  AddHalfSpaces(Role::kInequality, label + ": stays on it", rows, {{c, after}, {b, after}}, sink);
  sink.Exempt(after, b, c);
}

void CheckSlide(const Context& context, const Parameters& parameters, Findings& findings) {
  const FrameId b = parameters.Frame("object");
  const FrameId c = parameters.Frame("on");
  const geometry::Shape* shape_b = context.ShapeOf(b);
  const geometry::Shape* shape_c = context.ShapeOf(c);
  if (shape_b == nullptr || shape_c == nullptr) return;
  const int before = context.step() - 1, after = context.step();
  const Pose X_CB0 = math::Between(context.PoseAt({c, before}), context.PoseAt({b, before}));
  const Pose X_CB1 = math::Between(context.PoseAt({c, after}), context.PoseAt({b, after}));
  const std::string label = "slide(" + context.Name(b) + ", " + context.Name(c) + ")";
  findings.Report(label + ": without turning", nlp::Unit::kRadian, math::AngleBetween(X_CB0.R, X_CB1.R), [&] {
    return context.Name(b) + " would turn by " + InDegrees(math::AngleBetween(X_CB0.R, X_CB1.R)) +
           " as it slides";
  });
  const double before_gap =
      geometry::SignedDistance(*shape_b, context.PoseAt({b, before}), *shape_c, context.PoseAt({c, before}))
          .distance;
  const double after_gap =
      geometry::SignedDistance(*shape_b, context.PoseAt({b, after}), *shape_c, context.PoseAt({c, after}))
          .distance;
  findings.Report(label + ": along the surface", nlp::Unit::kMetre, std::abs(after_gap - before_gap), [&] {
    return context.Name(b) + " would leave the surface of " + context.Name(c) + " by " +
           InMillimetres(after_gap - before_gap);
  });
}

}  // namespace

Kind TouchKind() {
  return {"touch",
          "The first object, held level, lies against a level side of the second: a sphere or an upright rod "
          "touches it at a point, a lying "
          "rod along a line, a box or a hull with a face. The side of a hull must be upright to within 0.01 "
          "rad. One smooth row for the distance, up to three for the "
          "attitude, and four that keep the contact on the side.",
          "Paper A, eq. (8); ERRATA A2, A12, A13",
          {{"between", ParameterDoc::Type::kFramePair, true, 0, 0, 0, {}, "the tool, and what it touches"}},
          GuessTouch,
          BuildTouch,
          CheckTouch};
}

Kind PushNormalKind() {
  return {"push_normal",
          "Stated at the step that moves the object: the push is well within half the friction angle of the "
          "contact's normal, the contact spans "
          "the centre of mass and is no higher than it, and the tool clears the surface. A push of no length "
          "is allowed.",
          "Paper A, eq. (13); ERRATA A5, A13",
          {{"tool",
            ParameterDoc::Type::kFrame,
            true,
            0,
            0,
            0,
            {},
            "what pushes; touches the object at the step before"},
           {"object", ParameterDoc::Type::kFrame, true, 0, 0, 0, {}, "what is pushed"},
           {"on", ParameterDoc::Type::kFrame, true, 0, 0, 0, {}, "what it is pushed along"}},
          nullptr,
          BuildPushNormal,
          CheckPushNormal};
}

Kind SlideKind() {
  return {"slide",
          "From the step before to this one the object moves along the surface that it stands on: no "
          "turning, no change of height, its "
          "footprint stays over the surface.",
          "Paper A, eq. (15); ERRATA A6, A13",
          {{"object", ParameterDoc::Type::kFrame, true, 0, 0, 0, {}, "what slides"},
           {"on", ParameterDoc::Type::kFrame, true, 0, 0, 0, {}, "what it slides on"}},
          GuessSlide,
          BuildSlide,
          CheckSlide};
}

}  // namespace tether::constraints
