#include "tether/execution/reference/arm_transit.h"

#include <algorithm>
#include <utility>

#include "tether/common/text.h"
#include "tether/motion/start_check.h"
#include "tether/robot/gravity.h"

namespace tether::execution {
namespace {

// The share of the speed changes by so much a second: a trajectory is stopped within a fifth of one.
constexpr double kRateChange = 5;
// Objects that have moved by less since the path was found free are where they were, m, and rad.
constexpr double kMoved = 0.002, kTurned = 0.01;
// The path ahead is looked at in pieces of so long, s, and keeps this share of the clearance.
constexpr double kPiece = 0.04, kShare = 0.1;
// Of a tilt, that paths keep.
constexpr double kTiltShare = 0.9;
// A velocity at the start is taken up within this time, s, or longer so that it asks for no more than this
// share of the joints' accelerations.
constexpr double kTakeUp = 0.12, kTakeUpShare = 0.5;
// Goals that are nearer than this are reached along a straight line, m and rad.
constexpr double kNear = 0.02, kNearTurned = 0.1;
// A goal that has moved by more since the path was found gets another path, m and rad.
constexpr double kGoalMoved = 0.02, kGoalTurned = 0.15;

bool IsWithin(const math::Pose& a, const math::Pose& b, double distance, double angle) {
  return (a.p - b.p).norm() <= distance && math::AngleBetween(a.R, b.R) <= angle;
}

}  // namespace

bool IsNearForTransit(const math::Pose& X_BH, const math::Pose& X_BGoal) {
  return IsWithin(X_BH, X_BGoal, kNear, kNearTurned);
}

bool HasMovedForTransit(const math::Pose& X_BGoal, const math::Pose& X_BGoalThen) {
  return !IsWithin(X_BGoal, X_BGoalThen, kGoalMoved, kGoalTurned);
}

ArmTransit::ArmTransit(const Situation& situation, const ArmTransitOptions& options,
                       const std::vector<control::ConstraintSpec>& constraints)
    : s_(situation),
      options_(options),
      state_(s_.model, s_.X_WB.R.transpose() * Eigen::Vector3d(0, 0, -robot::kGravity)) {
  const Eigen::Index n = s_.model->dof();
  joints_ = {s_.model->home(), Eigen::VectorXd::Zero(n), Eigen::VectorXd::Zero(n)};
  for (const control::ConstraintSpec& spec : constraints) {
    if (spec.kind == "tilt") tilts_.push_back(spec);
  }
}

/// The tilt that holds now: of the hand, or of what it holds.
std::optional<motion::TiltLimit> ArmTransit::FindTilt() const {
  for (const control::ConstraintSpec& spec : tilts_) {
    const bool of_held = s_.held != kNone && (spec.frame == "held" || spec.frame == s_.object_name(s_.held));
    if (spec.frame != "hand" && !of_held) continue;
    motion::TiltLimit tilt;
    tilt.axis_H =
        of_held ? Eigen::Vector3d(s_.X_WH.R.transpose() * s_.X_WO(s_.held).R * spec.axis) : spec.axis;
    tilt.direction_B = s_.X_WB.R.transpose() * spec.from;
    tilt.max = kTiltShare * spec.max;
    return tilt;
  }
  return std::nullopt;
}

motion::Snapshot ArmTransit::TakeSnapshot() const {
  motion::Snapshot snapshot;
  snapshot.model = s_.model;
  snapshot.clearance = options_.clearance;
  // The hand may still be opening.
  const bool opening = s_.gripper.mode == robot::GripperCommand::Mode::kOpening;
  snapshot.opening = opening ? std::max(s_.opening, s_.gripper.opening) : s_.opening;
  const math::Pose X_BW = s_.X_WB.Inverse();
  for (const ObjectId i : s_.objects.ids()) {
    const scene::Object& object = s_.object(i);
    if (moves_with_hand_(i)) {
      snapshot.held.push_back({object.name, object.shape, math::Between(s_.X_WH, s_.objects[i].X)});
    } else {
      snapshot.obstacles.push_back({object.name, object.shape, X_BW * s_.objects[i].X});
    }
  }
  for (const OtherArm& other : s_.others)
    motion::AddArm(other.name, *other.model, other.q, X_BW * other.X_WB, &snapshot.obstacles);
  return snapshot;
}

bool ArmTransit::Begin(const Eigen::VectorXd& q, const Eigen::VectorXd& v,
                       std::vector<motion::TransitGoal> goals, const MovesWithHand& moves_with_hand,
                       const std::vector<Eigen::VectorXd>* known) {
  active_ = braking_ = false;
  moves_with_hand_ = moves_with_hand;
  motion::TransitProblem problem;
  problem.snapshot = TakeSnapshot();
  problem.start = q;
  problem.goals = std::move(goals);
  problem.seed = static_cast<uint64_t>(s_.step) + 1;
  problem.max_checks = options_.max_checks;
  problem.tilt = FindTilt();
  if (known != nullptr) problem.known = *known;
  transit_ = motion::FindTransit(problem);
  if (!transit_.found()) return false;
  seen_.clear();
  for (const control::MovingPose& object : s_.objects) seen_.push_back(object.X);
  Time(std::move(problem.snapshot));
  time_ = 0;
  rate_ = 1;
  next_look_ = 0;
  TakeUpVelocity(v);
  Evaluate();
  active_ = true;
  return true;
}

// The trajectory begins at rest: to it is added v t (1 − t/T)², which begins with the velocity v and ends at
// rest, where it began.
void ArmTransit::TakeUpVelocity(const Eigen::VectorXd& v) {
  v_start_ = v;
  // A motion so short begins at rest.
  if (trajectory_.duration() < kTakeUp) v_start_.setZero();
  const double most = v.cwiseAbs().cwiseQuotient(kTakeUpShare * s_.model->max_acceleration()).maxCoeff();
  take_up_time_ = std::min(std::max(kTakeUp, 4 * most), trajectory_.duration());
}

void ArmTransit::Evaluate() {
  trajectory_.Evaluate(time_, &joints_);
  if (time_ >= take_up_time_) return;
  const double u = time_ / take_up_time_;
  joints_.q += v_start_ * (time_ * (1 - u) * (1 - u));
  joints_.v += v_start_ * ((1 - u) * (1 - 3 * u));
  joints_.a += v_start_ * ((6 * u - 4) / take_up_time_);
}

void ArmTransit::Time(motion::Snapshot snapshot) {
  const motion::JointLimits limits =
      motion::LimitsOf(*s_.model, options_.velocity_share, options_.acceleration_share, options_.jerk_share);
  trajectory_ = motion::TimePath(transit_.path, limits);
  // Corners are cut by a little: where even that is too much, the arm stops at them.
  snapshot.clearance = kShare * transit_.clearance;
  motion::PathChecker checker(motion::CollisionScene::Compile(snapshot));
  const Eigen::MatrixXd& samples = trajectory_.samples();
  const auto stride = static_cast<Eigen::Index>(kPiece / trajectory_.period()) + 1;
  bool free = checker.IsFree(transit_.path.front());
  for (Eigen::Index k = 0; free && k + 1 < samples.cols(); k += stride)
    free = checker.IsFree(samples.col(k), samples.col(std::min(k + stride, samples.cols() - 1)));
  if (!free) trajectory_ = motion::TimePath(transit_.path, limits, motion::Corners::kStop);
  motion::LoadLimits load;
  load.hand_speed = options_.hand_speed;
  load.hand_acceleration = s_.held == kNone ? options_.hand_acceleration : options_.held_acceleration;
  if (s_.held != kNone) {
    const scene::Object& object = s_.object(s_.held);
    load.payload = object.mass.value_or(0);
    load.p_HC = math::Between(s_.X_WH, s_.X_WO(s_.held)) * geometry::CentreOfMass(object.shape);
  }
  motion::StretchForLoad(load, state_, &trajectory_);
}

std::string ArmTransit::Describe() const {
  return Fixed(trajectory_.duration(), 2) + " s along " + std::to_string(transit_.path.size()) +
         " configurations";
}

void ArmTransit::Advance(double dt, double rate) {
  const double wanted = braking_ ? 0 : std::clamp(rate, 0.0, 1.0);
  rate_ += std::clamp(wanted - rate_, -kRateChange * dt, kRateChange * dt);
  time_ += rate_ * dt;
  Evaluate();
  joints_.v *= rate_;
  joints_.a *= rate_ * rate_;
}

bool ArmTransit::IsFreeAhead() {
  if (s_.time < next_look_) return true;
  next_look_ = s_.time + options_.look_ahead_period;
  bool moved = false;
  for (const ObjectId i : s_.objects.ids()) {
    if (moved) break;
    if (moves_with_hand_(i)) continue;
    const math::Pose& X = s_.objects[i].X;
    moved = (X.p - seen_[i].p).norm() > kMoved || math::AngleBetween(X.R, seen_[i].R) > kTurned;
  }
  if (!moved) return true;
  for (const ObjectId i : s_.objects.ids()) seen_[i] = s_.objects[i].X;
  motion::Snapshot snapshot = TakeSnapshot();
  snapshot.clearance *= kShare;
  motion::PathChecker checker(motion::CollisionScene::Compile(snapshot));
  motion::JointReference from = joints_, to = joints_;
  for (double t = time_; t < trajectory_.duration(); t += kPiece) {
    trajectory_.Evaluate(t + kPiece, &to);
    if (!checker.IsFree(from.q, to.q)) return false;
    from.q = to.q;
  }
  return true;
}

}  // namespace tether::execution
