#include "tether/execution/servo/reference_servo.h"

#include <utility>

#include "tether/common/document/option_check.h"
#include "tether/robot/gravity.h"

namespace tether::execution {
namespace {

Eigen::Vector3d GravityIn(const math::Pose& X_WB) {
  return X_WB.R.transpose() * Eigen::Vector3d(0, 0, -robot::kGravity);
}

}  // namespace

void ReferenceServoOptions::Check(Diagnostics* diagnostics) const {
  gains.Validate();
  const OptionCheck check("execution", diagnostics);
  check.Positive("motion.speed", motion.speed);
  check.Positive("motion.acceleration", motion.acceleration);
  check.Positive("motion.angular_speed", motion.angular_speed);
  check.Positive("motion.angular_acceleration", motion.angular_acceleration);
  check.Positive("free_speed", free_speed);
  check.Positive("free_acceleration", free_acceleration);
  check.Positive("transit.side", transit.side);
  check.Positive("transit.above", transit.above);
  check.Positive("contact.threshold", contact.threshold);
  check.Positive("contact_search", contact_search);
  check.Positive("leash", leash);
  check.Positive("obstacle_range", obstacle_range);
  check.Positive("push_tolerance", push_tolerance);
  check.Positive("push_angle", push_angle);
  check.Positive("push_limit", push_limit);
}

ReferenceServo::ReferenceServo(Situation& situation,
                               const std::map<std::string, std::shared_ptr<const robot::Model>>& models,
                               const SequencerOptions& shared, const ReferenceServoOptions& options)
    : s_(situation),
      shared_(shared),
      options_(options),
      hand_shape_(s_.model->HandShape(s_.model->gripper().max_opening)),
      state_(s_.model, GravityIn(s_.X_WB)),
      controller_(s_.model, options_.gains, s_.model->home()),
      supports_(s_, {}),
      after_contact_(s_, supports_),
      posture_search_(s_.model),
      transit_(s_, options_.arm, options_.servo.constraints),
      reference_arm_(s_.model),
      reach_search_(s_.model),
      contact_(options_.contact),
      carried_(s_.objects.size()),
      watch_(shared_.watch()),
      posture_(s_.model->home()),
      posture_goal_(s_.model->home()) {
  size_t parts = hand_shape_.parts.size();
  for (const auto& object : s_.scene.objects) parts += object.shape.parts.size();
  body_bounds_.reserve(parts);
  obstacle_bounds_.reserve(parts);
  allowed_.reserve(6 * s_.scene.objects.size() + 8);
  if (options_.constrained) {
    MakeServo();
  } else {
    limiter_.emplace(s_.model, control::LimiterOptions{.period = shared_.period});
  }
  carried_torque_.setZero(s_.model->dof());
  for (const auto& robot : s_.scene.robots) {
    if (robot.name == s_.robot) continue;
    const auto& model = models.at(robot.name);
    neighbours_.push_back(
        {robot.name,
         robot::State(model, GravityIn(s_.scene.InitialPose(robot.name))),
         control::OperationalSpaceController(model, options_.gains, model->home()),
         {},
         std::make_unique<control::TorqueLimiter>(model, control::LimiterOptions{.period = shared_.period}),
         false});
  }
}

void ReferenceServo::Prepare(robot::Commands* commands) const {
  (*commands)[s_.robot].torque = Eigen::VectorXd::Zero(s_.model->dof());
  for (const Neighbour& other : neighbours_) {
    (*commands)[other.name].torque = Eigen::VectorXd::Zero(other.state.q().size());
  }
}

void ReferenceServo::Sense() {
  state_.Set(s_.q, s_.v);
  if (!s_.trustworthy) return;
  s_.X_WH = s_.X_WB * state_.X_BH();
  s_.V_WH.noalias() = state_.J_BH() * s_.v;
  s_.V_WH.head<3>() = (s_.X_WB.R * s_.V_WH.head<3>()).eval();
  s_.V_WH.tail<3>() = (s_.X_WB.R * s_.V_WH.tail<3>()).eval();
}

void ReferenceServo::Begin() {
  frame_ = {};
  ResetReferenceToHand();
  s_.gripper.mode = robot::GripperCommand::Mode::kOpening;
  s_.gripper.opening = s_.opening;
  posture_ = s_.q;
}

void ReferenceServo::BeginStep() {
  X_TC_ = s_.plan_step().X_TC;
  limit_reported_ = false;
  // A push by the hand itself keeps the orientation in which it reached for the object.
  if (!s_.current().push) turned_ = false;
}

void ReferenceServo::BeginVerb() {
  LeaveTransit();
  transits_ = 0;
  path_ended_ = false;
  room_ = -1;
  now_ = {};
  now_.X_TG = reference_.X_TR();
  after_contact_.Start();
}

void ReferenceServo::Rest(bool first) {
  if (first) Hold();
  GoAlong();
}

// What stands on what is held moves with it.
void ReferenceServo::HeldChanged() {
  supports_.Find();
  if (s_.held == kNone) return;
  for (const ObjectId i : carried_.ids()) carried_[i] = IsCarriedBy(s_, s_.held, i);
}

void ReferenceServo::GoAlong() {
  const std::optional<AttachedFrame> next = after_contact_.NextFrame(frame_.object);
  if (!next) return;
  const math::Pose X_WG = X_WF(frame_) * now_.X_TG;
  SwitchFrame(*next);
  now_.X_TG = math::Between(X_WF(frame_), X_WG);
}

void ReferenceServo::Stop() {
  after_contact_.Remember();
  LeaveTransit();
  Hold();
}

// A reach begins anew, from where the arm is; a shift has been led half of its way.
void ReferenceServo::Resume() {
  if (!s_.in_plan() && !s_.recovering) return ResetReferenceToHand();
  LeaveTransit();
  posture_ = s_.q;
  const VerbState now = now_;
  ResetReferenceToHand();
  if (std::holds_alternative<planning::ReachVerb>(s_.present_verb())) return BeginVerb();
  now_ = now;
  watch_.Excuse(s_.time);
}

void ReferenceServo::Command(const robot::Observations& observations, robot::Commands* commands) {
  if (!s_.stopping) resting_.reset();
  if (s_.trustworthy && !s_.stopping) {
    MoveReference();
    AimPosture();
  }
  CommandTorque(&commands->find(s_.robot)->second);
  CommandOthers(observations, commands);
  ++tick_;
}

void ReferenceServo::CommandOthers(const robot::Observations& observations, robot::Commands* commands) {
  for (Neighbour& other : neighbours_) {
    const auto found = observations.find(other.name);
    if (found == observations.end()) continue;
    robot::Command& command = commands->find(other.name)->second;
    other.state.Set(found->second.q, found->second.v);
    if (!other.started) {
      other.started = true;
      other.target.X_BH = other.state.X_BH();
      other.controller.set_posture(found->second.q);
      command.gripper.opening = found->second.gripper_opening;
    }
    command.torque = other.limiter->Limit(other.state, other.controller.Compute(other.state, other.target));
  }
}

}  // namespace tether::execution
