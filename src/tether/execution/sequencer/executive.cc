#include "tether/execution/sequencer/executive.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <variant>

#include "tether/common/error.h"
#include "tether/common/text.h"
#include "tether/execution/observer/grasp_width.h"
#include "tether/execution/sequencer/executive_impl.h"

namespace tether::execution {
namespace {

constexpr double kGravity = 9.81;  // m/s²
// How long a grasp must look lost before it counts, s.
constexpr double kLostFor = 0.05;
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
  FormatInto(text, sizeof text, "%.1f mm", 1000 * metres);
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
  check("push_angle", push_angle);
  check("push_limit", push_limit);
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
      carried_(scene_.objects.size()),
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
    neighbours_.push_back({robot.name,
                           robot::State(model, GravityIn(scene_.InitialPose(robot.name))),
                           control::OperationalSpaceController(model, options_.gains, model->home()),
                           {},
                           false});
  }
  const size_t most_touching = 6 * scene_.objects.size() + 8;
  touching_.reserve(most_touching);
  named_.reserve(most_touching);
  allowed_.reserve(most_touching);
  supports_.reserve(scene_.objects.size());
  if (options_.constrained) MakeServo();
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
  for (Neighbour& other : neighbours_) {
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
  X_TC_ = plan_step().X_TC;
  recovering_ = false;
  limit_reported_ = false;
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
  before_recovery_ = TouchedNow();
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
  const bool empty = opening_ < std::max(options_.least_width, held_width_ - kWidthTolerance);
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
const std::vector<std::pair<std::string, std::string>>& Executive::allowed() const { return impl_->allowed_; }

}  // namespace tether::execution
