#include <algorithm>
#include <cmath>
#include <limits>

#include "tether/common/text.h"
#include "tether/constraints/core/field_function.h"
#include "tether/constraints/grasps/top_grasp.h"
#include "tether/control/objective.h"
#include "tether/execution/observer/grasp_width.h"
#include "tether/execution/sequencer/velocity_executive_impl.h"
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
// The gripper has settled when its opening changes by less than this for so long.
constexpr double kSettledOpening = 5e-4, kSettledTime = 0.3, kGripperTimeout = 2.5;
// Where there is no room to open the hand fully: the least opening, and the steps in which openings are
// tried, m.
constexpr double kLeastOpening = 0.015, kOpeningStep = 0.005, kNoRoom = 1e-4;
// Wider than what is to be grasped, when that is tried again, m.
constexpr double kNarrowOpening = 0.05;
// Progress is this much of error (m, a radian counts a third) within the stall time.
constexpr double kProgress = 5e-4, kRadian = 0.3;
constexpr double kFirstSpeed = 0.05;
constexpr double kWaypoint = 0.04;  // rad
// A reach is not done before its constraints hold to within this, m and rad.
constexpr double kKept = 5e-4, kKeptAngle = 5e-3;

std::string Length(double metres) {
  char text[40];
  if (metres < 1)
    FormatInto(text, sizeof text, "%.1f mm", 1000 * metres);
  else
    FormatInto(text, sizeof text, "%.1f m", metres);
  return text;
}

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

using Outcome = VelocityExecutive::Impl::Outcome;

Pose VelocityExecutive::Impl::X_WTarget(const control::Frame& target) const {
  const Pose X_WFrame =
      target.object < 0 ? control_scene.X_WBase() : objects[static_cast<size_t>(target.object)].X;
  return X_WFrame * target.X_OF;
}

double VelocityExecutive::Impl::TopAbove(const scene::Region& region, const Pose& X_WR) const {
  double top = 0;
  const auto* disc = std::get_if<scene::Disc>(&region.form);
  const auto* rectangle = std::get_if<scene::Rectangle>(&region.form);
  for (size_t i = 0; i < objects.size(); ++i) {
    if (!scene.objects[i].movable() || static_cast<int>(i) == held) continue;
    const Vector3d p = X_WR.Inverse() * objects[i].X.p;
    const bool over = disc != nullptr ? p.head<2>().norm() <= disc->radius
                                      : rectangle != nullptr && std::abs(p.x()) <= rectangle->size.x() / 2 &&
                                            std::abs(p.y()) <= rectangle->size.y() / 2;
    if (!over) continue;
    const Vector3d up_O = objects[i].X.R.transpose() * X_WR.R.col(2);
    top = std::max(top, p.z() + geometry::Support(scene.objects[i].shape, up_O));
  }
  return top;
}

Vector3d VelocityExecutive::Impl::FootOf(int object, const Vector3d& up_W, double* radius) const {
  const geometry::Shape& shape = scene.objects[static_cast<size_t>(object)].shape;
  const Vector3d up = SnapToAxis(objects[static_cast<size_t>(object)].X.R.transpose() * up_W);
  const Vector3d across = up.unitOrthogonal(), other = up.cross(across);
  *radius = 0;
  for (int k = 0; k < 16; ++k) {
    const double angle = 2 * M_PI * k / 16;
    *radius = std::max(*radius, geometry::Support(shape, std::cos(angle) * across + std::sin(angle) * other));
  }
  return -up * geometry::Support(shape, -up);
}

