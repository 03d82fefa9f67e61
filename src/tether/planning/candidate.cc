#include "tether/planning/candidate.h"

#include <algorithm>
#include <memory>
#include <optional>
#include <set>
#include <utility>

#include "tether/common/log.h"
#include "tether/planning/variants.h"

namespace tether::planning {
namespace {

// While turning the hand is more than this share of the cost, other grasps are tried, up to so many.
constexpr double kMuchTurning = 0.3;
constexpr int kFurtherVariants = 4;
// Constraints named as blocking each other, at most.
constexpr size_t kMostBlocking = 6;

/// The optimisation of a sequence of actions that begins at the start.
class CandidateRun {
 public:
  CandidateRun(const SceneFacts& facts, std::vector<std::string> actions, std::vector<BoundStep> steps,
               int index, const Limits& limits)
      : facts_(facts),
        problem_(facts.problem()),
        actions_(std::move(actions)),
        steps_(std::move(steps)),
        index_(index),
        limits_(limits),
        random_(Random(problem_.search.seed).Split("candidate " + std::to_string(index))),
        variants_(problem_.program.max_variants) {
    report_.plan.actions = actions_;
    report_.plan.scenario = problem_.title;
    report_.plan.robot = problem_.robot.name;
  }

  CandidateReport Run() {
    int tried = 0;    // ways tried
    int further = 0;  // of those, after a feasible one
    while (const auto variant = variants_.Next()) {
      // The less likely a way is, the fewer starts it gets.
      const int starts = feasible() ? 1 : std::max(1, problem_.program.starts - tried++ / 2);
      TryVariant(*variant, starts);
      if (refuted_actions_ > 0 || limits_.Over()) break;
      // Another grasp is worth a try while turning the hand is most of the cost.
      if (feasible() && (turn_share_ < kMuchTurning || further++ >= kFurtherVariants)) break;
    }
    Conclude();
    return std::move(report_);
  }

  /// After Run(): so many first actions are proved impossible; 0: none.
  size_t refuted_actions() const { return refuted_actions_; }
  /// After Run(): the best that was accepted; null: nothing.
  std::shared_ptr<Optimum> optimum() const { return optimum_; }
  /// After Run(), where nothing was accepted: the steps whose constraints block each other.
  const std::set<int>& blocking_steps() const { return blocking_steps_; }

 private:
  bool feasible() const { return least_violation_ == 0.0; }

  void TryVariant(const Variant& variant, int starts) {
    for (int start = 0; start < starts && !limits_.Over(); ++start) {
      ProgramStart how;
      // What fails with room to spare may do without: the last start asks for less.
      how.tight = start > 0 && start == starts - 1;
      how.noise = start == 0 || how.tight ? 0 : 0.5;
      how.random = random_.Split("start " + std::to_string(start));
      how.near = kNear;
      KeyPoseProgram key_poses = BuildProgram(facts_, steps_, variant, how);
      if (start == 0) variants_.Expand(variant, key_poses.choices);
      if (!key_poses.refutations.empty()) {
        refutations_.insert(refutations_.end(), key_poses.refutations.begin(), key_poses.refutations.end());
        if (key_poses.refuted_action >= 0) {
          refuted_actions_ = static_cast<size_t>(key_poses.refuted_action) + 1;
          report_.reason = key_poses.refutations.front();
        }
        return;
      }
      all_refuted_ = false;
      const nlp::Result result = SolveKeyPoses(facts_, steps_, limits_, nullptr, key_poses);
      LogDebug("candidate " + std::to_string(index_) + " start " + std::to_string(start) + ": " +
               result.Summary());
      report_.evaluations += result.evaluations;
      if (static_cast<int>(result.x.poses.size()) == key_poses.program.num_poses() &&
          Judge(key_poses, result))
        return;
    }
  }

  /// Takes the result over if it is the best so far; true if the checker accepts it.
  bool Judge(KeyPoseProgram& key_poses, const nlp::Result& result) {
    const CheckResult check = CheckKeyPoses(facts_, steps_, result.x.poses);
    // What is within the tolerance counts as none: then the cost decides.
    const bool accepted = check.Feasible(problem_.program);
    const double violation = accepted ? 0 : check.max_violation_m + check.max_violation_rad;
    if (!least_violation_ || violation < *least_violation_ ||
        (violation == *least_violation_ && check.cost < report_.plan.cost)) {
      least_violation_ = violation;
      turn_share_ = check.cost > 0 ? check.turn_cost / check.cost : 0;
      report_.plan = MakePlan(problem_, actions_, steps_, result.x.poses);
      report_.plan.cost = check.cost;
      report_.max_violation_m = check.max_violation_m;
      report_.max_violation_rad = check.max_violation_rad;
      report_.reason = check.Worst();
      report_.trace = result.trace;
      report_.blocking.clear();
      blocking_steps_.clear();
      if (accepted) {
        key_poses.guess = result.x;
        optimum_ = std::make_shared<Optimum>(
            Optimum{actions_, steps_, std::move(key_poses), result.warm_start});
      } else {
        NameBlocking(key_poses.program, result, check);
      }
    }
    return accepted;
  }

