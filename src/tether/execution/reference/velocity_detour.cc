#include <algorithm>

#include "tether/common/random.h"
#include "tether/execution/sequencer/velocity_executive_impl.h"
#include "tether/motion/joint_path.h"

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
// … and have this to spare further than kEnd from there, if possible: the controller has to follow, m or rad.
constexpr double kSpare = 0.003, kEnd = 0.15;

}  // namespace

namespace {

/// Why no path was found.
std::string Explain(const motion::JointPath& path) {
  switch (path.status) {
    case motion::JointPathStatus::kFound:
      break;
    case motion::JointPathStatus::kNoFreeGoal:
      return "the arm would touch something wherever it gets there";
    case motion::JointPathStatus::kStartNotFree:
      return "the arm is too near to something where it stands";
    case motion::JointPathStatus::kGaveUp:
      return "none was found in " + std::to_string(path.checks) + " checks";
  }
  return "";
}

}  // namespace

std::vector<VectorXd> VelocityExecutive::Impl::FindDetour(std::string& why) {
  std::vector<control::MovingPose> still = objects;
  for (control::MovingPose& object : still) object.V.setZero();
  robot::Kinematics kinematics(model);
  const auto place = [&](const VectorXd& at_q) {
    if (held < 0) return;
    kinematics.Set(at_q);
    still[static_cast<size_t>(held)].X = control_scene.X_WBase() * kinematics.X_BH() * X_HO_grasp;
  };

  // A configuration at the goal: the arm follows it without obstacles, under the constraints on frames only.
  const control::ArmBodies bodies(model, control_scene.solids());
  std::vector<control::FieldConstraint> fields =
      BuildConstraints(options.constraints, control_scene, bodies, model->dof()).fields;
  fields.insert(fields.end(), verb_fields.begin(), verb_fields.end());
  control::VelocityOptions free_options = options.controller;
  free_options.gain = free_options.field_gain = 0.5 / kStep;
  free_options.escape_speed = 1;
  free_options.ramp = 0;
  free_options.self_distance = 0;
  control::ConstrainedVelocity follower(model, control_scene.X_WBase(), control_scene.solids(), {}, fields,
                                        free_options);
  if (held >= 0) follower.Hold(held);
  control::Goal wanted = *goal;
  wanted.speed = wanted.turn_speed = 1;
  Random random(static_cast<uint64_t>(at) + 1);
  motion::JointPathProblem problem;
  for (int start = 0; start < kStarts; ++start) {
    VectorXd end = q;
    for (int i = 0; i < end.size() && start > 0; ++i) {
      end[i] = std::clamp(end[i] + random.Uniform(-kSpread, kSpread), model->lower()[i], model->upper()[i]);
    }
    bool reached = false;
    for (int step = 0; step < kSteps && !reached; ++step) {
      place(end);
      const VectorXd& v = follower.Compute({end, opening, still}, &wanted);
      reached = follower.error_m() < tolerance_m && follower.error_rad() < tolerance_rad;
      if (!reached) end += kStep * v;
    }
    if (reached) problem.goals.push_back(std::move(end));
  }
  if (problem.goals.empty()) {
    why = "the arm does not get there without obstacles either";
    return {};
  }

  control::ConstrainedVelocity probe = MakeController();
  probe.Allow(allowed_bodies);
  if (held >= 0) probe.Hold(held);
  const double margin = options.controller.joint_margin;
  problem.lower = (model->lower().array() + margin).matrix();
  problem.upper = (model->upper().array() - margin).matrix();
  problem.start = q;
  problem.seed = static_cast<uint64_t>(at) + 1;
  double spare = kSpare;
  problem.is_free = [&](const VectorXd& where) {
    bool at_end = (where - q).cwiseAbs().maxCoeff() < kEnd;
    for (const VectorXd& end : problem.goals) at_end = at_end || (where - end).cwiseAbs().maxCoeff() < kEnd;
    const double least = at_end ? -options.controller.buffer - kTolerance : spare;
    place(where);
    probe.Compute({where, opening, still}, nullptr);
    for (int i = 0; i < probe.num_rows(); ++i) {
      const control::ConstrainedVelocity::Row& row = probe.row(i);
      if (row.priority == 0 && row.value < least) return false;
    }
    return !probe.flags().fault;
  };
  motion::JointPath found = motion::FindJointPath(problem);
  if (found.status == motion::JointPathStatus::kGaveUp) {
    spare = 0;
    found = motion::FindJointPath(problem);
  }
  if (found.status != motion::JointPathStatus::kFound) why = Explain(found);
  return std::move(found.q);
}

}  // namespace tether::execution