std::optional<Pose> VelocityExecutive::Impl::KeyPose() {
  BoundVelocityStep& step = steps[static_cast<size_t>(at)];
  if (step.X_TC) return step.X_TC;
  const int target = control_scene.ObjectIndex(step.schema.target);
  if (step.schema.control != "hand" || target < 0) {
    Fail("the plan has no key pose for " + step.schema.control + " relative to " + step.schema.target);
    return std::nullopt;
  }
  if (grasp) return grasp;
  const scene::Object& object = scene.objects[static_cast<size_t>(target)];
  constraints::GraspFlaws flaws;
  Eigen::Matrix3d R_WH = X_WH.R;
  // Turned by half a turn, after two tries: fingers need not be alike on both sides.
  if (records[static_cast<size_t>(at)].attempts > 2) R_WH.leftCols<2>() *= -1;
  const auto found = constraints::FindTopGrasp(*model, object.shape, objects[static_cast<size_t>(target)].X,
                                               R_WH, planning::LoadOf(object, step.schema), &flaws);
  if (!found) {
    GiveUpAction("'" + object.name + "' can't be grasped from above: " + flaws.Describe(object.name));
    return std::nullopt;
  }
  grasp = plan.steps[static_cast<size_t>(at)].X_TC = found->X_OH;
  grasp_width = found->width;
  return grasp;
}

Pose VelocityExecutive::Impl::Offset(const Vector3d& offset, planning::In in, const Pose& X_TF,
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
      moved.p += X_WT.R.transpose() * (X_WH.R * offset);
      break;
    case planning::In::kWorld:
      moved.p += X_WT.R.transpose() * offset;
      break;
  }
  return moved;
}

bool VelocityExecutive::Impl::EnterRegionReach(const planning::ReachVerb& reach,
                                               const scene::Region& region) {
  const bool hand = schema().control == "hand";
  const control::Frame target = control_scene.Target(region.name);
  const Pose X_WT = X_WTarget(target);
  const bool solid = std::holds_alternative<geometry::Primitive>(region.form);
  control::Frame frame;
  double radius = 0;
  Pose X_WF = X_WH;
  if (!hand) {
    frame.object = held;
    frame.X_OF.p = FootOf(held, X_WT.R.col(2), &radius);
    if (solid) frame.X_OF = Pose();
    X_WF = objects[static_cast<size_t>(held)].X * frame.X_OF;
  }
  const Pose X_TF_now = math::Between(X_WT, X_WF);
  const Vector3d up_F =
      hand ? Vector3d(-Vector3d::UnitZ()) : SnapToAxis(X_TF_now.R.transpose() * Vector3d::UnitZ());
  Pose X_TF;
  X_TF.R = Align(X_TF_now.R, up_F, Vector3d::UnitZ());
  if (!solid) {
    const double lift =
        reach.above > 0 ? reach.above + TopAbove(region, X_WT) : (hand ? 0 : options.foot_gap);
    X_TF.p.z() = lift;
  }
  X_TF = Offset(reach.offset, reach.in, X_TF, X_WT);
  Objective objective = hand ? Objective::kPosition : Objective::kDistance;
  if (!reach.objective.empty()) objective = *control::FindObjective(reach.objective);
  goal = control::Goal{};
  goal->target = target;
  goal->frame = frame;
  goal->functions = control::MakeObjective(objective, X_TF);
  tolerance_m = reach.position_tolerance;
  tolerance_rad = reach.rotation_tolerance;
  if (solid) {
    // Anywhere well inside will do: one degree of freedom, the distance to the middle.
    const double inner = 0.5 * InnerRadius(region.form);
    if (objective == Objective::kDistance) {
      const double now = X_TF_now.p.norm();
      goal->functions = {
          constraints::MakePointDistance(Vector3d::Zero(), Vector3d::Zero(), std::min(inner, now), 1)};
    }
    tolerance_m = std::max(tolerance_m, 0.8 * inner);
  }

  Diagnostics ignored;  // binding has reported them
  std::vector<control::FieldConstraint> fields;
  const auto specs = reach.constraints.is_null()
                         ? std::vector<control::ConstraintSpec>{}
                         : control::ReadConstraintSpecs(
                               reach.constraints, control::ConstraintPlace::kRegionVerb, Names(), ignored);
  const RegionReach arrival{target, frame,  X_TF_now.p,
                            up_F,   radius, std::max(0.0, X_TF.p.z()) + reach.position_tolerance};
  for (const control::ConstraintSpec& spec : specs) {
    if (spec.kind == "cone" || spec.kind == "upright") {
      if (!solid) fields.push_back(BuildRegionField(spec, region, arrival, options.controller.buffer));
    } else {
      fields.push_back(BuildField(spec, control_scene));
    }
  }
  verb_fields = fields;
  controller.SetExtraFields(std::move(fields));
  return true;
}

