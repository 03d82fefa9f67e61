#include <algorithm>
#include <cmath>
#include <limits>

#include "tether/common/text.h"
#include "tether/constraints/core/field_function.h"
#include "tether/constraints/grasps/top_grasp.h"
#include "tether/control/objective.h"
#include "tether/execution/servo/velocity_servo.h"
#include "tether/geometry/distance/query.h"
#include "tether/geometry/polygon/support.h"
#include "tether/planning/modes/grip_load.h"

namespace tether::execution {
namespace {

using control::Objective;
using Eigen::Vector3d;
using math::Pose;

// A shift ends this near to where it leads, m.
constexpr double kShiftTolerance = 0.006, kShiftTurnTolerance = 0.1;
// Where there is no room to open the hand fully: the least opening, and the steps in which openings are
// tried, m.
constexpr double kLeastOpening = 0.015, kOpeningStep = 0.005, kNoRoom = 1e-4;
// Wider than what is to be grasped, when that is tried again, m.
constexpr double kNarrowOpening = 0.05;
// Metres that a radian of error counts.
constexpr double kRadian = 0.3;
constexpr double kFirstSpeed = 0.05;
// A reach is not done before its constraints hold to within this, m and rad.
constexpr double kKept = 5e-4, kKeptAngle = 5e-3;
// Slower joints are at rest, rad/s; no longer is waited for them, s.
constexpr double kAtRest = 0.02, kMostBraking = 1;

/// `R` turned the least so that its axis `axis` points along `to`.
Eigen::Matrix3d Align(const Eigen::Matrix3d& R, const Vector3d& axis, const Vector3d& to) {
  return Eigen::Quaterniond::FromTwoVectors(R * axis, to).toRotationMatrix() * R;
}

/// A direction of an object, or the axis of it that is nearly there: things stand on their faces.
Vector3d SnapToAxis(const Vector3d& direction) {
  for (int i = 0; i < 3; ++i) {
    if (std::abs(direction[i]) > 0.9) return Vector3d::Unit(i) * (direction[i] > 0 ? 1 : -1);
  }
  return direction;
}

double InnerRadius(const scene::RegionForm& form) {
  const auto* solid = std::get_if<geometry::Primitive>(&form);
  return solid == nullptr
             ? 0.0
             : std::max(0.0, -geometry::DistanceToPoint(*solid, Pose(), Vector3d::Zero()).distance);
}

}  // namespace

Pose VelocityServo::X_WTarget(const control::Frame& target) const {
  const Pose X_WFrame = target.object < 0 ? control_scene_.X_WBase() : s_.objects[ObjectId(target.object)].X;
  return X_WFrame * target.X_OF;
}

double VelocityServo::TopAbove(const scene::Region& region, const Pose& X_WR) const {
  double top = 0;
  const auto* disc = std::get_if<scene::Disc>(&region.form);
  const auto* rectangle = std::get_if<scene::Rectangle>(&region.form);
  for (const ObjectId i : s_.objects.ids()) {
    if (!s_.object(i).movable() || i == s_.held) continue;
    const Vector3d p = X_WR.Inverse() * s_.objects[i].X.p;
    const bool over = disc != nullptr ? p.head<2>().norm() <= disc->radius
                                      : rectangle != nullptr && std::abs(p.x()) <= rectangle->size.x() / 2 &&
                                            std::abs(p.y()) <= rectangle->size.y() / 2;
    if (!over) continue;
    const Vector3d up_O = s_.objects[i].X.R.transpose() * X_WR.R.col(2);
    top = std::max(top, p.z() + geometry::Support(s_.object(i).shape, up_O));
  }
  return top;
}

Vector3d VelocityServo::FootOf(ObjectId object, const Vector3d& up_W, double* radius) const {
  const geometry::Shape& shape = s_.object(object).shape;
  const Vector3d up = SnapToAxis(s_.objects[object].X.R.transpose() * up_W);
  const Vector3d across = up.unitOrthogonal(), other = up.cross(across);
  *radius = 0;
  for (int k = 0; k < 16; ++k) {
    const double angle = 2 * M_PI * k / 16;
    *radius = std::max(*radius, geometry::Support(shape, std::cos(angle) * across + std::sin(angle) * other));
  }
  return -up * geometry::Support(shape, -up);
}

std::optional<Pose> VelocityServo::KeyPose(Progress* missing) {
  const ResolvedStep& step = s_.current();
  if (step.X_TC) return step.X_TC;
  const ObjectId target = step.region < 0 ? step.target.object : kNone;
  if (step.control != kNone || !target.valid()) {
    *missing = Progress::Failed(EventKind::kFailed, "the plan has no key pose for " + step.schema.control +
                                                        " relative to " + step.schema.target);
    return std::nullopt;
  }
  if (grasp_) return grasp_;
  const scene::Object& object = s_.object(target);
  constraints::GraspFlaws flaws;
  Eigen::Matrix3d R_WH = s_.X_WH.R;
  // Turned by half a turn, after two tries: fingers need not be alike on both sides.
  if (s_.record().attempts > 2) R_WH.leftCols<2>() *= -1;
  const auto found = constraints::FindTopGrasp(*s_.model, object.shape, s_.X_WO(target), R_WH,
                                               planning::LoadOf(object, step.schema), &flaws);
  if (!found) {
    *missing =
        Progress::GiveUp(EventKind::kFailed,
                         "'" + object.name + "' can't be grasped from above: " + flaws.Describe(object.name));
    return std::nullopt;
  }
  grasp_ = s_.record().X_TC = found->X_OH;
  grasp_width_ = found->width;
  return grasp_;
}

Pose VelocityServo::Offset(const Vector3d& offset, planning::In in, const Pose& X_TF,
                           const Pose& X_WT) const {
  Pose moved = X_TF;
  switch (in) {
    case planning::In::kControl:
      moved.p += X_TF.R * offset;
      break;
    case planning::In::kTarget:
      moved.p += offset;
      break;
    case planning::In::kHand:
      moved.p += X_WT.R.transpose() * (s_.X_WH.R * offset);
      break;
    case planning::In::kWorld:
      moved.p += X_WT.R.transpose() * offset;
      break;
  }
  return moved;
}

void VelocityServo::EnterRegionReach(const planning::ReachVerb& reach, const scene::Region& region) {
  const bool hand = s_.current().control == kNone;
  const control::Frame target = control_scene_.Target(s_.current().target);
  const Pose X_WT = X_WTarget(target);
  const bool solid = std::holds_alternative<geometry::Primitive>(region.form);
  control::Frame frame;
  double radius = 0;
  Pose X_WF = s_.X_WH;
  if (!hand) {
    frame.object = s_.held.value();
    frame.X_OF.p = FootOf(s_.held, X_WT.R.col(2), &radius);
    if (solid) frame.X_OF = Pose();
    X_WF = s_.objects[s_.held].X * frame.X_OF;
  }
  const Pose X_TF_now = math::Between(X_WT, X_WF);
  const Vector3d up_F =
      hand ? Vector3d(-Vector3d::UnitZ()) : SnapToAxis(X_TF_now.R.transpose() * Vector3d::UnitZ());
  Pose X_TF;
  X_TF.R = Align(X_TF_now.R, up_F, Vector3d::UnitZ());
  if (!solid) {
    const double lift =
        reach.above > 0 ? reach.above + TopAbove(region, X_WT) : (hand ? 0 : options_.foot_gap);
    X_TF.p.z() = lift;
  }
  X_TF = Offset(reach.offset, reach.in, X_TF, X_WT);
  Objective objective = hand ? Objective::kPosition : Objective::kDistance;
  if (!reach.objective.empty()) objective = *control::FindObjective(reach.objective);
  goal_ = control::Goal{};
  goal_->target = target;
  goal_->frame = frame;
  goal_->functions = control::MakeObjective(objective, X_TF);
  tolerance_m_ = reach.position_tolerance;
  tolerance_rad_ = reach.rotation_tolerance;
  if (solid) {
    // Anywhere well inside will do: one degree of freedom, the distance to the middle.
    const double inner = 0.5 * InnerRadius(region.form);
    if (objective == Objective::kDistance) {
      const double now = X_TF_now.p.norm();
      goal_->functions = {
          constraints::MakePointDistance(Vector3d::Zero(), Vector3d::Zero(), std::min(inner, now), 1)};
    }
    tolerance_m_ = std::max(tolerance_m_, 0.8 * inner);
  }

  std::vector<control::FieldConstraint> fields;
  const RegionReach arrival{target, frame,  X_TF_now.p,
                            up_F,   radius, std::max(0.0, X_TF.p.z()) + reach.position_tolerance};
  for (const control::ConstraintSpec& spec : s_.current().specs[s_.verb]) {
    if (spec.kind == "cone" || spec.kind == "upright") {
      if (!solid) fields.push_back(BuildRegionField(spec, region, arrival, options_.controller.buffer));
    } else {
      fields.push_back(BuildField(spec, control_scene_));
    }
  }
  verb_fields_ = fields;
  if (drive_) drive_->SetExtraFields(fields);
  controller_.SetExtraFields(std::move(fields));
}

Progress VelocityServo::EnterFrameReach(const planning::ReachVerb& reach) {
  verb_fields_.clear();
  Progress missing;
  const auto X_TC = KeyPose(&missing);
  if (!X_TC) return missing;
  const bool again = s_.record().attempts > 1;
  if (again && grasp_ && !s_.held.valid() && s_.gripper.mode == robot::GripperCommand::Mode::kOpening) {
    // What is beside the object may have obstructed an open hand.
    s_.gripper.opening = std::min(s_.model->gripper().max_opening, grasp_width_ + kNarrowOpening);
  }
  const control::Frame target = control_scene_.Target(s_.current().target);
  goal_ = control::Goal{};
  goal_->target = target;
  if (s_.current().control != kNone) goal_->frame.object = s_.held.value();
  const Pose X_TF = Offset(reach.offset, reach.in, *X_TC, X_WTarget(target));
  const Objective objective =
      reach.objective.empty() ? Objective::kPose : *control::FindObjective(reach.objective);
  goal_->functions = control::MakeObjective(objective, X_TF);
  tolerance_m_ = reach.position_tolerance;
  tolerance_rad_ = reach.rotation_tolerance;
  return Progress::Running();
}

// An arm driven by torques can't turn at once into a cone that begins where it is: it stops before.
bool VelocityServo::ComesToRest() {
  const std::vector<control::ConstraintSpec>& specs = s_.current().specs[s_.verb];
  if (!drive_ || !schema().target_is_region || specs.empty()) return false;
  if (braked_since_ < 0) braked_since_ = s_.time;
  return s_.time < braked_since_ + kMostBraking && s_.v.cwiseAbs().maxCoeff() > kAtRest;
}

Progress VelocityServo::EnterReach(const planning::ReachVerb& reach) {
  if (s_.current().control != kNone && s_.current().control != s_.held) {
    return Progress::Failed(EventKind::kFailed, "the hand does not hold '" + schema().control + "'");
  }
  speed_ = reach.speed;
  if (s_.region() == nullptr) return EnterFrameReach(reach);
  EnterRegionReach(reach, *s_.region());
  return Progress::Running();
}

Progress VelocityServo::Reach(const planning::ReachVerb& reach) {
  if (!entered_) {
    watch_.Start(s_.time);
    if (ComesToRest()) return Progress::Running();
    const Progress entered = EnterReach(reach);
    if (entered.state != Progress::State::kRunning) return entered;
    entered_ = true;
    goal_->speed = std::min(speed_, kFirstSpeed);
    goal_->turn_speed = options_.turn_speed;
    if (IsFreeMotion(reach)) BeginTransit(reach);
    return Progress::Running();
  }
  if (transit_.active()) return FollowTransit(reach);
  if (!path_.empty()) return WatchProgress(0);
  goal_->speed = std::min(speed_, kFirstSpeed + options_.acceleration * (s_.time - watch_.start()));
  const double error_m = controller_.error_m(), error_rad = controller_.error_rad();
  StepRecord& record = s_.record();
  record.position_error = error_m;
  record.rotation_error = error_rad;
  const double off_m = controller_.extra_violation_m(), off_rad = controller_.extra_violation_rad();
  const bool kept = off_m <= kKept && off_rad <= kKeptAngle;
  if (error_m <= tolerance_m_ && error_rad <= tolerance_rad_ && kept) return Progress::Done();
  return WatchProgress(error_m + off_m + kRadian * (error_rad + off_rad));
}

Progress VelocityServo::Shift(const planning::ShiftVerb& shift) {
  if (!entered_) {
    watch_.Start(s_.time);
    verb_fields_.clear();
    tolerance_m_ = kShiftTolerance;
    tolerance_rad_ = kShiftTurnTolerance;
    goal_ = control::Goal{};
    const Pose X_WT = X_WTarget(control_scene_.Target(s_.current().target));
    Vector3d by = shift.by;
    if (shift.in == planning::In::kHand || shift.in == planning::In::kControl) by = s_.X_WH.R * by;
    if (shift.in == planning::In::kTarget) by = X_WT.R * by;
    const Pose X_WGoal(s_.X_WH.R, s_.X_WH.p + by);
    goal_pose_ = control_scene_.X_WBase().Inverse() * X_WGoal;
    goal_->functions = control::MakeObjective(Objective::kPose, goal_pose_);
    goal_->speed = std::min(shift.speed, kFirstSpeed);
    goal_->turn_speed = options_.turn_speed;
    speed_ = shift.speed;
    along_ = kNone;
    entered_ = true;
    return Progress::Running();
  }
  if (!path_.empty()) return WatchProgress(0);
  GoAlong(true);
  goal_->speed = std::min(speed_, kFirstSpeed + options_.acceleration * (s_.time - watch_.start()));
  if (controller_.error_m() <= kShiftTolerance) return Progress::Done();
  return WatchProgress(controller_.error_m());
}

double VelocityServo::WidestOpening() {
  control::ConstrainedVelocity probe = MakeController();
  probe.Allow(allowed_bodies_);
  if (s_.held.valid()) probe.Hold(s_.held.value());
  const auto least_room = [&](double wide) {
    probe.Compute({s_.q, wide, s_.objects.values()}, nullptr);
    double least = std::numeric_limits<double>::infinity();
    for (int i = 0; i < probe.num_rows(); ++i) {
      const control::ConstrainedVelocity::Row& row = probe.row(i);
      if (row.a < 0 || row.priority > 0) continue;
      const bool hand = probe.bodies().link(row.a) == s_.model->dof() && !probe.bodies().is_object(row.a);
      if (hand) least = std::min(least, row.value);
    }
    return least;
  };
  const double now = std::min(0.0, least_room(s_.opening));
  const double widest = s_.model->gripper().max_opening;
  double wide = s_.opening;
  // Along the whole opening: fingers on hinges may come nearest in between.
  while (wide < widest && least_room(std::min(wide + kOpeningStep, widest)) >= now - kNoRoom)
    wide += kOpeningStep;
  return std::min(s_.held.valid() ? std::max(wide, s_.opening + kLeastOpening) : wide, widest);
}

}  // namespace tether::execution
