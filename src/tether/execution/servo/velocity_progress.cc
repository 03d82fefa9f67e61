#include <algorithm>
#include <cmath>

#include "tether/control/torque/singularity.h"
#include "tether/execution/servo/velocity_servo.h"

namespace tether::execution {
namespace {

using math::Pose;

// A configuration of a detour is passed this near, rad.
constexpr double kWaypoint = 0.04;
// Without progress for so long, it is asked whether the arm can reach the goal at all, s; and again once the
// target has moved by this, m and rad. An iteration of the search is made every so many seconds.
constexpr double kAskAfter = 0.4;
constexpr double kMoved = 0.02, kTurned = 0.1;
constexpr double kIteration = 0.001;

}  // namespace

std::string VelocityServo::WhatHoldsUp() const {
  // Rows at their limit: nearer than what is left in a tenth of a second.
  std::vector<std::pair<double, std::string>> rows;
  const control::ArmBodies& bodies = controller_.bodies();
  for (int i = 0; i < controller_.num_rows(); ++i) {
    const control::ConstrainedVelocity::Row& row = controller_.row(i);
    if (row.value > 0.01) continue;
    std::string name = controller_.constraint_name(row.constraint);
    if (row.a >= 0) name = bodies.name(row.a) + " near " + bodies.name(row.b);
    const bool known =
        std::any_of(rows.begin(), rows.end(), [&](const auto& one) { return one.second == name; });
    if (!known) rows.emplace_back(row.value, name);
  }
  std::sort(rows.begin(), rows.end());
  std::string text;
  for (size_t i = 0; i < rows.size() && i < 3; ++i) text += (i == 0 ? "held up by " : ", ") + rows[i].second;
  for (int i = 0; i < s_.model->dof(); ++i) {
    const double margin = options_.controller.joint_margin + 0.06;
    if (s_.q[i] > s_.model->lower()[i] + margin && s_.q[i] < s_.model->upper()[i] - margin) continue;
    text += (text.empty() ? "held up by " : ", ") + ("the limit of " + s_.model->joint_names()[ToIndex(i)]);
  }
  robot::Kinematics kinematics(s_.model);
  kinematics.Set(s_.q);
  Eigen::MatrixXd J_BH(6, s_.q.size());
  kinematics.HandJacobian(J_BH);
  if (control::FindDexterity(kinematics, J_BH, options_.torque.rotation_weight, 0).least <
      control::kSingular) {
    text += std::string(text.empty() ? "" : "; ") +
            "the arm is stretched or folded so far that the hand hardly moves (singular)";
  }
  return text.empty() ? "beyond what the arm can do there" : text;
}

// What is to be reached has gone where the arm does not get to, whatever it tries: fallen, rolled off,
// carried away; or no joint positions within their limits bring the hand there.
std::string VelocityServo::BeyondReach() const {
  if (!goal_) return "";
  const Pose X_WT = X_WTarget(goal_->target);
  const double distance = (X_WT.p - control_scene_.X_WBase() * s_.model->reach().centre).norm();
  // A frame may stand further from where it is reached than the arm reaches, but not by more than that again.
  const double most = 2 * s_.model->reach().max;
  if (distance > most) {
    return "'" + schema().target + "' is " + Length(distance) + " from the shoulder of '" + s_.robot +
           "', which reaches " + Length(s_.model->reach().max);
  }
  const bool near = goal_search_.nearest_m() <= tolerance_m_ && goal_search_.nearest_rad() <= tolerance_rad_;
  if (goal_search_.state() != GoalSearch::State::kOutOfReach || near) return "";
  return "'" + schema().target +
         "' is where the arm can't reach it: within its joints' limits it comes no nearer than " +
         Deviation(goal_search_.nearest_m(), goal_search_.nearest_rad());
}

// Without progress for some time it is asked whether any joint positions would do; and again once the target
// has moved.
void VelocityServo::SearchGoal() {
  if (!goal_ || goal_->functions.empty() || watch_.quiet(s_.time) < kAskAfter) return goal_search_.Stop();
  const Pose X_BT = math::Between(control_scene_.X_WBase(), X_WTarget(goal_->target));
  const bool moved = (goal_search_.X_BTarget().p - X_BT.p).norm() > kMoved ||
                     math::AngleBetween(goal_search_.X_BTarget().R, X_BT.R) > kTurned;
  if (moved || goal_search_.state() == GoalSearch::State::kIdle) {
    Pose X_HF = goal_->frame.X_OF;
    if (goal_->frame.object != -1 && s_.held != kNone)
      X_HF = math::Between(s_.X_WH, s_.objects[s_.held].X) * X_HF;
    goal_search_.Start(goal_->functions, X_BT, X_HF, s_.q);
  }
  // As many iterations as a controller with torques has ticks.
  const int iterations = std::max(1, static_cast<int>(std::lround(shared_.period / kIteration)));
  for (int i = 0; i < iterations; ++i) goal_search_.Advance();
}

bool VelocityServo::TryDetour(std::string& why) {
  if (detours_ > 1) why = "detours did not help";
  if (detours_ > 1 || !goal_) return false;
  ++detours_;
  path_ = FindDetour(why);
  waypoint_ = 0;
  if (path_.empty()) return false;
  if (drive_) drive_->SetExtraFields({});
  controller_.SetExtraFields({});  // the verb's own constraints begin anew at the end of the detour
  s_.Record(EventKind::kDetour,
            "a path of " + std::to_string(path_.size()) + " configurations leads round it");
  return true;
}

Progress VelocityServo::WatchProgress(double error) {
  if (!path_.empty()) {
    while (waypoint_ < path_.size() && (s_.q - path_[waypoint_]).cwiseAbs().maxCoeff() < kWaypoint) {
      ++waypoint_;
      watch_.NewStretch();
    }
    if (waypoint_ == path_.size()) {
      LeaveDetour();
      return Progress::Running();
    }
    if (!goal_ || goal_->posture.size() == 0) goal_ = control::Goal{};
    goal_->posture = path_[waypoint_];
    goal_->turn_speed = options_.turn_speed;
    error = (s_.q - path_[waypoint_]).cwiseAbs().maxCoeff();
  }
  watch_.Observe(error, s_.time);
  SearchGoal();
  return watch_.Stalled(s_.time) ? Stall() : Progress::Running();
}

// The verb begins anew.
void VelocityServo::LeaveDetour() {
  path_.clear();
  entered_ = false;
  braked_since_ = -1;
  goal_.reset();
}

Progress VelocityServo::Stall() {
  const std::string beyond = BeyondReach();
  if (!beyond.empty()) return Progress::GiveUp(EventKind::kStalled, beyond);
  std::string reason = "no progress, " + Length(controller_.error_m()) + " away: " + WhatHoldsUp();
  const bool late = watch_.Late(s_.time);
  watch_.Excuse(s_.time);
  if (!path_.empty()) {
    LeaveDetour();
    s_.Record(EventKind::kStalled, "on the detour, " + reason);
    return Progress::Running();
  }
  s_.Record(EventKind::kStalled, reason);
  std::string why;
  if (!late && TryDetour(why)) {
    watch_.NewStretch();
    return Progress::Running();
  }
  if (!why.empty()) reason += "; no detour: " + why;
  return Progress::Retry(EventKind::kStalled, reason, s_.step, false);
}

}  // namespace tether::execution
