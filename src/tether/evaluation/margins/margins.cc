#include "tether/evaluation/margins/margins.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "tether/geometry/distance/distance.h"
#include "tether/math/infinity.h"

namespace tether::evaluation {
namespace {

// A push on the arm may make it faster than its limits by a tenth.
constexpr double kPushed = 1.1;

}  // namespace

void Margin::Take(double value, double time_now, const std::string& what_now) {
  last = std::min(last, value);
  if (value >= minimum) return;
  minimum = value;
  time = time_now;
  what = what_now;
}

Value WriteMargin(const Margin& margin) {
  Value value = Value::Object()
                    .Set("name", margin.name)
                    .Set("minimum", margin.minimum)
                    .Set("unit", margin.unit)
                    .Set("time_s", margin.time)
                    .Set("what", margin.what);
  if (margin.minimum < 0 && margin.avoidable < math::kInfinity)
    value.Set("minimum_avoidable", margin.avoidable);
  return value;
}

MarginMonitor::MarginMonitor(const scene::Scene& scene,
                             const std::map<std::string, std::shared_ptr<const robot::Model>>& models,
                             const std::string& robot,
                             const std::vector<control::ConstraintSpec>& constraints, double range)
    : constraints_(constraints),
      scene_(scene, robot),
      model_(models.at(robot)),
      robot_(robot),
      kinematics_(model_),
      bodies_(model_, scene_.solids()),
      range_(range) {
  if (constraints.empty()) return;
  const execution::BuiltConstraints built = execution::BuildConstraints(constraints, scene_, bodies_);
  const auto add = [&](const std::string& name, const char* unit, const char* group) {
    margins_.push_back({name, math::kInfinity, unit, group, 0, "", math::kInfinity});
    return margins_.size() - 1;
  };
  for (const control::ClearanceConstraint& clearance : built.clearances) {
    for (const int object : clearance.to) {
      const control::Solid& solid = scene_.solids()[object];
      const size_t margin =
          add("clearance to " + solid.name, "m", solid.movable ? "objects" : "walls, table and base");
      clearances_.push_back({margin, object, clearance.distance, clearance.of, clearance.held});
    }
  }
  fields_ = built.fields;
  for (const control::FieldConstraint& field : fields_) {
    const bool metres = field.function->unit() == nlp::Unit::kMetre;
    field_margins_.push_back(metres ? add(field.name, "m", "walls, table and base")
                                    : add(field.name, "rad", "angles"));
  }
  joint_margin_ = built.joint_margin;
  joint_limits_ = add("joint limits", "rad", "angles");
  velocity_ = add("joint velocity limits", "rad/s", "joint velocities");
  self_ = add("the arm itself", "m", "the arm itself");
}

double MarginMonitor::Distance(int a, int b, double below) const {
  double least = below;
  for (const control::ArmBodies::Part* p = bodies_.begin(a); p != bodies_.end(a); ++p) {
    for (const control::ArmBodies::Part* r = bodies_.begin(b); r != bodies_.end(b); ++r) {
      if (control::ArmBodies::LowerBound(*p, *r) >= least) continue;
      least =
          std::min(least, geometry::SignedDistance(p->primitive, p->X_BP, r->primitive, r->X_BP).distance);
    }
  }
  return least;
}

void MarginMonitor::ObserveClearances(double time, const execution::PlanRunner& runner) {
  const ObjectId held_object = scene_.Find(runner.held());
  const int held = held_object.value();
  const execution::TouchList& allowed = runner.allowed();
  for (const Clearance& clearance : clearances_) {
    const int b = bodies_.object(clearance.object);
    const ObjectId object(clearance.object);
    const bool to_hand = object == held_object || allowed.Allows(execution::kTouchingHand, object);
    // Pairs further apart than the least distance so far need no exact distance.
    double least = range_;
    std::string what;
    const auto look = [&](int a) {
      const double distance = Distance(a, b, least);
      if (distance >= least) return;
      least = distance;
      what = bodies_.name(a);
    };
    for (const int a : clearance.bodies) {
      if (bodies_.link(a) == 0 || (bodies_.link(a) == model_->dof() && to_hand)) continue;
      look(a);
    }
    if (clearance.held && held >= 0 && held != clearance.object && !allowed.Allows(held_object, object)) {
      look(bodies_.object(held));
    }
    margins_[clearance.margin].Take(least - clearance.distance, time, what);
    if (!avoidable_) continue;
    double& avoidable = margins_[clearance.margin].avoidable;
    avoidable = std::min(avoidable, least - clearance.distance);
  }
  for (const auto& [a, b] : model_->solids().pairs) {
    margins_[self_].Take(Distance(a, b, range_), time, bodies_.name(a) + " and " + bodies_.name(b));
  }
}

void MarginMonitor::ObserveField(const control::FieldConstraint& field, size_t margin, int held,
                                 double time) {
  const auto pose = [&](const control::Frame& frame, const math::Pose& otherwise) {
    const int object = frame.object == control::kHeld ? held : frame.object;
    return (object < 0 ? otherwise : bodies_.pose(bodies_.object(object)).X) * frame.X_OF;
  };
  if (field.frame.object != -1 && (held < 0 || (field.frame.object >= 0 && field.frame.object != held)))
    return;
  const std::array<math::Pose, 2> X{pose(field.target, math::Pose()), pose(field.frame, kinematics_.X_BH())};
  Eigen::VectorXd r(field.function->size());
  field.function->Evaluate(X, r, nullptr);
  margins_[margin].Take(-r.maxCoeff(), time, "");
}

void MarginMonitor::ForgetLast() {
  for (Margin& margin : margins_) margin.last = math::kInfinity;
}

void MarginMonitor::Observe(const scene::WorldEstimate& truth, const robot::Observations& observations,
                            const execution::PlanRunner& runner, bool pushed, bool avoidable) {
  if (margins_.empty()) return;
  avoidable_ = avoidable;
  const robot::Observation& seen = observations.at(robot_);
  if (!seen.q.allFinite()) return;
  const double time = truth.time;
  kinematics_.Set(seen.q);
  bodies_.PlaceArm(kinematics_, seen.gripper_opening);
  const math::Pose X_BW = scene_.X_WBase().Inverse();
  for (size_t i = 0; i < scene_.solids().size(); ++i) {
    bodies_.Place(static_cast<int>(i), {X_BW * truth.X_WO.at(scene_.solids()[i].name)});
  }
  ObserveClearances(time, runner);
  const int held = scene_.Find(runner.held()).value();
  for (size_t i = 0; i < fields_.size(); ++i) ObserveField(fields_[i], field_margins_[i], held, time);
  for (const control::FieldConstraint& field : runner.verb_fields()) {
    const auto known =
        std::find_if(margins_.begin(), margins_.end(), [&](const Margin& m) { return m.name == field.name; });
    const auto margin = static_cast<size_t>(known - margins_.begin());
    if (known == margins_.end()) {
      const bool metres = field.function->unit() == nlp::Unit::kMetre;
      margins_.push_back({field.name, math::kInfinity, metres ? "m" : "rad", metres ? "regions" : "angles", 0,
                          "", math::kInfinity});
    }
    ObserveField(field, margin, held, time);
  }
  for (int i = 0; i < model_->dof(); ++i) {
    const std::string& joint = model_->joint_names()[i];
    margins_[joint_limits_].Take(
        std::min(seen.q[i] - model_->lower()[i], model_->upper()[i] - seen.q[i]) - joint_margin_, time,
        joint);
    margins_[velocity_].Take((pushed ? kPushed : 1.0) * model_->max_velocity()[i] - std::abs(seen.v[i]), time,
                             joint);
  }
}

}  // namespace tether::evaluation
