#include "tether/planning/replan/optimum.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "tether/constraints/grasps/upper_face.h"
#include "tether/planning/ik/ik_rows.h"
#include "tether/planning/ik/turned_grasps.h"
#include "tether/planning/program/effort.h"

namespace tether::planning {
namespace {

constexpr int kClearanceRounds = 8;

/// PlanStep::face.
std::string FaceOf(const SceneFacts& facts, const BoundStep& step, const math::Pose& X_TC) {
  const std::string &control = step.schema.control, &target = step.schema.target;
  const geometry::Shape *object = facts.ShapeOf(control), *on = facts.ShapeOf(target);
  const bool rests = std::any_of(step.constraints.begin(), step.constraints.end(),
                                 [](const BoundConstraint& c) { return c.kind->name == "rests_on"; });
  if (!rests || object == nullptr || on == nullptr || !on->is_compound()) return "";
  const Eigen::Vector3d up = -facts.DownFace(target);
  const std::vector<constraints::UpperFace> faces = constraints::UpperFaces(target, *on, up);
  if (faces.size() < 2) return "";
  const double lowest = up.dot(X_TC.p) - geometry::Support(*object, -(X_TC.R.transpose() * up));
  return constraints::FaceUnder(faces, lowest, X_TC * geometry::CentreOfMass(*object)).name;
}

}  // namespace

void ReportKeyPoses(const SceneFacts& facts, const std::vector<std::string>& actions,
                    const std::vector<BoundStep>& steps, const std::vector<math::Pose>& poses,
                    const std::vector<IkSolution>& ik_solutions, const CheckResult& check,
                    CandidateReport& report) {
  const Problem& problem = facts.problem();
  Plan plan;
  plan.scenario = problem.title;
  plan.robot = problem.robot.name;
  plan.held = problem.robot.holds;
  plan.actions = actions;
  for (size_t t = 0; t < steps.size(); ++t) {
    const BoundStep& step = steps[t];
    plan.steps.push_back({step.action, step.action_index, step.schema.control, step.schema.target, poses[t],
                          step.schema.execute});
    plan.steps.back().max_force = step.schema.max_force;
    plan.steps.back().face = FaceOf(facts, step, poses[t]);
    if (t < ik_solutions.size() && ik_solutions[t].found) plan.steps.back().q = ik_solutions[t].q;
  }
  plan.cost = check.cost;
  SetModes(&plan);
  report.plan = std::move(plan);
  report.max_violation_m = check.max_violation_m;
  report.max_violation_rad = check.max_violation_rad;
  report.reason = check.Worst();
  for (size_t t = ik_solutions.size(); t-- > 0;) {
    if (!ik_solutions[t].problem.empty()) report.reason = steps[t].action + ": " + ik_solutions[t].problem;
  }
}

std::vector<Eigen::VectorXd> JointsOf(const std::vector<IkSolution>& ik_solutions) {
  std::vector<Eigen::VectorXd> q;
  for (const IkSolution& ik_solution : ik_solutions) q.push_back(ik_solution.q);
  return q;
}

bool KeepsRows(const nlp::Result& result) {
  return result.max_violation_m <= 1e-4 && result.max_violation_rad <= 5e-4;
}

nlp::Result SolveKeyPoses(const SceneFacts& facts, const std::vector<BoundStep>& steps, const Limits& limits,
                          int max_iterations, const nlp::WarmStart* warm, KeyPoseProgram& key_poses) {
  const Problem& problem = facts.problem();
  const auto solver = nlp::MakeSolver(problem.program.backend);
  nlp::Options options = problem.program.solver;
  options.stop = problem.search.stop;
  nlp::WarmStart from;
  const int most = EffortOf(problem.program).again;
  int iterations = 0, evaluations = 0;
  double seconds = 0;
  for (int round = 0;; ++round) {
    options.max_iterations = std::min(max_iterations, most - iterations);
    options.time_limit_s = std::min(problem.program.solver.time_limit_s, limits.Remaining());
    nlp::Result result = solver->Solve(key_poses.program, key_poses.guess, options, warm);
    result.iterations = iterations += result.iterations;
    result.evaluations = evaluations += result.evaluations;
    result.solve_s = seconds += result.solve_s;
    const double near = round < kClearanceRounds ? kNear : std::numeric_limits<double>::infinity();
    const bool spent = iterations >= most || limits.Over();
    const bool solved =
        static_cast<int>(result.x.poses.size()) == key_poses.program.num_poses() && KeepsRows(result);
    // A program that fails with few rows fails with more.
    if (spent || !solved) {
      // The checker's margins are smaller than the rows': it may accept what violates some of them.
      if (result.x.poses.size() == steps.size() && NeedsIkSolutions(problem) &&
          CheckKeyPoses(facts, steps, result.x.poses).Feasible(problem.program))
        FindIkSolutions(facts, steps, result.x, key_poses);
      return result;
    }
    key_poses.guess.vectors = result.x.vectors;
    if (!AddMissingClearances(facts, steps, result.x.poses, near, key_poses)) {
      if (key_poses.joints.empty()) {
        // Before joints become variables: a hand that is turned may do.
        FindIkSolutions(facts, steps, result.x, key_poses);
        PreferTurnedGrasps(facts, steps, result.x.poses, key_poses);
        if (AllHaveIkSolutions(facts, key_poses)) return result;
      }
      if (!AddMissingIkSolutions(facts, steps, result.x, key_poses)) return result;
    }
    from = std::move(result.warm_start);
    warm = &from;
  }
}

CandidateReport Reoptimize(const SceneFacts& facts, const Limits& limits, Optimum& optimum) {
  const Problem& problem = facts.problem();
  const double begin = limits.Elapsed();
  KeyPoseProgram& key_poses = optimum.key_poses;
  key_poses.tree.MoveTo(problem.scene, problem.robot.X_WHand);
  const std::vector<math::Pose> before = key_poses.guess.poses;
  key_poses.guess.parameters = key_poses.tree.parameters();
  nlp::Result result = SolveKeyPoses(facts, optimum.steps, limits, EffortOf(problem.program).again,
                                     &optimum.warm_start, key_poses);
  CandidateReport report;
  report.evaluations = result.evaluations;
  report.trace = std::move(result.trace);
  if (result.x.poses.size() != optimum.steps.size()) {
    report.plan.actions = optimum.actions;
    report.reason = limits.Over() ? "the time limit was reached" : "the solver did not converge";
  } else {
    const CheckResult check =
        CheckKeyPoses(facts, optimum.steps, result.x.poses, JointsOf(key_poses.ik_solutions));
    ReportKeyPoses(facts, optimum.actions, optimum.steps, result.x.poses, key_poses.ik_solutions, check,
                   report);
    if (check.Feasible(problem.program) && AllHaveIkSolutions(facts, key_poses)) {
      report.status = CandidateStatus::kFeasible;
      report.reason.clear();
    }
  }
  if (report.feasible()) {
    key_poses.guess = std::move(result.x);
    optimum.warm_start = std::move(result.warm_start);
  } else {
    key_poses.guess.poses = before;
  }
  report.optimize_s = limits.Elapsed() - begin;
  return report;
}

}  // namespace tether::planning
