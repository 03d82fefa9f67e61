#include "tether/planning/program/step_context.h"

#include <algorithm>
#include <cmath>
#include <variant>

#include "tether/geometry/polygon/support.h"

namespace tether::planning {
namespace {

// An object whose face is within this of level stands on that face, rad.
constexpr double kNearlyLevel = 0.15;
// What the hand holds can be turned: it is put down on the face that is nearest to level, rad.
constexpr double kHeldLevel = 1.0;
// Of what is thinner, faces are looked at as those of any shape, m.
constexpr double kThinnest = 1e-3;
// The hand of a planner without a robot: two fingers of common size.
constexpr double kFingerRadius = 0.01;
constexpr double kFingerLength = 0.06;
constexpr double kFingerSpread = 0.1;

Eigen::Vector3d FindDownFace(const geometry::Shape& shape, const math::Pose& X_WO, double level) {
  const Eigen::Vector3d down = X_WO.R.transpose() * -Eigen::Vector3d::UnitZ();
  // A box rests on each of its sides. Scenes have many, of which few are ever moved.
  if (const auto* box = std::get_if<geometry::Box>(&shape.parts.front().primitive);
      box != nullptr && !shape.is_compound() && box->size.minCoeff() > kThinnest) {
    Eigen::Vector3d nearest = down;
    double least = level;
    for (int axis = 0; axis < 3; ++axis) {
      for (const Eigen::Vector3d& normal : {Eigen::Vector3d(shape.parts.front().X_SP.R.col(axis)),
                                            Eigen::Vector3d(-shape.parts.front().X_SP.R.col(axis))}) {
        const double angle = std::acos(std::min(1.0, normal.dot(down)));
        if (angle >= least) continue;
        nearest = normal;
        least = angle;
      }
    }
    return nearest;
  }
  Eigen::Vector3d best = down;
  double best_angle = level;
  for (const geometry::FlatFacet& face : geometry::RestingFaces(shape, geometry::CentreOfMass(shape))) {
    const double angle = std::acos(std::min(1.0, face.normal.dot(down)));
    if (angle < best_angle) {
      best = face.normal;
      best_angle = angle;
    }
  }
  return best;
}

geometry::Shape DefaultHand() {
  std::vector<geometry::Part> parts;
  for (int side : {-1, 1}) {
    parts.push_back({geometry::Capsule{kFingerRadius, kFingerLength},
                     math::Pose(Eigen::Vector3d(0, side * 0.5 * kFingerSpread, -0.5 * kFingerLength))});
  }
  return geometry::Shape(parts);
}

}  // namespace

SceneFacts::SceneFacts(const Problem& problem)
    : problem_(problem),
      frames_(std::make_shared<scene::Frames>(problem.scene)),
      base_(frames_->Find(problem.robot.name)),
      holds_(frames_->Find(problem.robot.holds)) {
  const auto& model = problem.robot.model;
  hand_ = model != nullptr ? model->HandShape(model->gripper().max_opening) : DefaultHand();
  for (const ObjectId id : frames_->objects()) {
    const scene::Object& object = problem.scene.object(id);
    down_.push_back(FindDownFace(object.shape, problem.scene.InitialPose(object.name),
                                 object.name == problem.robot.holds ? kHeldLevel : kNearlyLevel));
    solids_.push_back(scene::Frames::Of(id));
  }
  solids_.push_back(hand());
}

const geometry::Shape* SceneFacts::ShapeOf(FrameId frame) const {
  if (frame == hand()) return &hand_;
  const ObjectId object = frames_->ObjectOf(frame);
  return object.valid() ? &problem_.scene.object(object).shape : nullptr;
}

StepContext::StepContext(const SceneFacts& facts, const constraints::KnownOfProgram& known,
                         const FrameTree& tree, const std::vector<math::Pose>& poses, int step,
                         const BoundStep& bound, Chooser chooser)
    : facts_(facts),
      known_(known),
      tree_(tree),
      poses_(poses),
      bound_(bound),
      step_(step),
      chooser_(std::move(chooser)) {
  for (const BoundConstraint& constraint : bound.constraints) {
    if (constraint.kind->name == "graspable") approach_ = constraint.parameters.Text("approach");
  }
}

std::optional<double> StepContext::grip_force(FrameId object) const {
  std::optional<double> force;
  for (size_t i = 0; i < bound_.close_on.size(); ++i) {
    if (bound_.close_on[i] == object)
      force = std::max(force.value_or(0), std::get<GripperVerb>(bound_.schema.execute[i]).force);
  }
  return force;
}

std::optional<double> StepContext::grip_margin(FrameId object) const {
  for (const BoundConstraint& constraint : bound_.constraints) {
    if (constraint.kind->name != "inside" || constraint.parameters.Frame("of") != object) continue;
    if (constraint.parameters.Frame("frame") == hand()) return constraint.parameters.Number("margin");
  }
  return std::nullopt;
}

Eigen::Vector3d StepContext::DownFace(FrameId object) const {
  // The hand's own down face is its approach direction.
  return object == hand() ? Eigen::Vector3d(Eigen::Vector3d::UnitZ()) : facts_.DownFace(object);
}

}  // namespace tether::planning