bool VelocityExecutive::Impl::EnterFrameReach(const planning::ReachVerb& reach) {
  verb_fields.clear();
  const auto X_TC = KeyPose();
  if (!X_TC) return false;
  const bool again = records[static_cast<size_t>(at)].attempts > 1;
  if (again && grasp && held < 0 && gripper.mode == robot::GripperCommand::Mode::kOpening) {
    // What is beside the object may have obstructed an open hand.
    gripper.opening = std::min(model->gripper().max_opening, grasp_width + kNarrowOpening);
  }
  const control::Frame target = control_scene.Target(schema().target);
  goal = control::Goal{};
  goal->target = target;
  if (schema().control != "hand") goal->frame.object = held;
  const Pose X_TF = Offset(reach.offset, reach.in, *X_TC, X_WTarget(target));
  const Objective objective =
      reach.objective.empty() ? Objective::kPose : *control::FindObjective(reach.objective);
  goal->functions = control::MakeObjective(objective, X_TF);
  tolerance_m = reach.position_tolerance;
  tolerance_rad = reach.rotation_tolerance;
  return true;
}

bool VelocityExecutive::Impl::EnterReach(const planning::ReachVerb& reach) {
  if (schema().control != "hand" && schema().control != held_name) {
    Fail("the hand does not hold '" + schema().control + "'");
    return false;
  }
  speed = reach.speed;
  if (schema().target_is_region) return EnterRegionReach(reach, *scene.FindRegion(schema().target));
  return EnterFrameReach(reach);
}

Outcome VelocityExecutive::Impl::RunVerb() {
  const planning::Verb& now = schema().execute[verb];
  if (!entered) {
    verb_start = progress_time = time;
    best_error = std::numeric_limits<double>::infinity();
  }
  return std::visit([this](const auto& one) { return Run(one); }, now);
}

Outcome VelocityExecutive::Impl::Run(const planning::ReachVerb& reach) {
  if (!entered) {
    if (!EnterReach(reach)) return Outcome::kAborted;
    entered = true;
    goal->speed = std::min(speed, kFirstSpeed);
    goal->turn_speed = options.turn_speed;
    return Outcome::kRunning;
  }
  if (!path.empty()) return WatchProgress(0);
  goal->speed = std::min(speed, kFirstSpeed + options.acceleration * (time - verb_start));
  const double error_m = controller.error_m(), error_rad = controller.error_rad();
  StepRecord& record = records[static_cast<size_t>(at)];
  record.position_error = error_m;
  record.rotation_error = error_rad;
  const double off_m = controller.extra_violation_m(), off_rad = controller.extra_violation_rad();
  const bool kept = off_m <= kKept && off_rad <= kKeptAngle;
  if (error_m <= tolerance_m && error_rad <= tolerance_rad && kept) return Outcome::kDone;
  return WatchProgress(error_m + off_m + kRadian * (error_rad + off_rad));
}

Outcome VelocityExecutive::Impl::Run(const planning::ShiftVerb& shift) {
  if (!entered) {
    verb_fields.clear();
    tolerance_m = kShiftTolerance;
    tolerance_rad = kShiftTurnTolerance;
    goal = control::Goal{};
    const Pose X_WT = X_WTarget(control_scene.Target(schema().target));
    Vector3d by = shift.by;
    if (shift.in == planning::In::kHand || shift.in == planning::In::kControl) by = X_WH.R * by;
    if (shift.in == planning::In::kTarget) by = X_WT.R * by;
    const Pose X_WGoal(X_WH.R, X_WH.p + by);
    goal_pose = control_scene.X_WBase().Inverse() * X_WGoal;
    goal->functions = control::MakeObjective(Objective::kPose, goal_pose);
    goal->speed = std::min(shift.speed, kFirstSpeed);
    goal->turn_speed = options.turn_speed;
    speed = shift.speed;
    along = -1;
    entered = true;
    return Outcome::kRunning;
  }
  if (!path.empty()) return WatchProgress(0);
  GoAlong(true);
  goal->speed = std::min(speed, kFirstSpeed + options.acceleration * (time - verb_start));
  if (controller.error_m() <= kShiftTolerance) return Outcome::kDone;
  return WatchProgress(controller.error_m());
}

