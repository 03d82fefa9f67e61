#include <algorithm>

#include "tether/common/random.h"
#include "tether/execution/servo/velocity_servo.h"
#include "tether/motion/path_search.h"

namespace tether::execution {
namespace {

using Eigen::VectorXd;

// Configurations that are tried as ends of a detour, the first from where the arm stands.
constexpr int kStarts = 24;
constexpr double kSpread = 1.2;  // rad
// The ends are found by following the goal without obstacles, step by step.
constexpr int kSteps = 200;
constexpr double kStep = 0.05;  // s
// Rows may be violated by this much where a detour begins and ends, m or rad …
constexpr double kTolerance = 1e-3;
// The search: configurations that are looked at, how far trees grow at once, rad, and tries at cutting off
// pieces.
constexpr int64_t kMaxChecks = 20'000;
constexpr double kRange = 0.5;
constexpr int kShortcuts = 60;
// … and have this to spare further than kEnd from there, if possible: the controller has to follow, m or rad.
constexpr double kSpare = 0.003, kEnd = 0.15;

}  // namespace

namespace {

/// Why no path was found.
std::string Explain(const motion::Path& path) {
  switch (path.status) {
    case motion::PathStatus::kFound:
      break;
    case motion::PathStatus::kNoFreeGoal:
      return "the arm would touch something wherever it gets there";
    case motion::PathStatus::kStartNotFree:
      return "the arm is too near to something where it stands";
    case motion::PathStatus::kGaveUp:
      return "none was found in " + std::to_string(path.checks) + " checks";
  }
  return "";
}

/// For steps of kStep along a goal that nothing obstructs.
control::VelocityOptions WithoutObstacles(control::VelocityOptions options) {
  options.gain = options.field_gain = 0.5 / kStep;
  options.escape_speed = 1;
  options.ramp = 0;
  options.self_distance = 0;
  return options;
}

/// The pairs that a body is of; none for −1.
std::vector<std::pair<int, int>> PairsOf(int body, std::vector<std::pair<int, int>> pairs) {
  std::erase_if(pairs,
                [body](const auto& pair) { return body < 0 || (pair.first != body && pair.second != body); });
  return pairs;
}

}  // namespace

// Configurations at the goal: the arm follows it without obstacles, under the constraints on frames only.
std::vector<VectorXd> VelocityServo::FindDetourEnds(
    const std::function<void(const VectorXd&)>& place,
    const IndexedVector<ObjectId, control::MovingPose>& still) const {
  const control::ArmBodies bodies(s_.model, control_scene_.solids());
  std::vector<control::FieldConstraint> fields =
      BuildConstraints(options_.constraints, control_scene_, bodies).fields;
  fields.insert(fields.end(), verb_fields_.begin(), verb_fields_.end());
  control::ConstrainedVelocity follower(s_.model, control_scene_.X_WBase(), control_scene_.solids(), {},
                                        fields, WithoutObstacles(options_.controller));
  if (s_.held.valid()) follower.Hold(s_.held.value());
  control::Goal wanted = *goal_;
  wanted.speed = wanted.turn_speed = 1;
  Random random(static_cast<uint64_t>(s_.step) + 1);
  std::vector<VectorXd> ends;
  for (int start = 0; start < kStarts; ++start) {
    VectorXd end = s_.q;
    for (int i = 0; i < end.size() && start > 0; ++i) {
      end[i] =
          std::clamp(end[i] + random.Uniform(-kSpread, kSpread), s_.model->lower()[i], s_.model->upper()[i]);
    }
    bool reached = false;
    for (int step = 0; step < kSteps && !reached; ++step) {
      place(end);
      const VectorXd& v = follower.Compute({end, s_.opening, still.values()}, &wanted);
      reached = follower.error_m() < tolerance_m_ && follower.error_rad() < tolerance_rad_;
      if (!reached) end += kStep * v;
    }
    if (reached) ends.push_back(std::move(end));
  }
  return ends;
}

std::vector<VectorXd> VelocityServo::FindDetour(std::string& why) {
  IndexedVector<ObjectId, control::MovingPose> still = s_.objects;
  for (control::MovingPose& object : still) object.V.setZero();
  robot::Kinematics kinematics(s_.model);
  const auto place = [&](const VectorXd& at_q) {
    if (!s_.held.valid()) return;
    kinematics.Set(at_q);
    still[s_.held].X = control_scene_.X_WBase() * kinematics.X_BH() * s_.X_HO_grasp;
  };

  motion::PathProblem problem;
  problem.goals = FindDetourEnds(place, still);
  if (problem.goals.empty()) {
    why = "the arm does not get there without obstacles either";
    return {};
  }

  // What the hand may touch where it gets to, it keeps away from on the way there.
  const control::ArmBodies bodies(s_.model, control_scene_.solids());
  control::ConstrainedVelocity probe = MakeController(), probe_between = MakeController();
  probe.Allow(allowed_bodies_);
  probe_between.Allow(PairsOf(s_.held.valid() ? bodies.object(s_.held.value()) : -1, allowed_bodies_));
  if (s_.held.valid()) {
    probe.Hold(s_.held.value());
    probe_between.Hold(s_.held.value());
  }
  const double margin = options_.controller.joint_margin;
  problem.lower = (s_.model->lower().array() + margin).matrix();
  problem.upper = (s_.model->upper().array() - margin).matrix();
  problem.start = s_.q;
  problem.seed = static_cast<uint64_t>(s_.step) + 1;
  problem.max_checks = kMaxChecks;
  problem.range = kRange;
  problem.shortcuts = kShortcuts;
  double spare = kSpare;
  problem.is_free = [&](const VectorXd& where) {
    bool at_end = (where - s_.q).cwiseAbs().maxCoeff() < kEnd;
    for (const VectorXd& end : problem.goals) at_end = at_end || (where - end).cwiseAbs().maxCoeff() < kEnd;
    const double least = at_end ? -options_.controller.buffer - kTolerance : spare;
    place(where);
    control::ConstrainedVelocity& rows = at_end ? probe : probe_between;
    rows.Compute({where, s_.opening, still.values()}, nullptr);
    for (int i = 0; i < rows.num_rows(); ++i) {
      const control::ConstrainedVelocity::Row& row = rows.row(i);
      if (row.priority == 0 && row.value < least) return false;
    }
    return !rows.flags().fault;
  };
  // The end of the branch that the arm is in first, then any.
  motion::PathProblem first = problem;
  first.goals.resize(1);
  first.max_checks = kMaxChecks / 4;
  motion::Path found = motion::FindPath(first);
  if (found.status != motion::PathStatus::kFound) found = motion::FindPath(problem);
  if (found.status == motion::PathStatus::kGaveUp) {
    spare = 0;
    found = motion::FindPath(problem);
  }
  if (found.status != motion::PathStatus::kFound) why = Explain(found);
  return std::move(found.q);
}

}  // namespace tether::execution
