#include "tether/execution/servo/velocity_servo.h"

#include <algorithm>

#include "tether/common/document/option_check.h"
#include "tether/common/text.h"

namespace tether::execution {
namespace {

// What happens again within this time is one event, s.
constexpr double kSameEvent = 1.0;

/// Paths keep the greatest distance that the scenario asks for, where there is room.
ArmTransitOptions WithDistances(const VelocityServoOptions& options) {
  ArmTransitOptions arm;
  for (const control::ConstraintSpec& spec : options.constraints) {
    if (spec.kind == "clearance")
      arm.clearance = std::max(arm.clearance, spec.distance + options.controller.buffer);
  }
  return arm;
}

}  // namespace

void VelocityServoOptions::Check(Diagnostics* diagnostics) const {
  controller.Validate();
  const OptionCheck check("execution", diagnostics);
  check.Positive("acceleration", acceleration);
  check.Positive("turn_speed", turn_speed);
  check.Positive("foot_gap", foot_gap);
}

VelocityServo::VelocityServo(Situation& situation,
                             const std::map<std::string, std::shared_ptr<const robot::Model>>& models,
                             const SequencerOptions& shared, const VelocityServoOptions& options)
    : s_(situation),
      shared_(shared),
      options_(options),
      models_(models),
      control_scene_(s_.scene, s_.robot),
      controller_(MakeController()),
      watch_(shared_.watch()),
      goal_search_(s_.model),
      transit_(s_, WithDistances(options_), options_.constraints),
      supports_(s_, SupportDistances(options_)),
      after_contact_(s_, supports_),
      kinematics_(s_.model),
      J_BH_(6, s_.model->dof()) {
  for (const control::ConstraintSpec& spec : options_.constraints)
    has_fields_ = has_fields_ || spec.kind == "outside";
  if (options_.torques) MakeDrive();
}

void VelocityServo::MakeDrive() {
  const control::ArmBodies bodies(s_.model, control_scene_.solids());
  control::TorqueOptions torque = options_.torque;
  torque.period = shared_.period;
  drive_ = std::make_unique<TorqueDrive>(
      s_.model, control_scene_, BuildConstraints(options_.constraints, control_scene_, bodies), torque);
}

control::ConstrainedVelocity VelocityServo::MakeController() const {
  const control::ArmBodies bodies(s_.model, control_scene_.solids());
  BuiltConstraints built = BuildConstraints(options_.constraints, control_scene_, bodies);
  control::VelocityOptions controller_options = options_.controller;
  controller_options.joint_margin = std::max(controller_options.joint_margin, built.joint_margin);
  controller_options.period = shared_.period;
  return {s_.model,         control_scene_.X_WBase(), control_scene_.solids(),
          built.clearances, std::move(built.fields),  controller_options};
}

void VelocityServo::FindHandPose() {
  const control::ArmBodies& bodies = controller_.bodies();
  s_.X_WH = control_scene_.X_WBase() * bodies.pose(bodies.hand()).X;
}

void VelocityServo::Sense() {
  if (!s_.q.allFinite()) return;
  if (!placed_) {
    placed_ = true;
    controller_.Compute({s_.q, s_.opening, s_.objects.values()}, nullptr);
    FindHandPose();
  }
  if (s_.held != kNone) WatchSupports();
  WatchApproach();
  WatchForce();
}

void VelocityServo::Begin() { s_.gripper.opening = s_.model->gripper().max_opening; }

void VelocityServo::BeginStep() {
  grasp_.reset();
  path_.clear();
  detours_ = transits_ = 0;
  BeginVerb();
  UpdateAllowed();
}

void VelocityServo::BeginVerb() {
  transit_.Stop();
  entered_ = false;
  braked_since_ = -1;
  goal_.reset();
  verb_fields_.clear();
  controller_.SetExtraFields({});
  if (drive_) drive_->SetExtraFields({});
  after_contact_.Start();
  if (!keeps_off_) return;
  keeps_off_ = false;
  UpdateAllowed();
}

void VelocityServo::Rest(bool first) {
  if (first) {
    along_ = kNone;
  } else {
    GoAlong(false);
  }
}

void VelocityServo::HeldChanged() {
  supports_.Find();
  beneath_.clear();
  if (s_.held == kNone) {
    controller_.Release();
    if (drive_) drive_->Release();
    UpdateAllowed();
    return;
  }
  controller_.Hold(s_.held.value());
  if (drive_) drive_->Hold(s_.held.value());
  UpdateAllowed();
  FindBeneath();
}

// A reach begins anew, from where the arm is; a shift has been led half of its way.
void VelocityServo::Resume() {
  if (s_.in_plan() && std::holds_alternative<planning::ReachVerb>(s_.present_verb())) {
    path_.clear();
    return BeginVerb();
  }
  watch_.Excuse(s_.time);
}

void VelocityServo::Stop() {
  goal_.reset();
  path_.clear();
  transit_.Stop();
  if (s_.in_plan()) return;
  BeginVerb();
  UpdateAllowed();
}

void VelocityServo::WatchSafety() {
  const control::VelocityFlags& flags = controller_.flags();
  if (flags.fault && !faulty_)
    s_.Record(EventKind::kSafety, s_.q.allFinite()
                                      ? "no velocities were found that keep the constraints: the arm stops"
                                      : "a joint's position is not a finite number: the arm stops");
  faulty_ = flags.fault;
  if (flags.worst < 0) return;
  const std::string& name = controller_.constraint_name(flags.worst);
  if (flags.escaping && !flags.relaxed) {
    if (s_.time > escaping_until_) {
      s_.Record(EventKind::kSafety, "'" + name + "' is violated by " + Fixed(flags.violation, 4) +
                                        " (m or rad): the arm leaves it at no more than " +
                                        Fixed(options_.controller.escape_speed, 2) + " per second");
    }
    escaping_until_ = s_.time + kSameEvent;
  }
  if (flags.relaxed) {
    if (s_.time > relaxed_until_)
      s_.Record(EventKind::kSafety, "constraints conflict: '" + name + "' is violated at " +
                                        Fixed(flags.violation, 4) + " (m or rad) per second");
    relaxed_until_ = s_.time + kSameEvent;
  }
}

void VelocityServo::WatchDrive() {
  const control::ConstrainedTorque& controller = drive_->controller();
  const control::TorqueFlags& flags = controller.flags();
  if (flags.fault && !faulty_)
    s_.Record(EventKind::kSafety, "what was measured is not finite; the arm is braked");
  faulty_ = flags.fault;
  const control::Contact& contact = controller.contact();
  if (contact.began) {
    const auto name = [&](int body) {
      return body < 0 ? std::string("something that is not known")
                      : "'" + controller.bodies().name(body) + "'";
    };
    s_.Record(EventKind::kSafety, (contact.a < 0 ? std::string("the hand") : name(contact.a)) +
                                      " presses on " + name(contact.a < 0 ? -1 : contact.b) + " with about " +
                                      Fixed(contact.force, 0) + " N; the arm backs off");
  }
  if (flags.braking && s_.time > relaxed_until_) {
    s_.Record(EventKind::kSafety, "no torques were found that keep all constraints; the arm is braked");
    relaxed_until_ = s_.time + kSameEvent;
  }
  if (flags.worst < 0 || !(flags.relaxed || flags.violated)) return;
  double& until = flags.relaxed ? relaxed_until_ : escaping_until_;
  if (s_.time > until) {
    const std::string& what = controller.constraint_name(flags.worst);
    s_.Record(EventKind::kSafety, flags.relaxed ? what + " is relaxed: constraints conflict"
                                                : what + " is violated by " + Length(flags.violation));
  }
  until = s_.time + kSameEvent;
}

void VelocityServo::Prepare(robot::Commands* commands) const {
  for (const scene::Robot& robot : s_.scene.robots) {
    robot::Command& command = (*commands)[robot.name];
    const Eigen::VectorXd zero = Eigen::VectorXd::Zero(models_.at(robot.name)->dof());
    const bool torques = options_.torques && robot.name == s_.robot;
    command.mode = torques ? robot::Command::Mode::kTorque : robot::Command::Mode::kVelocity;
    (torques ? command.torque : command.velocity) = zero;
    command.gripper.opening = models_.at(robot.name)->gripper().max_opening;
  }
}

void VelocityServo::Command(const robot::Observations& /*observations*/, robot::Commands* commands) {
  const control::VelocityInput input{s_.q, s_.opening, s_.objects.values(), &s_.v};
  const control::Goal* goal = goal_ && !s_.stopping ? &*goal_ : nullptr;
  if (s_.time < backs_off_until_ && !s_.stopping) goal = &back_off_;
  robot::Command& command = commands->find(s_.robot)->second;
  const Eigen::VectorXd& velocity = controller_.Compute(input, goal);
  if (!controller_.flags().fault) FindHandPose();
  if (!drive_) {
    command.velocity = velocity;
    return WatchSafety();
  }
  const double max_force =
      s_.in_plan() ? s_.plan_step().max_force.value_or(options_.max_force) : options_.max_force;
  command.torque = drive_->Compute(s_, goal == nullptr ? nullptr : &velocity, max_force);
  WatchDrive();
}

const std::vector<control::FieldConstraint>& VelocityServo::verb_fields() const {
  // On a detour they don't hold.
  return path_.empty() ? verb_fields_ : Servo::verb_fields();
}

}  // namespace tether::execution
