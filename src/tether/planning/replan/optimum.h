#pragma once

#include <string>
#include <vector>

#include "tether/planning/check/checker.h"
#include "tether/planning/plan/limits.h"
#include "tether/planning/plan/report.h"
#include "tether/planning/program/program_builder.h"

namespace tether::planning {

/// Key poses that were optimised, with all that it takes to optimise them again when things have moved: the
/// program, the discrete choices that are in it, and the multipliers.
struct Optimum {
  std::vector<std::string> actions;
  std::vector<BoundStep> steps;
  KeyPoseProgram key_poses;  ///< Its guess is the optimum.
  nlp::WarmStart warm_start;
};

/// Writes the plan that these key poses are, and what the checker says of it, to `report`.
void ReportKeyPoses(const SceneFacts& facts, const std::vector<std::string>& actions,
                    const std::vector<BoundStep>& steps, const std::vector<math::Pose>& poses,
                    const std::vector<IkSolution>& ik_solutions, const CheckResult& check,
                    CandidateReport& report);

/// Solves with rows for near pairs only, and with more where others come too near, until none does. `warm`
/// may be null. The result counts the evaluations, iterations and seconds of all rounds, each of which takes
/// at most `max_iterations`; all of them together take at most Effort::again.
nlp::Result SolveKeyPoses(const SceneFacts& facts, const std::vector<BoundStep>& steps, const Limits& limits,
                          int max_iterations, const nlp::WarmStart* warm, KeyPoseProgram& key_poses);

/// The configurations, one per witness.
std::vector<Eigen::VectorXd> JointsOf(const std::vector<IkSolution>& ik_solutions);

/// The result keeps every row of its program, up to a tenth of what the checker lets pass.
bool KeepsRows(const nlp::Result& result);

/// Optimises again where things are now: the scene of `facts` has the same frames on the same parents as the
/// one that `optimum` is of. Begins at the old poses, which hold relative to the objects that they are tied
/// to, and keeps the discrete choices. The checker judges the result; if it accepts it, it is the new
/// optimum. If not (kGaveUp), the old choices may be what is wrong: plan anew.
CandidateReport Reoptimize(const SceneFacts& facts, const Limits& limits, Optimum& optimum);

}  // namespace tether::planning
