#include <algorithm>
#include <cmath>

#include "tether/common/overloaded.h"
#include "tether/constraints/core/half_space_rows.h"
#include "tether/constraints/core/words.h"
#include "tether/constraints/grasps/grasp.h"
#include "tether/constraints/kinds/kinds.h"
#include "tether/geometry/distance/bounds.h"
#include "tether/geometry/distance/query.h"
#include "tether/geometry/hull/polytope.h"

namespace tether::constraints {
namespace {

using Eigen::Vector3d;
using geometry::Part;
using math::Pose;
using nlp::Role;

/// The margin, reduced so that it leaves room inside a body of this half-extent.
double Fitting(double margin, double half_extent) { return std::min(margin, 0.5 * half_extent); }

void AddSlab(const Pose& X_SP, const Vector3d& axis_P, double half, std::vector<HalfSpaceRow>& rows) {
  const Vector3d n = X_SP.R * axis_P;
  rows.push_back({Vector3d::Zero(), n, n.dot(X_SP.p) + half});
  rows.push_back({Vector3d::Zero(), -n, -n.dot(X_SP.p) + half});
}

/// Rows that keep the origin of A inside one convex part of B. Frames (B, A).
void AddPartRows(const Part& part, double margin, const std::string& label,
                 const std::vector<FrameAt>& frames, RowSink& sink) {
  const Pose& X = part.X_SP;
  std::vector<HalfSpaceRow> rows;
  const auto radial = [&](double radius) {
    sink.Add(Role::kInequality, label + ": off its axis",
             MakeAxisDistance(X.p, X.R.col(2), Vector3d::Zero(), radius - Fitting(margin, radius)), frames);
  };
  std::visit(
      Overloaded{[&](const geometry::Box& box) {
                   for (int i = 0; i < 3; ++i) {
                     const double half = 0.5 * box.size[i];
                     AddSlab(X, Vector3d::Unit(i), half - Fitting(margin, half), rows);
                   }
                 },
                 [&](const geometry::Sphere& sphere) {
                   sink.Add(Role::kInequality, label,
                            MakePointDistance(X.p, Vector3d::Zero(),
                                              sphere.radius - Fitting(margin, sphere.radius), 1),
                            frames);
                 },
                 [&](const geometry::Capsule& capsule) {
                   // Half a finger's width inside the ends of the straight part.
                   const double half = 0.5 * capsule.length;
                   AddSlab(X, Vector3d::UnitZ(), half - Fitting(margin, half), rows);
                   radial(capsule.radius);
                 },
                 [&](const geometry::Cylinder& cylinder) {
                   const double half = 0.5 * cylinder.length;
                   AddSlab(X, Vector3d::UnitZ(), half - Fitting(margin, half), rows);
                   radial(cylinder.radius);
                 },
                 [&](const geometry::Hull& hull) {
                   for (const geometry::Polytope::Face& face : hull.polytope->faces) {
                     const Vector3d n = X.R * face.normal;
                     const double depth = face.offset - face.normal.dot(hull.polytope->centroid);
                     rows.push_back({Vector3d::Zero(), n, n.dot(X.p) + face.offset - Fitting(margin, depth)});
                   }
                 }},
      part.primitive);
  AddHalfSpaces(Role::kInequality, label, rows, frames, sink);
}

/// A region as a solid to be inside of: flat ones are columns without limit along z.
void AddRegionRows(const scene::Region& region, double margin, const std::string& label,
                   const std::vector<FrameAt>& frames, RowSink& sink) {
  std::visit(Overloaded{[&](const geometry::Primitive& primitive) {
                          AddPartRows(Part{primitive, Pose()}, margin, label, frames, sink);
                        },
                        [&](const scene::Disc& disc) {
                          sink.Add(Role::kInequality, label,
                                   MakeAxisDistance(Vector3d::Zero(), Vector3d::UnitZ(), Vector3d::Zero(),
                                                    disc.radius - Fitting(margin, disc.radius)),
                                   frames);
                        },
                        [&](const scene::Rectangle& rectangle) {
                          std::vector<HalfSpaceRow> rows;
                          for (int i = 0; i < 2; ++i) {
                            const double half = 0.5 * rectangle.size[i];
                            AddSlab(Pose(), Vector3d::Unit(i), half - Fitting(margin, half), rows);
                          }
                          sink.Add(Role::kInequality, label, MakeHalfSpaces(std::move(rows)), frames);
                        }},
             region.form);
}

void GuessInside(const Context& context, const Parameters& parameters, Pose& X_TC) {
  // Only for the frame that this step places, relative to the very thing it should be in.
  if (parameters.Frame("frame") != context.control()) return;
  if (parameters.Frame("of") != context.target() || context.control() != context.hand()) return;
  const geometry::Shape* shape = context.ShapeOf(parameters.Frame("of"));
  if (shape == nullptr) return;
  const Part& part = shape->parts[GraspedPart(context, parameters.Frame("of"))];
  // Along the part, as near to where the hand is as the margin allows.
  const double margin = parameters.Number("margin");
  Vector3d p_PC = part.X_SP.Inverse() * X_TC.p;
  const auto clamp_z = [&](double half) {
    half -= Fitting(margin, half);
    p_PC = Vector3d(0, 0, std::clamp(p_PC.z(), -half, half));
  };
  std::visit(Overloaded{[&](const geometry::Box& box) {
                          for (int i = 0; i < 3; ++i) {
                            const double half = 0.5 * box.size[i] - Fitting(margin, 0.5 * box.size[i]);
                            p_PC[i] = std::clamp(p_PC[i], -half, half);
                          }
                        },
                        [&](const geometry::Sphere&) { p_PC.setZero(); },
                        [&](const geometry::Capsule& capsule) { clamp_z(0.5 * capsule.length); },
                        [&](const geometry::Cylinder& cylinder) { clamp_z(0.5 * cylinder.length); },
                        [&](const geometry::Hull& hull) {
                          const auto grasp = ChosenGrasp(context, parameters.Frame("of"));
                          p_PC = grasp ? part.X_SP.Inverse() * grasp->centre_O : hull.polytope->centroid;
                        }},
             part.primitive);
  X_TC.p = part.X_SP * p_PC;
}

void BuildInside(const Context& context, const Parameters& parameters, RowSink& sink) {
  const FrameId frame = parameters.Frame("frame");
  const FrameId of = parameters.Frame("of");
  const double margin = parameters.Number("margin");
  const std::string label = "inside(" + context.Name(frame) + ", " + context.Name(of) + ")";
  const std::vector<FrameAt> frames{{of, context.step()}, {frame, context.step()}};
  if (const scene::Region* region = context.RegionAt(of)) {
    AddRegionRows(*region, margin, label, frames, sink);
  } else if (const geometry::Shape* shape = context.ShapeOf(of)) {
    const int part = frame == context.hand() ? GraspedPart(context, of) : 0;
    AddPartRows(shape->parts[part], margin, label, frames, sink);
  }
}

void CheckInside(const Context& context, const Parameters& parameters, Findings& findings) {
  const FrameId frame = parameters.Frame("frame");
  const FrameId of = parameters.Frame("of");
  const Pose X_OF =
      math::Between(context.PoseAt({of, context.step()}), context.PoseAt({frame, context.step()}));
  const std::string label = "inside(" + context.Name(frame) + ", " + context.Name(of) + ")";
  double distance = 0;
  if (const scene::Region* region = context.RegionAt(of)) {
    const Vector3d& p = X_OF.p;
    distance =
        std::visit(Overloaded{[&](const geometry::Primitive& primitive) {
                                return geometry::DistanceToPoint(primitive, Pose(), p).distance;
                              },
                              [&](const scene::Disc& disc) { return p.head<2>().norm() - disc.radius; },
                              [&](const scene::Rectangle& rectangle) {
                                return (p.head<2>().cwiseAbs() - 0.5 * rectangle.size).maxCoeff();
                              }},
                   region->form);
  } else if (const geometry::Shape* shape = context.ShapeOf(of)) {
    distance = geometry::DistanceToPoint(*shape, Pose(), X_OF.p).distance;
  }
  const std::string what = frame == context.hand() ? "the grasp point" : context.Name(frame);
  findings.Report(label, nlp::Unit::kMetre, distance, [&] {
    return what + " is " + InMillimetres(distance) + " outside of " + context.Name(of);
  });
}

/// Within the ball about the middle of the solid's bounding box.
std::optional<Column> LocateInside(const Context& context, const Parameters& parameters) {
  const FrameId of = parameters.Frame("of");
  if (parameters.Frame("frame") != context.control() || of != context.target()) return std::nullopt;
  const geometry::Shape* shape = context.ShapeOf(of);
  if (shape == nullptr) return std::nullopt;
  const geometry::Aabb box = geometry::BoundingBox(*shape, Pose());
  Vector3d half = 0.5 * (box.upper - box.lower);
  if (shape->parts.size() == 1 && std::holds_alternative<geometry::Box>(shape->parts.front().primitive)) {
    const double margin = parameters.Number("margin");
    for (double& extent : half) extent -= Fitting(margin, extent);
  }
  return Column{0.5 * (box.lower + box.upper), Vector3d::UnitZ(), half.head<2>().norm(), half.z()};
}

}  // namespace

Kind InsideKind() {
  return {"inside",
          "The origin of a frame lies inside an object or a region. The margin keeps it away from the "
          "boundary, by half the body's "
          "extent at most; along a capsule it is taken from the ends of its axis. A flat region has no limit "
          "along its normal.",
          "Paper A, eq. (6); ERRATA A2, A13",
          {{"frame",
            ParameterDoc::Type::kFrame,
            true,
            0,
            0,
            0,
            {},
            "frame whose origin it is; `moved` is the step's control frame"},
           {"of", ParameterDoc::Type::kFrame, true, 0, 0, 0, {}, "object or region to be inside of"},
           {"margin", ParameterDoc::Type::kNumber, false, 0, 0, 1, {}, "distance to the boundary, m"}},
          GuessInside,
          BuildInside,
          CheckInside,
          LocateInside};
}

}  // namespace tether::constraints