double VelocityExecutive::Impl::FreeOpening() {
  control::ConstrainedVelocity probe = MakeController();
  probe.Allow(allowed_bodies);
  if (held >= 0) probe.Hold(held);
  const auto least_room = [&](double wide) {
    probe.Compute({q, wide, objects}, nullptr);
    double least = std::numeric_limits<double>::infinity();
    for (int i = 0; i < probe.num_rows(); ++i) {
      const control::ConstrainedVelocity::Row& row = probe.row(i);
      if (row.a < 0 || row.priority > 0) continue;
      const bool hand = probe.bodies().link(row.a) == model->dof() && !probe.bodies().is_object(row.a);
      if (hand) least = std::min(least, row.value);
    }
    return least;
  };
  const double now = std::min(0.0, least_room(opening));
  const double widest = model->gripper().max_opening;
  double wide = opening;
  // Along the whole opening: fingers on hinges may come nearest in between.
  while (wide < widest && least_room(std::min(wide + kOpeningStep, widest)) >= now - kNoRoom)
    wide += kOpeningStep;
  return std::min(held >= 0 ? std::max(wide, opening + kLeastOpening) : wide, widest);
}

Outcome VelocityExecutive::Impl::Run(const planning::GripperVerb& grip) {
  const robot::Gripper& limits = model->gripper();
  const bool open = grip.close_on.empty();
  if (!entered) {
    entered = true;
    last_opening = opening;
    quiet_since = time;
    gripper.mode = open ? robot::GripperCommand::Mode::kOpening : robot::GripperCommand::Mode::kForce;
    gripper.opening = open ? FreeOpening() : limits.max_opening;
    gripper.force = std::min(grip.force, limits.max_force);
    if (open && held >= 0) {
      Record(EventKind::kReleased, "'" + held_name + "'");
      released = held;
      Release();
    }
    along = -1;
    GoAlong(false);
  }
  // Fingers that close on something move it: the hand does not follow that motion.
  if (open) GoAlong(false);
  if (std::abs(opening - last_opening) > kSettledOpening) {
    last_opening = opening;
    quiet_since = time;
  }
  const double elapsed = time - verb_start;
  const bool settled = time - quiet_since > kSettledTime && elapsed > 2 * kSettledTime;
  if (open) {
    const bool wide = opening > 0.97 * gripper.opening;
    return wide || settled || elapsed > kGripperTimeout ? Outcome::kDone : Outcome::kRunning;
  }
  if (!settled && elapsed < kGripperTimeout) return Outcome::kRunning;
  const int object = control_scene.ObjectIndex(grip.close_on);
  const std::string wrong = object < 0
                                ? "nothing"
                                : WrongWidth(opening, scene.objects[static_cast<size_t>(object)].shape,
                                             math::Between(X_WH, objects[static_cast<size_t>(object)].X),
                                             limits, options.least_width);
  if (!wrong.empty()) {
    gripper.mode = robot::GripperCommand::Mode::kOpening;
    Abort(EventKind::kGraspMissed, "the gripper closed on " + wrong + " instead of '" + grip.close_on + "'",
          true);
    return Outcome::kAborted;
  }
  Hold(object);
  Record(EventKind::kGrasped, "'" + held_name + "', " + Length(opening) + " wide");
  return Outcome::kDone;
}

Outcome VelocityExecutive::Impl::Run(const planning::WaitVerb& wait) {
  if (!entered) along = -1;
  entered = true;
  GoAlong(false);
  const scene::Region* region = wait.region.empty() ? nullptr : scene.FindRegion(wait.region);
  const double seconds = region != nullptr ? region->dwell : wait.seconds;
  return time - verb_start >= seconds ? Outcome::kDone : Outcome::kRunning;
}

