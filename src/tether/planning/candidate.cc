#include "tether/planning/candidate.h"

#include <algorithm>
#include <limits>
#include <memory>
#include <optional>
#include <set>
#include <utility>

#include "tether/common/log.h"
#include "tether/planning/variants.h"

namespace tether::planning {
namespace {

// A way is tried at once if at its guess turning the hand is no more than this share of the cost, and nothing is
// further out of reach than this, m. Else some more are built and compared.
constexpr double kMuchTurning = 0.3;
constexpr double kFarOutOfReach = 0.02;
constexpr size_t kCompared = 8;
// What being out of reach at the guess counts against a way, per m.
constexpr double kReachWeight = 10;
// A way whose guess promises less than the best one's by this factor is not worth trying.
constexpr double kWorthTrying = 1.02;
// So many of the best ways get further starts if none is accepted from its own guess.
constexpr size_t kRestarted = 4;
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
    bool more = true;
    while (more && !feasible() && !Over()) more = TryNextWays();
    // Where no way is feasible from its own guess: from other starts, and at last with less clearance.
    std::stable_sort(failed_.begin(), failed_.end(),
                     [](const Way& a, const Way& b) { return a.promise < b.promise; });
    failed_.resize(std::min(failed_.size(), kRestarted));
    for (int start = 1; start < problem_.program.starts; ++start) {
      for (size_t i = 0; i < failed_.size() && !feasible() && !Over(); ++i) Restart(failed_[i], start);
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
  /// A way to make the discrete choices.
  struct Way {
    Variant variant;
    double promise;  // what its guess costs, and how far it is out of reach
    std::optional<KeyPoseProgram> key_poses;
  };

  bool feasible() const { return least_violation_ == 0.0; }
  bool Over() const { return refuted_actions_ > 0 || limits_.Over(); }

  /// Builds the next ways, until one promises well or there are enough to compare, and tries them, the most
  /// promising first. False if there are no more.
  bool TryNextWays() {
    std::vector<Way> ways;
    bool promising = false;
    while (!promising && ways.size() < kCompared && !Over()) {
      const auto variant = variants_.Next();
      if (!variant) break;
      KeyPoseProgram key_poses = BuildProgram(facts_, steps_, *variant, {.near = kNear});
      variants_.Expand(*variant, key_poses.choices);
      if (!key_poses.refutations.empty()) {
        NoteRefutation(key_poses);
        continue;
      }
      all_refuted_ = false;
      const auto [promise, well] = Promise(key_poses);
      promising = well;
      ways.push_back({*variant, promise, std::move(key_poses)});
    }
    std::stable_sort(ways.begin(), ways.end(),
                     [](const Way& a, const Way& b) { return a.promise < b.promise; });
    double accepted = std::numeric_limits<double>::infinity();
    for (Way& way : ways) {
      if (Over() || way.promise > kWorthTrying * accepted) break;
      if (SolveAndJudge(*way.key_poses, 0)) {
        accepted = std::min(accepted, way.promise);
      } else {
        failed_.push_back({way.variant, way.promise, {}});
      }
    }
    return !ways.empty();
  }

  /// What the guess costs, with a charge for being out of reach; and whether that is good enough not to look
  /// for other ways.
  std::pair<double, bool> Promise(const KeyPoseProgram& key_poses) const {
    double travel = 0, turn = 0, out_of_reach = 0;
    Eigen::VectorXd r;
    const auto evaluate = [&](const nlp::Residual& residual) {
      r.resize(residual.size());
      residual.Evaluate(key_poses.guess, r, nullptr);
    };
    for (const nlp::Term& term : key_poses.program.terms()) {
      if (term.role != nlp::Role::kCost) continue;
      evaluate(*term.residual);
      (term.residual->unit() == nlp::Unit::kRadian ? turn : travel) += r.squaredNorm();
    }
    for (const int term : key_poses.reach_terms) {
      evaluate(*key_poses.program.terms()[static_cast<size_t>(term)].residual);
      out_of_reach = std::max(out_of_reach, r.maxCoeff());
    }
    return {travel + turn + kReachWeight * out_of_reach,
            turn <= kMuchTurning * (travel + turn) && out_of_reach <= kFarOutOfReach};
  }

  void NoteRefutation(const KeyPoseProgram& key_poses) {
    refutations_.insert(refutations_.end(), key_poses.refutations.begin(), key_poses.refutations.end());
    if (key_poses.refuted_action < 0) return;
    refuted_actions_ = static_cast<size_t>(key_poses.refuted_action) + 1;
    report_.reason = key_poses.refutations.front();
  }

  /// Tries a way again, from a displaced guess. What fails with room to spare may do without: the last start
  /// asks for less.
  void Restart(const Way& way, int start) {
    ProgramStart how;
    how.tight = start == problem_.program.starts - 1;
    how.noise = how.tight ? 0 : 0.5;
    how.random = random_.Split("start " + std::to_string(start));
    how.near = kNear;
    KeyPoseProgram key_poses = BuildProgram(facts_, steps_, way.variant, how);
    if (key_poses.refutations.empty()) SolveAndJudge(key_poses, start);
  }

  bool SolveAndJudge(KeyPoseProgram& key_poses, int start) {
    const nlp::Result result = SolveKeyPoses(facts_, steps_, limits_, nullptr, key_poses);
    LogDebug("candidate " + std::to_string(index_) + " start " + std::to_string(start) + ": " +
             result.Summary());
    report_.evaluations += result.evaluations;
    return static_cast<int>(result.x.poses.size()) == key_poses.program.num_poses() &&
           Judge(key_poses, result);
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
  std::vector<std::string> refutations_;
  std::set<int> blocking_steps_;
  std::vector<Way> failed_;  // without their programs
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
