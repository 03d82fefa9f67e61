#include <algorithm>
#include <cmath>
#include <numbers>

#include "tether/control/objective.h"
#include "tether/execution/servo/velocity_servo.h"
#include "tether/geometry/distance/distance.h"
#include "tether/geometry/distance/query.h"
#include "tether/geometry/polygon/support.h"

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

// A held object touches what it is nearer to than this; it is clear of it from this on, besides what it must
// keep, m.
constexpr double kTouching = 0.002;

// How far `shape` at X reaches along a direction of the world.
double Extent(const geometry::Shape& shape, const Pose& X, const Vector3d& d_W) {
  return geometry::Support(shape, X.R.transpose() * d_W) + d_W.dot(X.p);
}

}  // namespace

// What the held object touches as it is grasped.
void VelocityServo::FindSupports() {
  const geometry::Shape& taken = s_.object(s_.held).shape;
  for (const ObjectId i : s_.objects.ids()) {
    if (i == s_.held) continue;
    const double distance =
        geometry::SignedDistance(taken, s_.X_WO(s_.held), s_.object(i).shape, s_.objects[i].X).distance;
    if (distance < kTouching) supports_.push_back(i);
  }
}

void VelocityServo::WatchSupports() {
  double keep = 0;
  for (const control::ConstraintSpec& spec : options_.constraints) keep = std::max(keep, spec.distance);
  const geometry::Shape& taken = s_.object(s_.held).shape;
  for (size_t i = 0; i < supports_.size(); ++i) {
    const ObjectId support = supports_[i];
    const double distance =
        geometry::SignedDistance(taken, s_.X_WO(s_.held), s_.object(support).shape, s_.objects[support].X)
            .distance;
    if (distance < keep + options_.controller.buffer + kTouching) continue;
    supports_.erase(supports_.begin() + static_cast<std::ptrdiff_t>(i--));
    UpdateAllowed();
  }
  FindBeneath();
}

// A region stands for what carries it.
std::vector<std::string> VelocityServo::NamesOf(const std::string& name) const {
  const scene::Region* region = s_.scene.FindRegion(name);
  if (region == nullptr) return {name};
  std::vector<ObjectId> found;
  FindCarriers(*region, found);
  std::vector<std::string> names;
  for (const ObjectId object : found) names.push_back(s_.object_name(object));
  return names;
}

// The controller's numbers of an object, or of all that moves with the hand.
std::vector<int> VelocityServo::BodiesOf(const std::string& name) const {
  const control::ArmBodies& bodies = controller_.bodies();
  std::vector<int> list;
  if (const ObjectId object = control_scene_.Find(name); object.valid())
    list.push_back(bodies.object(object.value()));
  for (int body = 0; name == "hand" && body <= bodies.hand(); ++body) {
    if (bodies.link(body) == s_.model->dof()) list.push_back(body);
  }
  return list;
}

void VelocityServo::UpdateAllowed() {
  allowed_.clear();
  const auto allow = [&](const std::string& first, const std::string& second) {
    for (const std::string& a : NamesOf(first)) {
      for (const std::string& b : NamesOf(second)) allowed_.emplace_back(a, b);
    }
  };
  if (s_.in_plan()) {
    for (const auto& [first, second] : schema().allow) {
      const bool target =
          (first == "hand" && second == schema().target) || (second == "hand" && first == schema().target);
      if (!keeps_off_ || !target) allow(first, second);
    }
    if (schema().target_is_region && s_.current().control != kNone) allow(schema().control, schema().target);
  }
  if (s_.held != kNone) {
    const std::string& held = s_.object_name(s_.held);
    for (const ObjectId support : supports_) allowed_.emplace_back(held, s_.object_name(support));
    for (const ObjectId object : beneath_) allowed_.emplace_back(held, s_.object_name(object));
  }
  allowed_bodies_.clear();
  for (const auto& [first, second] : allowed_) {
    for (const int a : BodiesOf(first)) {
      for (const int b : BodiesOf(second)) allowed_bodies_.emplace_back(a, b);
    }
  }
  controller_.Allow(allowed_bodies_);
  if (drive_) drive_->Allow(allowed_bodies_);
}

// A reach that another one follows leads to before the target, which the hand touches in the last one.
bool VelocityServo::KeepsOff() const {
  if (!s_.in_plan() || s_.held.valid() || s_.verb >= static_cast<int>(s_.verbs().size())) return false;
  const auto is_reach = [](const planning::Verb& verb) {
    return std::holds_alternative<planning::ReachVerb>(verb);
  };
  const auto verb = s_.verbs().begin() + s_.verb;
  return is_reach(*verb) && std::any_of(verb + 1, s_.verbs().end(), is_reach);
}

void VelocityServo::WatchApproach() {
  if (keeps_off_ || !KeepsOff()) return;
  const ObjectId target = control_scene_.Find(schema().target);
  if (!target.valid()) return;
  double keep = 0;
  for (const control::ConstraintSpec& spec : options_.constraints) keep = std::max(keep, spec.distance);
  const double distance = geometry::SignedDistance(s_.model->HandShape(s_.opening), s_.X_WH,
                                                   s_.object(target).shape, s_.objects[target].X)
                              .distance;
  if (distance < keep + options_.controller.buffer + kTouching) return;
  keeps_off_ = true;
  UpdateAllowed();
}

