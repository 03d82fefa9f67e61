#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdio>
#include <deque>
#include <future>
#include <memory>
#include <optional>
#include <set>

#include "tether/common/log.h"
#include "tether/planning/checker.h"
#include "tether/planning/program_builder.h"
#include "tether/planning/variants.h"
#include "tether/task/skeleton.h"

namespace tether::planning {
namespace {

using Clock = std::chrono::steady_clock;

// While turning the hand is more than this share of the cost, other grasps are tried, up to so many.
constexpr double kMuchTurning = 0.3;
constexpr int kFurtherVariants = 4;

double Seconds(Clock::time_point from) { return std::chrono::duration<double>(Clock::now() - from).count(); }

/// The time and stop limits that all parts of one planning run share.
class Limits {
 public:
  explicit Limits(const SearchOptions& options) : options_(options), begin_(Clock::now()) {}

  bool Stopped() const { return options_.stop != nullptr && options_.stop->load(); }
  double Remaining() const {
    return options_.time_limit_s > 0 ? options_.time_limit_s - Seconds(begin_) : 1e9;
  }
  bool Over() const { return Stopped() || Remaining() <= 0; }
  double Elapsed() const { return Seconds(begin_); }

 private:
  const SearchOptions& options_;
  Clock::time_point begin_;
};

std::vector<std::string> ActionNames(const symbolic::Task& task, const task::Skeleton& skeleton) {
  std::vector<std::string> names;
  for (int action : skeleton.actions) names.push_back(task.actions()[static_cast<size_t>(action)].name);
  return names;
}

Plan MakePlan(const Problem& problem, const std::vector<std::string>& actions,
              const std::vector<BoundStep>& steps, const nlp::Point& x) {
  Plan plan;
  plan.scenario = problem.title;
  plan.robot = problem.robot.name;
  plan.actions = actions;
  for (size_t t = 0; t < steps.size(); ++t) {
    const BoundStep& step = steps[t];
    plan.steps.push_back({step.action, step.action_index, step.schema.control, step.schema.target, x.poses[t],
                          step.schema.execute});
  }
  return plan;
}

/// What became of a candidate, and, if it is proved impossible, how many of its actions that takes.
struct Verdict {
  CandidateReport report;
  size_t refuted_prefix = 0;  ///< 0: not proved for a beginning.
};

/// Optimises one candidate: its variants in the order of their scores, each from a few starts, until the
/// checker accepts one; the cheapest result counts. While that turns the hand much, a few more variants are
/// tried.
Verdict OptimizeCandidate(const SceneFacts& facts, const std::vector<std::string>& actions, int index,
                          const Limits& limits) {
  const Problem& problem = facts.problem();
  const ProgramOptions& options = problem.program;
  const auto begin = Clock::now();
  const std::vector<BoundStep> steps = BindSkeleton(problem, actions);
  const Random random = Random(problem.search.seed).Split("candidate " + std::to_string(index));
  const auto solver = nlp::MakeSolver(options.backend);

  Verdict verdict;
  CandidateReport& report = verdict.report;
  report.plan.actions = actions;
  report.plan.scenario = problem.title;
  report.plan.robot = problem.robot.name;
  std::optional<double> least_violation;
  std::vector<std::string> refutations;
  bool all_refuted = true;
  int tried = 0;    // ways tried
  int further = 0;  // of those, after a feasible one
  double turn_share = 0;
  VariantQueue variants(options.max_variants);
  while (const auto variant = variants.Next()) {
    // The less likely a way is, the fewer starts it gets.
    const int starts = least_violation == 0.0 ? 1 : std::max(1, options.starts - tried++ / 2);
    for (int start = 0; start < starts; ++start) {
      if (limits.Over()) break;
      // What fails with room to spare may do without: the last start asks for less.
      const bool tight = start > 0 && start == starts - 1 && least_violation != 0.0;
      const KeyPoseProgram key_poses = BuildProgram(
          facts, steps, *variant,
          {start == 0 || tight ? 0 : 0.5, tight, random.Split("start " + std::to_string(start))});
      if (start == 0) variants.Expand(*variant, key_poses.choices);
      if (!key_poses.refutations.empty()) {
        refutations.insert(refutations.end(), key_poses.refutations.begin(), key_poses.refutations.end());
        if (key_poses.refuted_action >= 0) {
          report.status = CandidateStatus::kInfeasible;
          report.reason = key_poses.refutations.front();
          report.optimize_s = Seconds(begin);
          verdict.refuted_prefix = static_cast<size_t>(key_poses.refuted_action + 1);
          return verdict;
        }
        break;
      }
      all_refuted = false;
      nlp::Options solver_options = options.solver;
      solver_options.stop = problem.search.stop;
      solver_options.time_limit_s = std::min(solver_options.time_limit_s, limits.Remaining());
      const nlp::Result result = solver->Solve(key_poses.program, key_poses.guess, solver_options);
      LogDebug("candidate " + std::to_string(index) + " start " + std::to_string(start) + ": " +
               result.Summary());
      report.evaluations += result.evaluations;
      if (static_cast<int>(result.x.poses.size()) != key_poses.program.num_poses()) continue;
      Plan plan = MakePlan(problem, actions, steps, result.x);
      const CheckResult check = CheckPlan(facts, plan);
      plan.cost = check.cost;
      const bool feasible = check.Feasible(options);
      // Two starts that end at the same cost are taken at their word.
      if (feasible && least_violation == 0.0 &&
          std::abs(plan.cost - report.plan.cost) < 1e-4 * (1 + plan.cost))
        break;
      // What is within the tolerance counts as none: then the cost decides.
      const double violation = feasible ? 0 : check.max_violation_m + check.max_violation_rad;
      if (!least_violation || violation < *least_violation ||
          (violation == *least_violation && plan.cost < report.plan.cost)) {
        least_violation = violation;
        turn_share = check.cost > 0 ? check.turn_cost / check.cost : 0;
        report.plan = std::move(plan);
        report.max_violation_m = check.max_violation_m;
        report.max_violation_rad = check.max_violation_rad;
        report.reason = check.Worst();
        report.trace = result.trace;
      }
    }
    // Another grasp is worth a try while turning the hand is most of the cost.
    if (least_violation == 0.0 && (turn_share < kMuchTurning || further++ >= kFurtherVariants)) break;
    if (limits.Over()) break;
  }
  if (least_violation == 0.0) {
    report.status = CandidateStatus::kFeasible;
    report.reason.clear();
    report.optimize_s = Seconds(begin);
    return verdict;
  }
  report.status = all_refuted && !refutations.empty() && variants.exhausted() ? CandidateStatus::kInfeasible
                                                                              : CandidateStatus::kGaveUp;
  if (all_refuted && !refutations.empty()) report.reason = refutations.front();
  if (report.reason.empty()) {
    report.reason = limits.Stopped() ? "interrupted"
                                     : (limits.Over() ? "the time limit was reached" : "no start converged");
  }
  report.optimize_s = Seconds(begin);
  return verdict;
}

task::SearchOutcome NextSkeleton(task::SkeletonSearch& search, const Limits& limits) {
  // In short turns, so that an interruption is noticed.
  for (;;) {
    task::SearchLimits turn;
    turn.deadline = Clock::now() + std::chrono::milliseconds(100);
    task::SearchOutcome outcome = search.Next(turn);
    if (outcome.status != task::SearchStatus::kTimeLimit) return outcome;
    if (limits.Stopped()) return {task::SearchStatus::kInterrupted, {}};
    if (limits.Over()) return outcome;
  }
}

/// The skeletons of a task in order, each once. After a refutation the search begins anew with all that is
/// refuted and skips what was dealt with, so that what comes next does not depend on how far it had looked
/// ahead.
class SkeletonSource {
 public:
  SkeletonSource(const symbolic::Task& task, int max_actions) : task_(task), max_actions_(max_actions) {
    Restart();
  }