  /// What can't hold together: by the solver, and by the checker.
  void NameBlocking(const nlp::Program& program, const nlp::Result& result, const CheckResult& check) {
    const auto name = [&](int step, const std::string& text) {
      blocking_steps_.insert(step);
      std::vector<std::string>& all = report_.blocking;
      if (all.size() < kMostBlocking && std::find(all.begin(), all.end(), text) == all.end())
        all.push_back(text);
    };
    for (const int term : result.blocking_terms) {
      const nlp::Residual& residual = *program.terms()[static_cast<size_t>(term)].residual;
      name(residual.step(), residual.name());
    }
    for (const CheckFinding& finding : check.findings) {
      const ProgramOptions& options = problem_.program;
      if (finding.amount > (finding.unit == nlp::Unit::kRadian ? options.feasible_rad : options.feasible_m))
        name(finding.step, finding.action + ": " + finding.label);
    }
  }

  void Conclude() {
    if (feasible()) {
      report_.status = CandidateStatus::kFeasible;
      report_.reason.clear();
      return;
    }
    const bool refuted =
        refuted_actions_ > 0 || (all_refuted_ && !refutations_.empty() && variants_.exhausted());
    report_.status = refuted ? CandidateStatus::kInfeasible : CandidateStatus::kGaveUp;
    if (refuted_actions_ == 0 && all_refuted_ && !refutations_.empty()) report_.reason = refutations_.front();
    if (limits_.Stopped()) report_.reason = "interrupted";
    if (report_.reason.empty())
      report_.reason = limits_.Over() ? "the time limit was reached" : "no start converged";
  }

  const SceneFacts& facts_;
  const Problem& problem_;
  std::vector<std::string> actions_;
  std::vector<BoundStep> steps_;
  int index_;
  const Limits& limits_;
  Random random_;
  VariantQueue variants_;

  CandidateReport report_;
  std::optional<double> least_violation_;  // 0: feasible
  double turn_share_ = 0;
  std::vector<std::string> refutations_;
  std::set<int> blocking_steps_;
  std::shared_ptr<Optimum> optimum_;
  bool all_refuted_ = true;
  size_t refuted_actions_ = 0;
};

/// How many first actions of a candidate that was given up fail already: those up to one that takes part in
/// what blocks it, if they fail by themselves too; else all.
size_t FindFailingActions(const SceneFacts& facts, const std::vector<std::string>& actions,
                          const std::vector<BoundStep>& steps, const CandidateRun& run, int index,
                          const Limits& limits) {
  std::set<size_t> ends;
  for (const int step : run.blocking_steps())
    ends.insert(static_cast<size_t>(steps[static_cast<size_t>(step)].action_index) + 1);
  for (const size_t end : ends) {
    if (end == actions.size() || limits.Over()) break;
    std::vector<BoundStep> first_steps;
    for (const BoundStep& step : steps) {
      if (step.action_index < static_cast<int>(end)) first_steps.push_back(step);
    }
    CandidateRun first(facts, {actions.begin(), actions.begin() + static_cast<std::ptrdiff_t>(end)},
                       std::move(first_steps), index, limits);
    if (!first.Run().feasible() && !limits.Over()) return end;
  }
  return limits.Over() ? 0 : actions.size();
}

}  // namespace

Verdict OptimizeCandidate(const SceneFacts& facts, const std::vector<std::string>& actions, int index,
                          const Limits& limits) {
  const double begin = limits.Elapsed();
  const std::vector<BoundStep> steps = BindSkeleton(facts.problem(), actions);
  CandidateRun run(facts, actions, steps, index, limits);
  Verdict verdict;
  verdict.report = run.Run();
  verdict.optimum = run.optimum();
  verdict.failing_actions = run.refuted_actions();
  if (verdict.report.status == CandidateStatus::kGaveUp && !limits.Over())
    verdict.failing_actions = FindFailingActions(facts, actions, steps, run, index, limits);
  verdict.report.optimize_s = limits.Elapsed() - begin;
  return verdict;
}

}  // namespace tether::planning