// The object's footprint is within the carrier's, seen along the carrier's level axes.
bool VelocityServo::IsOver(ObjectId object, ObjectId carrier) const {
  const auto &o = s_.object(object), &c = s_.object(carrier);
  const Pose &X_O = s_.objects[object].X, &X_C = s_.objects[carrier].X;
  for (int axis = 0; axis < 3; ++axis) {
    Vector3d d = X_C.R.col(axis);
    if (std::abs(d.z()) > 0.7) continue;
    d = Vector3d(d.x(), d.y(), 0).normalized();
    for (const double side : {1.0, -1.0}) {
      if (Extent(o.shape, X_O, side * d) > Extent(c.shape, X_C, side * d) + kWithin) return false;
    }
  }
  return true;
}

// What carries a region is what lies beneath its plane within its outline, whatever its frame is attached to,
// and the object that its frame is attached to. `found` is filled anew.
void VelocityServo::FindCarriers(const scene::Region& region, std::vector<ObjectId>& found) const {
  found.clear();
  const control::Frame frame = control_scene_.Target(region.name);
  if (frame.object >= 0) found.emplace_back(frame.object);
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
  for (const ObjectId other : s_.objects.ids()) {
    if (other == s_.held || other.value() == frame.object) continue;
    const geometry::Shape& shape = s_.object(other).shape;
    bool beneath_it = lies_beneath(shape, s_.X_WO(other), Vector3d::Zero());
    for (int k = 0; k < kDirections && !beneath_it; ++k) {
      const double angle = 2 * std::numbers::pi * k / kDirections;
      const Vector3d p(0.5 * reach[0] * std::cos(angle), 0.5 * reach[1] * std::sin(angle), 0);
      beneath_it = lies_beneath(shape, s_.X_WO(other), p);
    }
    if (beneath_it) found.push_back(other);
  }
}

// While the held object is above what it stood on, or what carries the region that it is brought to, within
// the outline of that, it cannot keep its distance from what that lies on: a mat is thinner than clearances.
void VelocityServo::FindBeneath() {
  beneath_next_.clear();
  carriers_next_.clear();
  const auto add_beneath = [&](ObjectId carrier) {
    if (!carrier.valid() || carrier == s_.held || !IsOver(s_.held, carrier)) return;
    const Pose& X_C = s_.objects[carrier].X;
    const geometry::Shape& shape = s_.object(carrier).shape;
    const Vector3d up = Vector3d::UnitZ();
    const double foot = -Extent(shape, X_C, -up);
    for (const ObjectId other : s_.objects.ids()) {
      if (other == carrier || other == s_.held) continue;
      if (Extent(s_.object(other).shape, s_.X_WO(other), up) > foot + kBeneath) continue;
      if (std::find(beneath_next_.begin(), beneath_next_.end(), other) == beneath_next_.end())
        beneath_next_.push_back(other);
    }
  };
  if (s_.held.valid()) {
    for (const ObjectId support : supports_) add_beneath(support);
    if (s_.in_plan() && schema().target_is_region && s_.current().control == s_.held)
      FindCarriers(*s_.scene.FindRegion(schema().target), carriers_next_);
    for (const ObjectId carrier : carriers_next_) add_beneath(carrier);
  }
  if (beneath_next_ == beneath_ && carriers_next_ == carriers_) return;
  std::swap(beneath_, beneath_next_);
  std::swap(carriers_, carriers_next_);
  UpdateAllowed();
}

// What the hand, or what it holds, touched last and may have to go along with; kNone: nothing.
ObjectId VelocityServo::ContactObject() const {
  if (s_.held.valid()) return supports_.empty() ? kNone : supports_.front();
  if (!s_.in_plan()) return kNone;
  return ObjectId(control_scene_.Target(schema().target).object);
}

bool VelocityServo::IsClearOf(ObjectId object) const {
  if (s_.held.valid()) return std::find(supports_.begin(), supports_.end(), object) == supports_.end();
  const geometry::Shape hand = s_.model->HandShape(s_.opening);
  // Open fingers don't touch what is between them: the hand is clear of it once the finger tips are.
  const auto near = [&](ObjectId other) {
    const geometry::Shape& shape = s_.object(other).shape;
    const Pose& X_WO = s_.objects[other].X;
    return geometry::SignedDistance(hand, s_.X_WH, shape, X_WO).distance < kClear ||
           geometry::DistanceToPoint(shape, X_WO, s_.X_WH.p).distance <
               s_.model->gripper().pad_half_height + kClear;
  };
  return !near(object) && (!s_.released.valid() || !near(s_.released));
}

// The hand moves along with what was touched as soon as that moves, until it is clear of it. `move`: the verb
// has a goal of its own, which moves along; else the hand keeps its pose relative to it.
void VelocityServo::GoAlong(bool move) {
  if (clear_) return;
  ObjectId object = along_.valid() ? along_ : ContactObject();
  if (!object.valid() || (!along_.valid() && s_.objects[object].V.norm() < kTargetMoves)) return;
  clear_ = IsClearOf(object);
  if (clear_) object = kNone;
  if (object == along_) return;
  const auto pose_of = [&](ObjectId of) { return !of.valid() ? control_scene_.X_WBase() : s_.objects[of].X; };
  if (!move && !object.valid()) {
    goal_.reset();
  } else {
    const Pose X_WGoal = move ? pose_of(along_) * goal_pose_ : s_.X_WH;
    if (!goal_) {
      goal_ = control::Goal{};
      goal_->turn_speed = options_.turn_speed;
    }
    goal_->target = {};
    goal_->target.object = object.value();
    goal_pose_ = pose_of(object).Inverse() * X_WGoal;
    goal_->functions = control::MakeObjective(control::Objective::kPose, goal_pose_);
  }
  along_ = object;
}

}  // namespace tether::execution