std::string VelocityExecutive::Impl::WhatHoldsUp() const {
  // Rows at their limit: nearer than what is left in a tenth of a second.
  std::vector<std::pair<double, std::string>> rows;
  const control::ArmBodies& bodies = controller.bodies();
  for (int i = 0; i < controller.num_rows(); ++i) {
    const control::ConstrainedVelocity::Row& row = controller.row(i);
    if (row.value > 0.01) continue;
    std::string name = controller.constraint_name(row.constraint);
    if (row.a >= 0) name = bodies.name(row.a) + " near " + bodies.name(row.b);
    const bool known =
        std::any_of(rows.begin(), rows.end(), [&](const auto& one) { return one.second == name; });
    if (!known) rows.emplace_back(row.value, name);
  }
  std::sort(rows.begin(), rows.end());
  std::string text;
  for (size_t i = 0; i < rows.size() && i < 3; ++i) text += (i == 0 ? "held up by " : ", ") + rows[i].second;
  for (int i = 0; i < model->dof(); ++i) {
    const double margin = options.controller.joint_margin + 0.06;
    if (q[i] > model->lower()[i] + margin && q[i] < model->upper()[i] - margin) continue;
    text += (text.empty() ? "held up by " : ", ") +
            ("the limit of " + model->joint_names()[static_cast<size_t>(i)]);
  }
  return text.empty() ? "beyond what the arm can do there" : text;
}

// What is to be reached has gone where the arm does not get to, whatever it tries: fallen, rolled off,
// carried away.
std::string VelocityExecutive::Impl::BeyondReach() const {
  if (!goal) return "";
  const Pose X_WT = X_WTarget(goal->target);
  const double distance = (X_WT.p - control_scene.X_WBase() * model->reach().centre).norm();
  // A frame may stand further from where it is reached than the arm reaches, but not by more than that again.
  const double most = 2 * model->reach().max;
  if (distance <= most) return "";
  return "'" + schema().target + "' is " + Length(distance) + " from the shoulder of '" + robot_name +
         "', which reaches " + Length(model->reach().max);
}

bool VelocityExecutive::Impl::TryDetour(std::string& why) {
  if (detours > 1) why = "detours did not help";
  if (detours > 1 || !goal) return false;
  ++detours;
  path = FindDetour(why);
  waypoint = 0;
  if (path.empty()) return false;
  controller.SetExtraFields({});  // the verb's own constraints begin anew at the end of the detour
  Record(EventKind::kDetour, "a path of " + std::to_string(path.size()) + " configurations leads round it");
  return true;
}

Outcome VelocityExecutive::Impl::WatchProgress(double error) {
  if (!path.empty()) {
    while (waypoint < path.size() && (q - path[waypoint]).cwiseAbs().maxCoeff() < kWaypoint) {
      ++waypoint;
      best_error = std::numeric_limits<double>::infinity();
    }
    if (waypoint == path.size()) {
      path.clear();
      entered = false;
      goal.reset();
      return Outcome::kRunning;
    }
    if (!goal || goal->posture.size() == 0) goal = control::Goal{};
    goal->posture = path[waypoint];
    goal->turn_speed = options.turn_speed;
    error = (q - path[waypoint]).cwiseAbs().maxCoeff();
  }
  if (error < best_error - kProgress) {
    best_error = error;
    progress_time = time;
  }
  const bool late = time - verb_start > options.verb_timeout;
  if (time - progress_time < options.stall_time && !late) return Outcome::kRunning;
  const std::string beyond = BeyondReach();
  if (!beyond.empty()) {
    Record(EventKind::kStalled, beyond);
    path.clear();
    GiveUpAction(beyond);
    return Outcome::kAborted;
  }
  std::string reason = "no progress, " + Length(controller.error_m()) + " away: " + WhatHoldsUp();
  progress_time = time;
  if (!path.empty()) {
    path.clear();
    entered = false;
    goal.reset();
    Record(EventKind::kStalled, "on the detour, " + reason);
    return Outcome::kRunning;
  }
  Record(EventKind::kStalled, reason);
  std::string why;
  if (!late && TryDetour(why)) {
    best_error = std::numeric_limits<double>::infinity();
    return Outcome::kRunning;
  }
  if (!why.empty()) reason += "; no detour: " + why;
  Abort(EventKind::kStalled, reason, true);
  return Outcome::kAborted;
}

}  // namespace tether::execution