  task::SearchOutcome Next(const Limits& limits) {
    for (;;) {
      task::SearchOutcome outcome = NextSkeleton(*search_, limits);
      if (!outcome.found() || !dealt_with_.contains(outcome.skeleton->actions)) return outcome;
    }
  }
  void DealtWith(const std::vector<int>& actions) { dealt_with_.insert(actions); }
  void Refute(std::vector<int> prefix, const std::string& reason) {
    task::Conflict conflict;
    conflict.kind = task::Conflict::Kind::kProved;
    conflict.prefix = std::move(prefix);
    conflict.reason = reason;
    conflicts_.push_back(std::move(conflict));
    Restart();
  }
  int expanded() const { return static_cast<int>(search_->expanded()); }
  int generated() const { return static_cast<int>(search_->generated()); }

 private:
  void Restart() {
    // The search holds the task by shared pointer, but does not outlive this one.
    search_ = std::make_unique<task::SkeletonSearch>(
        std::shared_ptr<const symbolic::Task>(&task_, [](const symbolic::Task*) {}),
        task::SkeletonOptions{max_actions_});
    for (const task::Conflict& conflict : conflicts_) search_->AddConflict(conflict);
  }

  const symbolic::Task& task_;
  int max_actions_;
  std::unique_ptr<task::SkeletonSearch> search_;
  std::vector<task::Conflict> conflicts_;
  std::set<std::vector<int>> dealt_with_;
};

}  // namespace

PlanReport PlanTask(const Problem& problem, const symbolic::Task& task,
                    const CandidateCallback& on_candidate) {
  const Limits limits(problem.search);
  const SceneFacts facts(problem);
  PlanReport report;
  SkeletonSource source(task, problem.search.max_actions);
  struct Running {
    std::vector<int> actions;
    std::future<Verdict> verdict;
  };
  std::deque<Running> running;
  bool searching = true;
  task::SearchStatus ended = task::SearchStatus::kFound;
  int feasible = 0;
  const auto enough = [&] { return problem.search.max_plans > 0 && feasible >= problem.search.max_plans; };
  const size_t window = static_cast<size_t>(std::max(1, problem.search.threads));

  while (!enough()) {
    while (searching && running.size() < window && !limits.Over()) {
      const auto begin = Clock::now();
      const task::SearchOutcome outcome = source.Next(limits);
      report.search_s += Seconds(begin);
      if (!outcome.found()) {
        ended = outcome.status;
        searching = false;
        break;
      }
      const std::vector<std::string> actions = ActionNames(task, *outcome.skeleton);
      const int index = static_cast<int>(report.candidates.size() + running.size());
      running.push_back(
          {outcome.skeleton->actions, std::async(window > 1 ? std::launch::async : std::launch::deferred,
                                                 [&facts, &limits, actions, index] {
                                                   return OptimizeCandidate(facts, actions, index, limits);
                                                 })});
    }
    if (running.empty()) break;
    const std::vector<int> actions = std::move(running.front().actions);
    Verdict verdict = running.front().verdict.get();
    running.pop_front();
    source.DealtWith(actions);
    if (verdict.refuted_prefix > 0) {
      // Others that were begun meanwhile may be refuted too: with one thread they would not have been begun.
      for (Running& other : running) other.verdict.wait();
      running.clear();
      source.Refute({actions.begin(), actions.begin() + static_cast<std::ptrdiff_t>(verdict.refuted_prefix)},
                    verdict.report.reason);
      searching = true;
    }
    CandidateReport candidate = std::move(verdict.report);
    feasible += candidate.feasible() ? 1 : 0;
    if (on_candidate) on_candidate(candidate);
    report.candidates.push_back(std::move(candidate));
    if (limits.Over()) searching = false;
  }
  // Candidates that were begun beyond the last one wanted are waited for and dropped: any number of threads
  // gives the same report.
  for (Running& rest : running) rest.verdict.wait();

  report.expanded = source.expanded();
  report.generated = source.generated();
  report.total_s = limits.Elapsed();
  report.optimize_s = report.total_s - report.search_s;
  const bool all_seen = ended == task::SearchStatus::kExhausted;
  report.complete = !limits.Over() && !enough() && (all_seen || ended == task::SearchStatus::kDepthLimit);
  const bool all_proved =
      std::all_of(report.candidates.begin(), report.candidates.end(),
                  [](const CandidateReport& c) { return c.status == CandidateStatus::kInfeasible; });
  if (feasible > 0) {
    report.status = PlanStatus::kSolved;
  } else if (limits.Stopped()) {
    report.status = PlanStatus::kInterrupted;
  } else if (all_seen && all_proved) {
    report.status = PlanStatus::kImpossible;
    report.message = report.candidates.empty() ? "no sequence of actions reaches the goal"
                                               : "every sequence of actions is geometrically impossible: " +
                                                     report.candidates.front().reason;
  } else {
    report.status = PlanStatus::kGaveUp;
    if (ended == task::SearchStatus::kDepthLimit && report.candidates.empty()) {
      report.message = "no sequence of up to " + std::to_string(problem.search.max_actions) +
                       " actions reaches the goal; longer ones may (max_actions)";
    } else if (limits.Over()) {
      report.message = "the time limit was reached";
    } else if (!report.candidates.empty()) {
      report.message = "no candidate has feasible key poses: " + report.candidates.front().reason;
    } else {
      report.message = std::string(task::Describe(ended));
    }
  }
  if (limits.Stopped()) report.status = PlanStatus::kInterrupted;
  return report;
}

}  // namespace tether::planning
