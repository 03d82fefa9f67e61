#pragma once

#include <string>
#include <vector>

#include "tether/planning/check/checker.h"
#include "tether/planning/plan/limits.h"
#include "tether/planning/plan/report.h"
#include "tether/planning/program/program_builder.h"

namespace tether::planning {

/// Optimised key poses, with what a warm start needs after objects have moved: the program, its discrete
/// choices, and the multipliers.
struct Optimum {
  std::vector<std::string> actions;
  std::vector<BoundStep> steps;
  KeyPoseProgram key_poses;  ///< Its guess is the optimum.
  nlp::WarmStart warm_start;
};

/// Writes the plan of these key poses, and the checker's judgement of it, to `report`.
void ReportKeyPoses(const SceneFacts& facts, const std::vector<std::string>& actions,
                    const std::vector<BoundStep>& steps, const std::vector<math::Pose>& poses,
                    const std::vector<IkSolution>& ik_solutions, const CheckResult& check,
                    CandidateReport& report);

/// Solves with rows for near pairs only, then again with rows for those that came too near, until none does.
/// `warm` may be null. The result counts the evaluations, iterations and seconds of all rounds; one round has
/// at most `max_iterations` iterations, all together Effort::again.
nlp::Result SolveKeyPoses(const SceneFacts& facts, const std::vector<BoundStep>& steps, const Limits& limits,
                          int max_iterations, const nlp::WarmStart* warm, KeyPoseProgram& key_poses);

/// The configurations, one per IK solution.
std::vector<Eigen::VectorXd> JointsOf(const std::vector<IkSolution>& ik_solutions);

/// Every row of the program holds at the result, to a tenth of the checker's tolerances.
bool KeepsRows(const nlp::Result& result);

/// Optimises again after objects have moved: the scene of `facts` has the same frames on the same parents as
/// that of `optimum`. Begins at the old key poses, which are relative to their target frames, and keeps the
/// discrete choices. If the checker accepts the result, it becomes the new optimum. If not (kGaveUp), other
/// choices may be needed: plan anew.
CandidateReport Reoptimize(const SceneFacts& facts, const Limits& limits, Optimum& optimum);

}  // namespace tether::planning
