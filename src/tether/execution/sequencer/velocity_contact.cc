#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>

#include "tether/control/objective.h"
#include "tether/execution/sequencer/velocity_executive_impl.h"
#include "tether/geometry/distance/distance.h"
#include "tether/geometry/distance/query.h"
#include "tether/geometry/polygon/support.h"
#include "tether/scene/region.h"

namespace tether::execution {
namespace {

using Eigen::Vector3d;
using math::Pose;

// What is no higher than this above another's foot can lie beneath it, m.
constexpr double kBeneath = 0.005;
// A footprint may reach so far beyond an outline and is still within it, m.
constexpr double kWithin = 0.001;
// From this speed on, the hand moves along with what was touched, m/s.
constexpr double kTargetMoves = 0.005;
// What is further away than this is not touched any more, m.
constexpr double kClear = 0.01;

// How far `shape` at X reaches along a direction of the world.
double Reach(const geometry::Shape& shape, const Pose& X, const Vector3d& d_W) {
  return geometry::Support(shape, X.R.transpose() * d_W) + d_W.dot(X.p);
}

}  // namespace

// The object's footprint is within the carrier's, seen along the carrier's level axes.
bool VelocityExecutive::Impl::IsOver(int object, int carrier) const {
  const auto &o = scene.objects[static_cast<size_t>(object)],
             &c = scene.objects[static_cast<size_t>(carrier)];
  const Pose &X_O = objects[static_cast<size_t>(object)].X, &X_C = objects[static_cast<size_t>(carrier)].X;
  for (int axis = 0; axis < 3; ++axis) {
    Vector3d d = X_C.R.col(axis);
    if (std::abs(d.z()) > 0.7) continue;
    d = Vector3d(d.x(), d.y(), 0).normalized();
    for (const double side : {1.0, -1.0}) {
      if (Reach(o.shape, X_O, side * d) > Reach(c.shape, X_C, side * d) + kWithin) return false;
    }
  }
  return true;
}

// What carries a region is what lies beneath its plane within its outline, whatever its frame is attached to,
// and the object that its frame is attached to. `found` is filled anew.
void VelocityExecutive::Impl::FindCarriers(const scene::Region& region, std::vector<int>& found) const {
  found.clear();
  const control::Frame frame = control_scene.Target(region.name);
  if (frame.object >= 0) found.push_back(frame.object);
  if (region.hub || std::holds_alternative<geometry::Primitive>(region.form)) return;
  const Pose X_WR = X_WTarget(frame);
  const auto lies_beneath = [&](const geometry::Shape& shape, const Pose& X_WO, const Vector3d& p) {
    const Vector3d above = X_WR * (p + kBeneath * Vector3d::UnitZ());
    return geometry::CastRay(shape, X_WO, above, -X_WR.R.col(2), geometry::RayStart::kIgnore, 2 * kBeneath)
        .has_value();
  };
  // At its middle, and halfway to the outline.
  constexpr int kDirections = 8;
  double reach[2] = {0, 0};
  if (const auto* disc = std::get_if<scene::Disc>(&region.form)) {
    reach[0] = reach[1] = disc->radius;
  } else if (const auto* rectangle = std::get_if<scene::Rectangle>(&region.form)) {
    reach[0] = 0.5 * rectangle->size.x();
    reach[1] = 0.5 * rectangle->size.y();
  }
  for (size_t i = 0; i < objects.size(); ++i) {
    const int other = static_cast<int>(i);
    if (other == held || other == frame.object) continue;
    const geometry::Shape& shape = scene.objects[i].shape;
    bool beneath_it = lies_beneath(shape, objects[i].X, Vector3d::Zero());
    for (int k = 0; k < kDirections && !beneath_it; ++k) {
      const double angle = 2 * std::numbers::pi * k / kDirections;
      const Vector3d p(0.5 * reach[0] * std::cos(angle), 0.5 * reach[1] * std::sin(angle), 0);
      beneath_it = lies_beneath(shape, objects[i].X, p);
    }
    if (beneath_it) found.push_back(other);
  }
}

// While the held object is above what it stood on, or what carries the region that it is brought to, within
// the outline of that, it cannot keep its distance from what that lies on: a mat is thinner than clearances.
void VelocityExecutive::Impl::FindBeneath() {
  beneath_next.clear();
  carriers_next.clear();
  const auto add_beneath = [&](int carrier) {
    if (carrier < 0 || carrier == held || !IsOver(held, carrier)) return;
    const Pose& X_C = objects[static_cast<size_t>(carrier)].X;
    const geometry::Shape& shape = scene.objects[static_cast<size_t>(carrier)].shape;
    const Vector3d up = Vector3d::UnitZ();
    const double foot = -Reach(shape, X_C, -up);
    for (size_t i = 0; i < objects.size(); ++i) {
      const int other = static_cast<int>(i);
      if (other == carrier || other == held) continue;
      if (Reach(scene.objects[i].shape, objects[i].X, up) > foot + kBeneath) continue;
      if (std::find(beneath_next.begin(), beneath_next.end(), other) == beneath_next.end())
        beneath_next.push_back(other);
    }
  };
  if (held >= 0) {
    for (const int support : supports) add_beneath(support);
    if (at < static_cast<int>(steps.size()) && schema().target_is_region && schema().control == held_name)
      FindCarriers(*scene.FindRegion(schema().target), carriers_next);
    for (const int carrier : carriers_next) add_beneath(carrier);
  }
  if (beneath_next == beneath && carriers_next == carriers) return;
  std::swap(beneath, beneath_next);
  std::swap(carriers, carriers_next);
  UpdateAllowed();
}

// What the hand, or what it holds, touched last and may have to go along with; -1: nothing.
int VelocityExecutive::Impl::ContactObject() const {
  if (held >= 0) return supports.empty() ? -1 : supports.front();
  if (at >= static_cast<int>(steps.size())) return -1;
  return control_scene.Target(schema().target).object;
}

bool VelocityExecutive::Impl::IsClearOf(int object) const {
  if (held >= 0) return std::find(supports.begin(), supports.end(), object) == supports.end();
  const geometry::Shape hand = model->HandShape(opening);
  // Open fingers don't touch what is between them: the hand is clear of it once the finger tips are.
  const auto near = [&](int other) {
    const geometry::Shape& shape = scene.objects[static_cast<size_t>(other)].shape;
    const Pose& X_WO = objects[static_cast<size_t>(other)].X;
    return geometry::SignedDistance(hand, X_WH, shape, X_WO).distance < kClear ||
           geometry::DistanceToPoint(shape, X_WO, X_WH.p).distance <
               model->gripper().pad_half_height + kClear;
  };
  return !near(object) && (released < 0 || !near(released));
}

// The hand moves along with what was touched as soon as that moves, until it is clear of it. `move`: the verb
// has a goal of its own, which moves along; else the hand keeps its pose relative to it.
void VelocityExecutive::Impl::GoAlong(bool move) {
  if (clear) return;
  int object = along >= 0 ? along : ContactObject();
  if (object < 0 || (along < 0 && objects[static_cast<size_t>(object)].V.norm() < kTargetMoves)) return;
  clear = IsClearOf(object);
  if (clear) object = -1;
  if (object == along) return;
  const auto pose_of = [&](int of) {
    return of < 0 ? control_scene.X_WBase() : objects[static_cast<size_t>(of)].X;
  };
  if (!move && object < 0) {
    goal.reset();
  } else {
    const Pose X_WGoal = move ? pose_of(along) * goal_pose : X_WH;
    if (!goal) {
      goal = control::Goal{};
      goal->turn_speed = options.turn_speed;
    }
    goal->target = {};
    goal->target.object = object;
    goal_pose = pose_of(object).Inverse() * X_WGoal;
    goal->functions = control::MakeObjective(control::Objective::kPose, goal_pose);
  }
  along = object;
}

// What was released in this step stands beside its target region: it is grasped again, and where that did not
// help either the run has failed, since later actions begin from where it was to be.
bool VelocityExecutive::Impl::MissedItsRegion() {
  if (released < 0 || !schema().target_is_region) return false;
  const scene::Region& region = *scene.FindRegion(schema().target);
  if (region.hub || std::holds_alternative<geometry::Primitive>(region.form)) return false;
  const std::string name = object_name(released);
  const scene::RegionFit fit = scene::FitRegion(region.form, X_WTarget(control_scene.Target(region.name)),
                                                scene.objects[static_cast<size_t>(released)].shape,
                                                objects[static_cast<size_t>(released)].X);
  if (fit.Holds()) return false;
  char text[120];
  if (fit.outside > scene::RegionFit::kOutlineTolerance) {
    std::snprintf(text, sizeof text, "its footprint reaches %.1f mm beyond", 1e3 * fit.outside);
  } else {
    std::snprintf(text, sizeof text, "its foot is %.1f mm off", 1e3 * fit.height);
  }
  const std::string reason = "'" + name + "' is not in '" + region.name + "': " + text;
  Record(EventKind::kPlaceMissed, reason);
  for (int step = at; step >= 0; --step) {
    const planning::StepSchema& taking = steps[static_cast<size_t>(step)].schema;
    if (taking.control != "hand" || taking.target != name) continue;
    const int action = plan.steps[static_cast<size_t>(step)].action_index;
    if (retries_of_action[action] >= options.max_retries) {
      Fail(reason + ", although it was grasped again " + std::to_string(options.max_retries) + " times");
      return true;
    }
    at = step;
    Abort(EventKind::kRetry, "'" + name + "' is grasped again", true);
    return true;
  }
  Fail(reason + ", and no earlier step of the plan grasps it");
  return true;
}

}  // namespace tether::execution
