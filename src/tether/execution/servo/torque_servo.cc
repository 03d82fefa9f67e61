#include "tether/execution/servo/torque_servo.h"

#include <algorithm>

#include "tether/common/text.h"
#include "tether/robot/gravity.h"

namespace tether::execution {
namespace {

// The pad of a hand that reaches to a support has this much less room than links have, m.
constexpr double kBuffer = 0.001;
// Joints that are slower stand, rad/s.
constexpr double kAtRest = 0.05;
// A mass that is known to this, kg, or to this share, counts.
constexpr double kKnownMass = 0.05, kKnownShare = 0.1;

Eigen::Vector3d GravityIn(const math::Pose& X_WB) {
  return X_WB.R.transpose() * Eigen::Vector3d(0, 0, -robot::kGravity);
}

control::TorqueOptions WithMargin(control::TorqueOptions options, double margin) {
  options.joint_margin = std::max(options.joint_margin, margin);
  return options;
}

}  // namespace

std::vector<control::ConstraintSpec> TorqueConstraints(std::vector<control::ConstraintSpec> given,
                                                       const scene::Scene& scene) {
  const bool has =
      std::any_of(given.begin(), given.end(), [](const auto& spec) { return spec.kind == "clearance"; });
  if (has) return given;
  control::ConstraintSpec spec;
  spec.kind = "clearance";
  spec.of = {"links", "hand", "held"};
  for (const scene::Object& object : scene.objects) spec.to.push_back(object.name);
  if (!spec.to.empty()) given.push_back(std::move(spec));
  return given;
}

TorqueServo::TorqueServo(const scene::Scene& scene, const std::string& robot,
                         std::shared_ptr<const robot::Model> model, const TorqueServoOptions& options)
    : model_(std::move(model)),
      scene_(scene, robot),
      controller_(
          Make({options.controller, TorqueConstraints(options.constraints, scene), options.max_force})),
      limiter_(model_, {.period = options.controller.period}),
      carried_(Eigen::VectorXd::Zero(model_->dof())) {
  const size_t most = 6 * scene.objects.size() + 8;
  allowed_.reserve(most);
  allowed_bodies_.reserve(most * ToIndex(controller_.bodies().hand() + 1));
}

control::ConstrainedTorque TorqueServo::Make(const TorqueServoOptions& options) {
  const control::ArmBodies bodies(model_, scene_.solids());
  BuiltConstraints built = BuildConstraints(options.constraints, scene_, bodies);
  control::TorqueOptions controller = options.controller;
  controller.joint_margin = std::max(controller.joint_margin, built.joint_margin);
  controller.buffer = std::min(controller.buffer, kBuffer);
  return {model_, scene_.X_WBase(), scene_.solids(), built.clearances, std::move(built.fields), controller};
}

const Eigen::VectorXd& TorqueServo::Compute(const TorqueServoTick& tick) {
  if (tick.held != held_) {
    held_ = tick.held;
    if (held_.valid()) {
      controller_.Hold(held_.value());
    } else {
      controller_.Release();
    }
  }
  if (tick.allowed != allowed_) {
    allowed_ = tick.allowed;
    FindBodies(allowed_, controller_.bodies(), &allowed_bodies_);
    controller_.Allow(allowed_bodies_);
  }
  control::TorqueTask task;
  if (!tick.brake) {
    task.hand = &tick.target;
    task.posture = &tick.posture;
    task.joints = tick.joints;
  }
  task.max_force = tick.max_force;
  const Eigen::VectorXd& wanted =
      controller_.Compute({tick.state, tick.opening, tick.objects.values(), &tick.tau_external}, task);
  carried_.noalias() = tick.state.J_BH().transpose() * tick.target.F_BH;
  const Eigen::VectorXd& torque = limiter_.Limit(tick.state, wanted, &carried_, &controller_.felt());
  controller_.SetLast(torque);
  return torque;
}

double TorqueServo::HeldMass() const {
  const control::LoadEstimator& load = controller_.load();
  const double known_to = std::max(kKnownMass, kKnownShare * load.mass());
  return load.carries() && load.weight_error() < known_to * robot::kGravity ? load.mass() : 0;
}

std::string TorqueServo::NameOf(int body) const {
  const control::ArmBodies& bodies = controller_.bodies();
  if (body < 0) return "something that is not known";
  return bodies.is_object(body) ? "'" + bodies.name(body) + "'" : "the arm's " + bodies.name(body);
}

std::string TorqueServo::DescribeBinding() const {
  std::vector<std::string> found;
  for (int i = 0; i < controller_.num_rows() && found.size() < 3; ++i) {
    const control::ConstrainedTorque::Row& row = controller_.row(i);
    if (!row.binding) continue;
    std::string what = controller_.constraint_name(row.constraint);
    if (row.a >= 0) what = NameOf(row.a) + " near " + NameOf(row.b);
    if (std::find(found.begin(), found.end(), what) == found.end()) found.push_back(std::move(what));
  }
  std::string text;
  for (const std::string& what : found) text += (text.empty() ? "" : ", ") + what;
  return text;
}

std::string TorqueServo::DescribeContact() const {
  const control::Contact& contact = controller_.contact();
  if (!contact.began) return {};
  const std::string what = contact.a < 0 ? "the hand" : NameOf(contact.a);
  const char* why = contact.intended ? ", more than is allowed" : ", which no step intends";
  return what + " presses on " + NameOf(contact.a < 0 ? -1 : contact.b) + " with about " +
         Fixed(contact.force, 0) + " N" + why + "; the arm backs off";
}

TorqueDrive::TorqueDrive(std::shared_ptr<const robot::Model> model, const ControlScene& scene,
                         BuiltConstraints built, control::TorqueOptions options)
    : state_(model, GravityIn(scene.X_WBase())),
      controller_(model, scene.X_WBase(), scene.solids(), built.clearances, std::move(built.fields),
                  WithMargin(options, built.joint_margin)),
      limiter_(model, {.period = options.period}),
      carried_(Eigen::VectorXd::Zero(model->dof())) {
  stay_.posture = model->home();
}

const Eigen::VectorXd& TorqueDrive::Compute(const Situation& situation, const Eigen::VectorXd* velocities,
                                            double max_force) {
  state_.Set(situation.q, situation.v);
  control::TorqueTask task;
  task.velocities = velocities;
  if (velocities != nullptr) {
    stays_ = false;
  } else {
    // Where it comes to rest: to turn round for where it was told to stop would be one more motion.
    if (!stays_ && situation.q.allFinite()) {
      stays_ = situation.v.cwiseAbs().maxCoeff() < kAtRest;
      stay_.posture = situation.q;
    }
    task.goal = &stay_;
  }
  task.max_force = max_force;
  const Eigen::VectorXd& wanted = controller_.Compute(
      {state_, situation.opening, situation.objects.values(), &situation.tau_external}, task);
  carried_.noalias() = state_.J_BH().transpose() * controller_.load().Holding(state_.X_BH());
  const Eigen::VectorXd& torque = limiter_.Limit(state_, wanted, &carried_, &controller_.felt());
  controller_.SetLast(torque);
  return torque;
}

}  // namespace tether::execution
