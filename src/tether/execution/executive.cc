#include "tether/execution/executive.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstdio>
#include <variant>

#include "tether/common/error.h"
#include "tether/execution/executive_impl.h"
#include "tether/geometry/distance.h"

namespace tether::execution {
namespace {

constexpr double kGravity = 9.81;
// The null-space posture moves towards its goal at most this fast, rad/s.
constexpr double kPostureSpeed = 0.8;
// How long a grasp must look lost before it counts, s.
constexpr double kLostFor = 0.05;
// The payload's weight is taken over within this time after grasping, s.
constexpr double kTakeOver = 0.3;
// Obstacles are looked for every so many ticks.
constexpr int kObstacleTicks = 4;
// A hand this many leashes behind is no longer pulled to its reference; the reference starts over from the
// hand.
constexpr double kLostHand = 3;
// Hand rise before a retry, m.
constexpr double kRecoveryRise = 0.08;

std::shared_ptr<const robot::Model> FindModel(
    const std::map<std::string, std::shared_ptr<const robot::Model>>& models, const std::string& robot) {
  const auto found = models.find(robot);
  if (found != models.end()) return found->second;
  std::vector<std::string> names;
  for (const auto& entry : models) names.push_back(entry.first);
  throw InputError("the plan is for robot '" + robot + "', which is not in the scene",
                   JoinAlternatives(names));
}

Eigen::Vector3d GravityIn(const math::Pose& X_WB) {
  return X_WB.R.transpose() * Eigen::Vector3d(0, 0, -kGravity);
}

bool IsFinite(const math::Pose& X) { return X.R.allFinite() && X.p.allFinite(); }

}  // namespace

std::string Millimetres(double metres) {
  char text[32];
  std::snprintf(text, sizeof text, "%.1f mm", 1000 * metres);
  return text;
}

void ExecutiveOptions::Validate() const {
  gains.Validate();
  Diagnostics diagnostics;
  const auto check = [&](const char* name, double value) {
    if (std::isfinite(value) && value > 0) return;
    diagnostics.Add({}, std::string("execution option '") + name + "' is " + Value(value).AsText(),
                    "a finite number above 0");
  };
  check("period", period);
  check("motion.speed", motion.speed);
  check("motion.acceleration", motion.acceleration);
  check("motion.angular_speed", motion.angular_speed);
  check("motion.angular_acceleration", motion.angular_acceleration);
  check("transit.side", transit.side);
  check("transit.above", transit.above);
  check("contact.threshold", contact.threshold);
  check("contact_search", contact_search);
  check("leash", leash);
  check("obstacle_range", obstacle_range);
  check("least_width", least_width);
  check("slip_distance", slip_distance);
  check("slip_angle", slip_angle);
  check("push_tolerance", push_tolerance);
  check("stall_time", stall_time);
  check("verb_timeout", verb_timeout);
  if (max_retries < 0) diagnostics.Add({}, "execution option 'max_retries' is negative", "0 or more");
  diagnostics.ThrowIfAny();
}

Executive::Impl::Impl(const scene::Scene& scene_in,
                      const std::map<std::string, std::shared_ptr<const robot::Model>>& models,
                      planning::Plan plan_in, const ExecutiveOptions& options_in)
    : scene_(scene_in),
      options_(options_in),
      resolved_(Resolve(scene_in, std::move(plan_in))),
      robot_(resolved_.plan.robot),
      model_(FindModel(models, robot_)),
      X_WB_(scene_.InitialPose(robot_)),
      hand_shape_(model_->HandShape(model_->gripper().max_opening)),
      state_(model_, GravityIn(X_WB_)),
      controller_(model_, options_.gains, model_->home()),
      posture_search_(model_),
      contact_(options_.contact),
      objects_(scene_.objects.size()),
      tau_external_(Eigen::VectorXd::Zero(model_->dof())),
      posture_(model_->home()),
      posture_goal_(model_->home()) {
  options_.Validate();
  size_t parts = hand_shape_.parts.size();
  for (const auto& object : scene_.objects) parts += object.shape.parts.size();
  body_bounds_.reserve(parts);
  obstacle_bounds_.reserve(parts);
  gripper_.mode = robot::GripperCommand::Mode::kOpening;
  for (const auto& robot : scene_.robots) {
    const auto model = FindModel(models, robot.name);
    commands_[robot.name].torque = Eigen::VectorXd::Zero(model->dof());
    if (robot.name == robot_) continue;
    bystanders_.push_back({robot.name,
                           robot::State(model, GravityIn(scene_.InitialPose(robot.name))),
                           control::OperationalSpaceController(model, options_.gains, model->home()),
                           {},
                           false});
  }
  for (size_t i = 0; i < resolved_.plan.steps.size(); ++i) {
    records_.push_back({});
    records_.back().step = static_cast<int>(i);
  }
}

const robot::Commands& Executive::Impl::Step(const scene::WorldEstimate& estimate,
                                             const robot::Observations& observations) {
  const auto seen = observations.find(robot_);
  assert(seen != observations.end());
  Sense(estimate, seen->second);
  if (trustworthy_) {
    if (status_.state == ExecutiveStatus::State::kRunning) {
      MonitorGrasp();
      RunVerb();
    }
    MoveReference();
    AimPosture();
  }
  Command(&commands_.find(robot_)->second);
  for (Bystander& other : bystanders_) {
    const auto found = observations.find(other.name);
    if (found == observations.end()) continue;
    robot::Command& command = commands_.find(other.name)->second;
    other.state.Set(found->second.q, found->second.v);
    if (!other.started) {
      other.started = true;
      other.target.X_BH = other.state.X_BH();
      other.controller.set_posture(found->second.q);
      command.gripper.opening = found->second.gripper_opening;
    }
    command.torque = other.controller.Compute(other.state, other.target);
  }
  ++tick_;
  return commands_;
}

void Executive::Impl::Sense(const scene::WorldEstimate& estimate, const robot::Observation& seen) {
  trustworthy_ = std::isfinite(seen.time) && seen.q.allFinite() && seen.v.allFinite() &&
                 std::isfinite(seen.gripper_opening);
  if (std::isfinite(seen.time)) time_ = seen.time;
  const bool news = estimate.time > estimate_time_;
  bool bad = false;
  for (size_t i = 0; i < objects_.size(); ++i) {
    FrameTracker& tracker = objects_[i];
    if (started_) tracker.Predict(time_);
    if (!news && started_) continue;
    const auto found = estimate.X_WO.find(scene_.objects[i].name);
    const bool usable = found != estimate.X_WO.end() && IsFinite(found->second);
    if (found != estimate.X_WO.end() && !usable) bad = true;
    if (!started_) {
      tracker.Reset(usable ? found->second : scene_.InitialPose(scene_.objects[i].name), time_);
    } else if (usable) {
      tracker.Correct(found->second);
    }
  }
  if (news) estimate_time_ = estimate.time;
  if (bad && !estimate_bad_) {
    Record(EventKind::kEstimateInvalid, "an object's pose is not finite; the last one is used");
  }
  if (news) estimate_bad_ = bad;

  state_.Set(seen.q, seen.v);
  if (!trustworthy_) return;
  opening_ = seen.gripper_opening;
  X_WH_ = X_WB_ * state_.X_BH();
  V_WH_.noalias() = state_.J_BH() * seen.v;
  V_WH_.head<3>() = (X_WB_.R * V_WH_.head<3>()).eval();
  V_WH_.tail<3>() = (X_WB_.R * V_WH_.tail<3>()).eval();
  tau_external_ = seen.tau_external;
  if (started_) return;
  started_ = true;
  frame_ = {};
  ResetReferenceToHand();
  now_.X_TG = reference_.X_TR();
  gripper_.opening = opening_;
  posture_ = seen.q;
  if (resolved_.plan.steps.empty()) {
    status_.state = ExecutiveStatus::State::kFinished;
    Record(EventKind::kFinished, "the plan is empty");
  } else {
    EnterStep(0);
  }
}

void Executive::Impl::Record(EventKind kind, std::string text) {
  events_.push_back({time_, kind, std::min(step_, static_cast<int>(records_.size()) - 1), std::move(text)});
}

void Executive::Impl::EnterStep(int index) {
  step_ = index;
  verb_ = 0;
  now_ = {};
  now_.X_TG = reference_.X_TR();
  recovering_ = false;
  if (step().action_start == index) Record(EventKind::kActionStarted, plan_step().action);
  Record(EventKind::kStepStarted, plan_step().control + " to " + plan_step().target);
  StepRecord& record = records_[index];
  record.start = time_;
  ++record.attempts;
  // A push by the hand itself keeps the orientation in which it reached for the object.
  if (!step().push) turned_ = false;
}

void Executive::Impl::FinishStep() {
  StepRecord& record = records_[step_];
  record.end = time_;
  Record(EventKind::kStepFinished,
         plan_step().action + ": " + Millimetres(record.position_error) + " from its pose");
  if (step_ + 1 < static_cast<int>(resolved_.steps.size())) {
    EnterStep(step_ + 1);
    return;
  }
  Hold();
  step_ = static_cast<int>(resolved_.steps.size());
  status_.state = ExecutiveStatus::State::kFinished;
  Record(EventKind::kFinished, "");
}

void Executive::Impl::RunVerb() {
  const Outcome outcome =
      std::visit([this](const auto& verb) { return Run(verb); }, verbs()[static_cast<size_t>(verb_)]);
  if (outcome != Outcome::kDone) return;
  ++verb_;
  now_ = {};
  now_.X_TG = reference_.X_TR();
  if (verb_ < static_cast<int>(verbs().size())) return;
  if (recovering_) {
    EnterStep(step_);
  } else {
    FinishStep();
  }
}

void Executive::Impl::Abort(EventKind kind, const std::string& reason, int resume, bool open) {
  Record(kind, reason);
  const int action = resolved_.plan.steps[static_cast<size_t>(step_)].action_index;
  Hold();
  if (retries_[action] >= options_.max_retries) {
    status_.state = ExecutiveStatus::State::kFailed;
    status_.reason = plan_step().action + ": " + reason;
    Record(EventKind::kFailed, status_.reason);
    return;
  }
  ++retries_[action];
  ++retry_count_;
  step_ = resume;
  Record(EventKind::kRetry, plan_step().action + " again");
  recovery_.clear();
  if (open) recovery_.emplace_back(planning::GripperVerb{});
  planning::ShiftVerb rise;
  rise.by = Eigen::Vector3d(0, 0, kRecoveryRise);
  recovery_.emplace_back(rise);
  recovering_ = true;
  verb_ = 0;
  now_ = {};
  now_.X_TG = reference_.X_TR();
}

void Executive::Impl::MonitorGrasp() {
  if (held_ == kNone) return;
  const math::Pose X_HO = math::Between(X_WH_, X_WO(held_));
  const bool slipped = (X_HO.p - X_HO_grasp_.p).norm() > options_.slip_distance ||
                       math::AngleBetween(X_HO.R, X_HO_grasp_.R) > options_.slip_angle;
  const bool empty = opening_ < options_.least_width;
  lost_time_ = slipped || empty ? lost_time_ + options_.period : 0;
  if (lost_time_ < kLostFor) return;
  const std::string name = scene_.objects[static_cast<size_t>(held_)].name;
  held_ = kNone;
  lost_time_ = 0;
  int resume = recovering_ ? step_ : step().grasp_step;
  for (const int object : step().close_on) {
    if (object != kNone) resume = step_;
  }
  if (resume == kNone) resume = step_;
  Abort(EventKind::kGraspLost,
        empty ? "'" + name + "' is no longer between the fingers" : "'" + name + "' slipped away", resume,
        true);
}

math::Pose Executive::Impl::X_WF(const AttachedFrame& frame) const {
  return frame.object == kNone ? frame.X_OF : X_WO(frame.object) * frame.X_OF;
}

math::Vector6d Executive::Impl::V_WF(const AttachedFrame& frame) const {
  math::Vector6d V = math::Vector6d::Zero();
  if (frame.object == kNone) return V;
  const FrameTracker& object = objects_[static_cast<size_t>(frame.object)];
  V = object.V_WF();
  const Eigen::Vector3d p_OF_W = object.X_WF().R * frame.X_OF.p;
  V.head<3>() += V.tail<3>().cross(p_OF_W);
  return V;
}

// The reference keeps its pose and velocity in the world, but now goes along with another frame.
void Executive::Impl::SwitchFrame(const AttachedFrame& frame) {
  const auto velocity_at = [this](const AttachedFrame& f, const math::Pose& X_WFrame,
                                  const Eigen::Vector3d& p_W) {
    math::Vector6d V = V_WF(f);
    V.head<3>() += V.tail<3>().cross(p_W - X_WFrame.p);
    return V;
  };
  const math::Pose X_WOld = X_WF(frame_);
  const math::Pose X_WNew = X_WF(frame);
  const math::Pose X_WRef = X_WOld * reference_.X_TR();
  math::Vector6d V = velocity_at(frame_, X_WOld, X_WRef.p) - velocity_at(frame, X_WNew, X_WRef.p);
  V.head<3>() += X_WOld.R * reference_.V_TR().head<3>();
  V.tail<3>() += X_WOld.R * reference_.V_TR().tail<3>();
  V.head<3>() = (X_WNew.R.transpose() * V.head<3>()).eval();
  V.tail<3>() = (X_WNew.R.transpose() * V.tail<3>()).eval();
  frame_ = frame;
  reference_.Reset(math::Between(X_WNew, X_WRef), V);
  now_.X_TG = reference_.X_TR();
}

void Executive::Impl::ResetReferenceToHand() {
  reference_.Reset(math::Between(X_WF(frame_), X_WH_));
  now_.X_TG = reference_.X_TR();
}

void Executive::Impl::MoveReference() {
  MotionLimits limits = options_.motion;
  limits.speed = std::min(limits.speed, now_.speed > 0 ? now_.speed : limits.speed);
  math::Pose X_WRef = X_WR();
  double lag = (X_WRef.p - X_WH_.p).norm();
  if (lag > kLostHand * options_.leash) {
    // The target jumped: the hand follows at its own speed, from where it is.
    const VerbState now = now_;
    ResetReferenceToHand();
    now_ = now;
    X_WRef = X_WH_;
    lag = 0;
  }
  const double turn_lag = math::AngleBetween(X_WRef.R, X_WH_.R);
  const double slack =
      std::clamp(2 - std::max(lag / options_.leash, turn_lag / (10 * options_.leash)), 0.0, 1.0);
  limits.speed *= slack;
  limits.angular_speed *= slack;

  math::Pose X_TWaypoint = now_.X_TG;
  if (now_.transit) {
    const math::Pose X_WT = X_WF(frame_);
    const math::Pose X_WG = X_WT * now_.X_TG;
    body_bounds_.clear();
    obstacle_bounds_.clear();
    const auto add_body = [&](const geometry::Shape& shape, const math::Pose& X_HS) {
      for (const auto& part : shape.parts) {
        const math::Pose X_HP = X_HS * part.X_SP;
        body_bounds_.push_back(
            Union(BoundsOf(part.primitive, math::Pose(X_WRef.R, Eigen::Vector3d::Zero()) * X_HP),
                  BoundsOf(part.primitive, math::Pose(X_WG.R, Eigen::Vector3d::Zero()) * X_HP)));
      }
    };
    add_body(hand_shape_, math::Pose());
    for (size_t i = 0; i < objects_.size(); ++i) {
      const geometry::Shape& shape = scene_.objects[i].shape;
      if (static_cast<int>(i) == held_) {
        add_body(shape, math::Between(X_WH_, objects_[i].X_WF()));
        continue;
      }
      for (const auto& part : shape.parts) {
        obstacle_bounds_.push_back(BoundsOf(part.primitive, objects_[i].X_WF() * part.X_SP));
      }
    }
    const double ceiling = X_WB_.p.z() + model_->reach().centre.z() + 0.5 * model_->reach().max;
    const Passage passage =
        CheckPassage(body_bounds_, X_WRef.p, X_WG.p, obstacle_bounds_, options_.transit, ceiling);
    X_TWaypoint = math::Between(X_WT, TransitWaypoint(passage, X_WRef, X_WG));
  }
  if (now_.funnel_length > 0) {
    const math::Pose X_TH = math::Between(X_WF(frame_), X_WH_);
    X_TWaypoint = FunnelWaypoint(now_.X_TG, now_.funnel_T, now_.funnel_length, reference_.X_TR(), X_TH);
  }
  reference_.Advance(X_TWaypoint, limits, options_.period);
}

void Executive::Impl::AimPosture() {
  if (!posture_search_.done()) {
    posture_search_.Advance();
    if (posture_search_.done())
      posture_goal_ = posture_search_.reached() ? posture_search_.q() : model_->home();
  }
  const double most = kPostureSpeed * options_.period;
  posture_ += (posture_goal_ - posture_).cwiseMax(-most).cwiseMin(most);
  controller_.set_posture(posture_);
}

void Executive::Impl::AvoidObstacles(control::HandTarget* target) {
  if (tick_ % kObstacleTicks == 0) {
    obstacle_weight_ = 0;
    const bool known = step_ < static_cast<int>(resolved_.steps.size());
    double nearest = options_.obstacle_range;
    for (size_t i = 0; i < objects_.size(); ++i) {
      const int object = static_cast<int>(i);
      // Contact that the step intends.
      if (object == held_) continue;
      if (known && (object == step().control || object == step().target.object || object == step().tool))
        continue;
      bool far = true;
      for (const auto& part : scene_.objects[i].shape.parts) {
        const Bounds bounds = BoundsOf(part.primitive, objects_[i].X_WF() * part.X_SP);
        const Eigen::Vector3d outside =
            (bounds.lower - X_WH_.p).cwiseMax(X_WH_.p - bounds.upper).cwiseMax(0.0);
        far = far && outside.norm() > 0.3;
      }
      if (far) continue;
      const geometry::Distance distance =
          geometry::SignedDistance(hand_shape_, X_WH_, scene_.objects[i].shape, objects_[i].X_WF());
      if (distance.distance >= nearest) continue;
      nearest = distance.distance;
      obstacle_direction_B_ = X_WB_.R.transpose() * distance.n_W;
      obstacle_weight_ = std::clamp(1 - nearest / options_.obstacle_range, 0.0, 1.0);
    }
  }
  target->toward_obstacle.setZero();
  if (obstacle_weight_ > 0) target->toward_obstacle = obstacle_direction_B_;
  target->obstacle_weight = obstacle_weight_;
}

void Executive::Impl::Command(robot::Command* command) {
  control::HandTarget target;
  const math::Pose X_WT = X_WF(frame_);
  const math::Vector6d V_WT = V_WF(frame_);
  const math::Pose X_WRef = X_WT * reference_.X_TR();
  target.X_BH = math::Between(X_WB_, X_WRef);
  const Eigen::Matrix3d R_BW = X_WB_.R.transpose();
  const Eigen::Matrix3d R_BT = R_BW * X_WT.R;
  target.V_BH.head<3>() =
      R_BW * (V_WT.head<3>() + V_WT.tail<3>().cross(X_WRef.p - X_WT.p)) + R_BT * reference_.V_TR().head<3>();
  target.V_BH.tail<3>() = R_BW * V_WT.tail<3>() + R_BT * reference_.V_TR().tail<3>();
  target.A_BH.head<3>() = R_BT * reference_.A_TR().head<3>();
  target.A_BH.tail<3>() = R_BT * reference_.A_TR().tail<3>();
  if (held_ != kNone) {
    const scene::Object& object = scene_.objects[static_cast<size_t>(held_)];
    const double share = std::clamp((time_ - held_since_) / kTakeOver, 0.0, 1.0);
    const Eigen::Vector3d lift(0, 0, share * object.mass.value_or(0) * kGravity);
    const Eigen::Vector3d arm = X_WO(held_) * geometry::CentreOfMass(object.shape) - X_WH_.p;
    target.F_BH.head<3>() = R_BW * lift;
    target.F_BH.tail<3>() = R_BW * arm.cross(lift);
  }
  if (trustworthy_) AvoidObstacles(&target);
  command->torque = controller_.Compute(state_, target);
  command->gripper = gripper_;
  WatchController();
}

void Executive::Impl::WatchController() {
  const control::ControlFlags& flags = controller_.flags();
  if (flags.fault && !fault_reported_) {
    Record(EventKind::kSafety, "the robot's state is not finite; the arm is braked");
  }
  if (flags.joint_limit && !limit_reported_) Record(EventKind::kSafety, "a joint is braked before its limit");
  fault_reported_ = flags.fault;
  // Once per step is enough.
  limit_reported_ = (limit_reported_ || flags.joint_limit) && now_.entered;
}

Executive::Executive(const scene::Scene& scene,
                     const std::map<std::string, std::shared_ptr<const robot::Model>>& models,
                     planning::Plan plan, const ExecutiveOptions& options)
    : impl_(std::make_unique<Impl>(scene, models, std::move(plan), options)) {}
Executive::~Executive() = default;
Executive::Executive(Executive&&) noexcept = default;
Executive& Executive::operator=(Executive&&) noexcept = default;

const robot::Commands& Executive::Step(const scene::WorldEstimate& estimate,
                                       const robot::Observations& observations) {
  return impl_->Step(estimate, observations);
}

const planning::Plan& Executive::plan() const { return impl_->resolved_.plan; }
const ExecutiveStatus& Executive::status() const { return impl_->status_; }
int Executive::step() const { return impl_->step_; }
const std::string& Executive::held() const {
  static const std::string nothing;
  return impl_->held_ == kNone ? nothing : impl_->scene_.objects[static_cast<size_t>(impl_->held_)].name;
}
const std::vector<Event>& Executive::events() const { return impl_->events_; }
const std::vector<StepRecord>& Executive::records() const { return impl_->records_; }
int Executive::retries() const { return impl_->retry_count_; }

}  // namespace tether::execution
