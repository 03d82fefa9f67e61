#include <algorithm>
#include <cmath>
#include <cstddef>
#include <future>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include "tether/common/text.h"
#include "tether/planning/check/region_check.h"
#include "tether/planning/modes/cost_bound.h"
#include "tether/planning/plan/candidate.h"
#include "tether/planning/plan/impossibility.h"
#include "tether/planning/skeleton/action_reader.h"
#include "tether/planning/skeleton/bound_actions.h"
#include "tether/planning/skeleton/skeleton_source.h"
#include "tether/planning/skeleton/subsequences.h"
#include "tether/planning/transit/plan_motion.h"

namespace tether::planning {
namespace {

// The most states that are examined after each proof, and when nothing was found.
constexpr size_t kFewStates = 2000;
constexpr size_t kManyStates = 100'000;

// Once the wanted plans are found, the most sequences in a row that may be skipped before planning ends.
constexpr int kMostSkipped = 1000;
// A plan that is cheaper by no more than this share does not count as better.
constexpr double kBetter = 1e-6;
// The most orders of independent actions that are compared, and the share of the first one's lower cost bound
// below which another counts as shorter.
constexpr int kMostOrders = 300;
constexpr double kMuchShorter = 0.98;

/// The outer loop: sequences come from the task search in its order. Each waits for those of its subsequences
/// that reach the goal by themselves: if one of them is feasible, the other actions are needless, and the
/// sequence is skipped. So are other orders of feasible sequences. The rest are candidates; they are
/// optimised one after another, each with what was learned of those before it. Results of other threads that
/// started ahead are used only when their turn comes, so that the number of threads changes nothing but the
/// time.
class Planner {
 public:
  Planner(const Problem& problem, const symbolic::Task& task, const CandidateCallback& on_candidate)
      : problem_(problem),
        task_(task),
        on_candidate_(on_candidate),
        limits_(problem.search),
        scope_(limits_),
        facts_(problem),
        bound_(problem, facts_.shared_frames(), task),
        source_(task, problem.goal, problem.search),
        subsequences_(source_.MakeProduct()) {}

  PlanReport Run() {
    try {
      do {
        Search();
      } while (RejectsBest());
    } catch (const LimitReached& reached) {
      reached_ = reached.limit();
    }
    Conclude();
    return std::move(report_);
  }

 private:
  void Search() {
    while (!HasEnded()) {
      const double begin = limits_.Elapsed();
      std::vector<std::vector<ActionId>> batch = source_.NextBatch(limits_);
      report_.search_s += limits_.Elapsed() - begin;
      if (batch.empty() && !(costs_.empty() && source_.AllowReturns())) break;
      TryAll(std::move(batch));
    }
  }

  /// Plans the arm's motions of the best plan. If it has none, the plan is rejected, with what blocks it as a
  /// conflict, and the search goes on.
  bool RejectsBest() {
    const std::vector<int> order = report_.BestFirst();
    if (!problem_.motion || order.empty()) return false;
    CandidateReport& best = report_.candidates[order.front()];
    if (!best.feasible()) return false;
    const double begin = limits_.Elapsed();
    const MotionOutcome outcome = PlanMotions(problem_, limits_, &best.plan);
    report_.motion_s += limits_.Elapsed() - begin;
    without_motion_ = outcome.reached;
    if (outcome.found || outcome.reached) return false;
    const PlanStep& step = best.plan.steps[outcome.step];
    best.status = CandidateStatus::kGaveUp;
    const std::vector<ActionId> actions = sequences_[order.front()];
    Verdict verdict;
    verdict.report.reason = best.reason = step.action + ": " + outcome.reason;
    verdict.failing_actions = static_cast<size_t>(step.action_index) + 1;
    for (const std::string& name : outcome.blockers) verdict.unmoved.push_back(facts_.frames().Find(name));
    fates_[actions] = Fate::kFailed;
    const auto cost = std::find(costs_.begin(), costs_.end(), best.plan.cost);
    if (cost != costs_.end()) costs_.erase(cost);
    for (auto& orders : feasible_orders_) orders.second.erase(subsequences_.NormalOrder(actions));
    AddConflict(actions, verdict);
    if (on_candidate_) on_candidate_(best);
    ended_ = false;
    skipped_ = 0;
    return !limits_.Over();
  }

  /// A sequence that waits for its turn.
  struct Candidate {
    std::vector<ActionId> actions;
    int index = 0;                      // in the order of finding
    std::future<Verdict> verdict = {};  // if it was begun ahead; its destructor waits
  };
  enum class Fate {
    kFeasible,
    kFailed,   // refuted or given up
    kSkipped,  // not tried: a subsequence is feasible, or another order is feasible or cheaper
  };

  bool HasEnded() const {
    return ended_ || impossible_ || limits_.Over() || FirstIsEnough() || TriedInVain();
  }
  bool TriedInVain() const {
    const int most = problem_.search.max_candidates;
    return most > 0 && costs_.empty() && static_cast<int>(report_.candidates.size()) >= most;
  }
  bool AllWanted() const { return problem_.search.max_plans == 0; }
  size_t Wanted() const { return ToIndex(problem_.search.max_plans.value_or(1)); }
  /// The wanted plans are found.
  bool Enough() const { return !AllWanted() && costs_.size() >= Wanted(); }
  /// As many plans as are wanted cost no more than `bound`.
  bool EnoughWithout(double bound) const { return Enough() && costs_[Wanted() - 1] <= bound; }
  /// Plans come best first, or any one serves.
  bool FirstIsEnough() const {
    const bool any = problem_.search.method == SearchMethod::kGreedy && !problem_.search.max_plans;
    return (problem_.search.cheapest_only || any) && Enough();
  }
  /// The number of candidates that are tried even if none improves on the best.
  double LastToTry() const {
    return std::max<double>(problem_.search.min_candidates,
                            problem_.search.patience * static_cast<double>(last_improvement_));
  }

  bool Refuted(const std::vector<ActionId>& actions) const {
    return std::any_of(conflicts_.begin(), conflicts_.end(),
                       [&](const task::Conflict& conflict) { return conflict.RulesOut(actions); });
  }

  Verdict Optimize(const std::vector<ActionId>& actions, int index) const {
    const LimitsScope scope(limits_);
    try {
      const std::shared_ptr<const Skeleton> skeleton = bound_.Bind(actions);
      Verdict verdict = HasRegionStep(skeleton->steps) ? CheckRegionSteps(facts_, *skeleton, index, limits_)
                                                       : OptimizeCandidate(facts_, *skeleton, index, limits_);
      verdict.report.plan.skeleton = skeleton;
      return verdict;
    } catch (const LimitReached& reached) {
      Verdict verdict;
      verdict.report.plan.actions = ActionNames(task_, actions);
      verdict.report.reason = reached.what();
      return verdict;
    }
  }

  void TryAll(std::vector<std::vector<ActionId>> batch) {
    std::vector<Candidate> candidates;
    for (std::vector<ActionId>& actions : batch) candidates.push_back({std::move(actions), next_index_++});
    const size_t window = ToIndex(problem_.search.threads);
    size_t ahead = 0;
    for (size_t i = 0; i < candidates.size() && !HasEnded(); ++i) {
      for (; window > 1 && ahead < candidates.size() && ahead < i + window; ++ahead) {
        Candidate& next = candidates[ahead];
        if (!IsReady(next.actions)) continue;
        next.verdict =
            std::async(std::launch::async, [this, &next] { return Optimize(next.actions, next.index); });
      }
      Try(candidates[i]);
    }
  }

  /// By what is known so far, it is a candidate.
  bool IsReady(const std::vector<ActionId>& actions) {
    if (Refuted(actions) || fates_.contains(actions)) return false;
    for (const Subsequence& part : subsequences_.Find(actions)) {
      if (!Counts(part)) continue;
      const auto fate = fates_.find(part.actions);
      if (fate == fates_.end() || fate->second != Fate::kFailed) return false;
    }
    return !IsOtherOrder(actions);
  }

  /// A subsequence that may be a plan: not ruled out, nor left out by the search.
  bool Counts(const Subsequence& part) const {
    return !Refuted(part.actions) && (!part.revisits || source_.BringsReturn(part.actions));
  }

  /// Some subsequence of it may be a plan. Subsequences that were not tried yet are tried first.
  bool HasSubsequencePlan(const Candidate& candidate) {
    for (Subsequence& part : subsequences_.Find(candidate.actions)) {
      if (!Counts(part)) continue;
      if (!fates_.contains(part.actions)) {
        source_.Exclude(part.actions);
        Candidate first{part.actions, candidate.index};
        Try(first);
        if (HasEnded()) return true;
      }
      const auto fate = fates_.find(part.actions);
      if (fate != fates_.end() && fate->second != Fate::kFailed) return true;
    }
    return false;
  }

  /// A feasible plan has the same actions in another order, equivalent by the symbols.
  bool IsOtherOrder(const std::vector<ActionId>& actions) {
    if (AllWanted() || feasible_orders_.empty()) return false;
    std::vector<ActionId> sorted = actions;
    std::sort(sorted.begin(), sorted.end());
    const auto same_actions = feasible_orders_.find(sorted);
    return same_actions != feasible_orders_.end() &&
           same_actions->second.contains(subsequences_.NormalOrder(actions));
  }

  void Try(Candidate& candidate, bool in_any_order = false) {
    const std::vector<ActionId>& actions = candidate.actions;
    if (Refuted(actions) || fates_.contains(actions)) return;
    const bool needless = HasSubsequencePlan(candidate);
    if (HasEnded()) return;
    if (needless || (!in_any_order && IsOtherOrder(actions))) {
      Skip(actions, needless);
      return;
    }
    if (Enough() && static_cast<double>(report_.candidates.size()) >= LastToTry()) {
      ended_ = true;
      return;
    }
    skipped_ = 0;
    double bound = 0;
    if (problem_.search.max_plans.value_or(0) > 0 && !problem_.search.cheapest_only) bound = BoundOf(actions);
    // It can't be among the best.
    if (EnoughWithout(bound)) {
      fates_[actions] = Fate::kSkipped;
      Prune(actions, bound);
      return;
    }
    Verdict verdict =
        candidate.verdict.valid() ? candidate.verdict.get() : Optimize(actions, candidate.index);
    Record(actions, bound, std::move(verdict));
    // The order is tried nevertheless where it seems to be shorter.
    if (in_any_order || AllWanted() || problem_.search.cheapest_only || FirstIsEnough() ||
        fates_.at(actions) != Fate::kFeasible)
      return;
    Candidate shorter{ShorterOrder(actions), candidate.index};
    if (shorter.actions.empty() || fates_.contains(shorter.actions)) return;
    source_.Exclude(shorter.actions);
    Try(shorter, true);
  }

  double BoundOf(const std::vector<ActionId>& actions) const {
    return LowerCostBound(facts_, bound_.Bind(actions)->steps);
  }

  /// An order of the same actions whose lower cost bound is much less, found step by step; empty if there is
  /// none.
  std::vector<ActionId> ShorterOrder(const std::vector<ActionId>& actions) {
    std::vector<ActionId> best = actions;
    std::vector<std::vector<ActionId>> others = subsequences_.Exchanged(best);
    if (others.empty()) return {};
    const double first = BoundOf(actions);
    double least = first;
    size_t without_gain = 0;
    for (int at = 0; at < kMostOrders && without_gain < others.size() && !limits_.Over(); ++at) {
      std::vector<ActionId>& other = others[ToIndex(at) % others.size()];
      const double bound = BoundOf(other);
      ++without_gain;
      if (bound >= least * (1 - kBetter)) continue;
      least = bound;
      best = std::move(other);
      others = subsequences_.Exchanged(best);
      without_gain = 0;
    }
    return least < kMuchShorter * first ? best : std::vector<ActionId>();
  }

  void Skip(const std::vector<ActionId>& actions, bool needless) {
    fates_[actions] = Fate::kSkipped;
    ++(needless ? report_.needless : report_.other_orders);
    if (Enough() && ++skipped_ >= kMostSkipped) ended_ = true;
  }

  /// Keeps the costs in order.
  void AddPlan(const std::vector<ActionId>& actions, double cost) {
    if (!Enough() || cost < costs_[Wanted() - 1] - kBetter * std::abs(cost))
      last_improvement_ = report_.candidates.size() + 1;
    costs_.insert(std::upper_bound(costs_.begin(), costs_.end(), cost), cost);
    if (AllWanted()) return;
    std::vector<ActionId> sorted = actions;
    std::sort(sorted.begin(), sorted.end());
    feasible_orders_[sorted].insert(subsequences_.NormalOrder(actions));
  }

  void Prune(const std::vector<ActionId>& actions, double bound) {
    CandidateReport pruned;
    pruned.status = CandidateStatus::kPruned;
    pruned.plan.actions = ActionNames(task_, actions);
    pruned.bound = bound;
    pruned.reason = "it costs at least " + Fixed(bound, 4);
    if (on_candidate_) on_candidate_(pruned);
    sequences_.push_back(actions);
    report_.candidates.push_back(std::move(pruned));
  }

  void Record(const std::vector<ActionId>& actions, double bound, Verdict verdict) {
    CandidateReport& report = verdict.report;
    report.bound = bound;
    // Where the cost of key poses does not count, a plan's cost is that of its actions.
    if (problem_.search.cheapest_only) report.bound = report.plan.cost = CostOf(actions);
    fates_[actions] = report.feasible() ? Fate::kFeasible : Fate::kFailed;
    if (report.feasible()) AddPlan(actions, report.plan.cost);
    if (verdict.failing_actions > 0) AddConflict(actions, verdict);
    if (on_candidate_) on_candidate_(report);
    sequences_.push_back(actions);
    report_.candidates.push_back(std::move(report));
  }

  void AddConflict(const std::vector<ActionId>& actions, const Verdict& verdict) {
    task::Conflict conflict;
    conflict.kind = verdict.report.status == CandidateStatus::kInfeasible ? task::Conflict::Kind::kProved
                                                                          : task::Conflict::Kind::kGaveUp;
    const auto end = actions.begin() + static_cast<std::ptrdiff_t>(verdict.failing_actions);
    conflict.prefix = {actions.begin(), end};
    conflict.anywhere = verdict.failing_anywhere;
    if (!verdict.unmoved.empty()) {
      conflict.unless = ActionsThatMove(verdict.unmoved);
      conflict.anywhere = verdict.failing_anywhere ||
                          (conflict.unless.empty() && conflict.kind == task::Conflict::Kind::kProved);
    }
    conflict.constraints = verdict.report.blocking;
    conflict.reason = verdict.report.reason;
    source_.AddConflict(conflict);
    conflicts_.push_back(std::move(conflict));
    impossible_ = costs_.empty() && conflicts_.back().kind == task::Conflict::Kind::kProved &&
                  NoSequenceIsLeft(task_, problem_.goal, conflicts_, kFewStates, limits_);
  }

  /// Ground actions with a step that brings one of these objects somewhere.
  std::vector<ActionId> ActionsThatMove(const std::vector<FrameId>& objects) {
    if (moved_by_.empty()) {
      for (const ActionId action : task_.actions().ids()) {
        PollLimits();
        std::vector<FrameId>& moved = moved_by_.emplace_back();
        const ActionCall call = ParseActionCall(task_.actions()[action].name);
        for (const ActionSchema& schema : problem_.actions) {
          if (schema.name != call.name) continue;
          for (const StepSchema& step : BindAction(schema, call.arguments))
            moved.push_back(facts_.frames().Find(step.control));
        }
      }
    }
    std::vector<ActionId> all;
    for (const ActionId action : moved_by_.ids()) {
      PollLimits();
      const std::vector<FrameId>& moved = moved_by_[action];
      if (std::find_first_of(moved.begin(), moved.end(), objects.begin(), objects.end()) != moved.end())
        all.push_back(action);
    }
    return all;
  }

  double CostOf(const std::vector<ActionId>& actions) const {
    int64_t cost = 0;
    for (const ActionId action : actions) cost += task_.actions()[action].cost;
    return static_cast<double>(cost) * task_.cost_unit();
  }

  std::string WhyIncomplete() const;
  void Conclude();

  const Problem& problem_;
  const symbolic::Task& task_;
  const CandidateCallback& on_candidate_;
  const Limits limits_;
  const LimitsScope scope_;
  std::optional<Limit> reached_;         // The limit that ended the search …
  std::optional<Limit> without_motion_;  // … and the one before the motions of the best plan were found.
  const SceneFacts facts_;
  const BoundActions bound_;
  SkeletonSource source_;
  Subsequences subsequences_;
  int next_index_ = 0;
  std::map<std::vector<ActionId>, Fate>
      fates_;  // of all sequences that were tried or skipped, and not ruled out
  std::vector<std::vector<ActionId>> sequences_;  // of the candidates in the report
  std::vector<double> costs_;                     // of the feasible ones, ascending
  std::map<std::vector<ActionId>, std::set<std::vector<ActionId>>>
      feasible_orders_;          // normal ones, by sorted actions
  size_t last_improvement_ = 0;  // number of the candidate that was the last to improve on what was there
  int skipped_ = 0;              // since the last candidate
  bool ended_ = false;           // Planning ended while other candidates may be left.
  std::vector<task::Conflict> conflicts_;
  bool impossible_ = false;                                 // The proofs rule out every sequence.
  IndexedVector<ActionId, std::vector<FrameId>> moved_by_;  // The frames that it moves; filled on demand.
  PlanReport report_;
};

/// After planning that found plans: what was left out, and which option includes it.
std::string Planner::WhyIncomplete() const {
  const std::string all = "max_plans: 0 (--max-plans 0) tries them all";
  if (const auto limit = limits_.Reached()) return std::string(task::Describe(task::StatusOf(*limit)));
  if (FirstIsEnough()) return "a greedy search takes the first plan; others may cost less: " + all;
  if (ended_ && skipped_ >= kMostSkipped)
    return "the last " + std::to_string(kMostSkipped) +
           " sequences of actions do no more than a plan that was found, or the same in another order, and "
           "planning ended there; " +
           all;
  if (ended_)
    return "planning ended because the last candidates, from number " +
           std::to_string(last_improvement_ + 1) +
           " on, were no better; min_candidates and patience have it go on, and " + all;
  if (report_.other_orders > 0)
    return std::to_string(report_.other_orders) +
           " other orders of actions that don't depend on each other were not tried; " + all;
  return std::string(task::Describe(source_.ended()));
}

void Planner::Conclude() {
  const auto limit = reached_ ? reached_ : limits_.Reached();
  const task::SearchStatus ended = limit ? task::StatusOf(*limit) : source_.ended();
  report_.expanded = static_cast<int>(source_.expanded());
  report_.generated = static_cast<int>(source_.generated());
  report_.total_s = limits_.Elapsed();
  report_.optimize_s = report_.total_s - report_.search_s - report_.motion_s;
  const bool all_seen = ended == task::SearchStatus::kExhausted;
  // A limit on the length may have left no sequence at all.
  impossible_ = impossible_ || (costs_.empty() && !all_seen && !limit &&
                                NoSequenceIsLeft(task_, problem_.goal, conflicts_, kManyStates, limits_));
  const bool greedy = problem_.search.method == SearchMethod::kGreedy;
  const bool best_is_first = problem_.search.cheapest_only && !greedy && Enough();
  report_.complete = impossible_ || best_is_first ||
                     (!limit && !ended_ && report_.other_orders == 0 && !FirstIsEnough() &&
                      (all_seen || ended == task::SearchStatus::kDepthLimit));
  const bool all_proved =
      std::all_of(report_.candidates.begin(), report_.candidates.end(),
                  [](const CandidateReport& c) { return c.status == CandidateStatus::kInfeasible; });
  if (!costs_.empty()) {
    report_.status = PlanStatus::kSolved;
    if (!report_.complete) report_.message = WhyIncomplete();
  } else if (limits_.Stopped()) {
    report_.status = PlanStatus::kInterrupted;
  } else if (impossible_ || (all_seen && all_proved)) {
    report_.status = PlanStatus::kImpossible;
    if (source_.search().product().IsUnsatisfiable()) {
      report_.message = task::kUnsatisfiable;
    } else if (report_.candidates.empty()) {
      report_.message = "no sequence of actions reaches the goal";
    } else {
      // The reason of the proof that excluded the last sequences, or else the first one.
      const auto lasting = std::find_if(conflicts_.rbegin(), conflicts_.rend(), [](const task::Conflict& c) {
        return c.kind == task::Conflict::Kind::kProved && (c.anywhere || !c.unless.empty());
      });
      const bool last = impossible_ && lasting != conflicts_.rend();
      report_.message = "every sequence of actions is geometrically impossible: " +
                        (last ? lasting->reason : report_.candidates.front().reason);
    }
  } else {
    report_.status = PlanStatus::kGaveUp;
    if (ended == task::SearchStatus::kDepthLimit && report_.candidates.empty()) {
      report_.message = "no sequence of up to " + std::to_string(problem_.search.max_actions) +
                        " actions reaches the goal; longer ones may (max_actions)";
    } else if (limit || ended == task::SearchStatus::kMemoryLimit) {
      report_.message = task::Describe(ended);
    } else if (!report_.candidates.empty()) {
      report_.message = "no candidate has feasible key poses: " + report_.candidates.front().reason;
    } else {
      report_.message = std::string(task::Describe(ended));
    }
  }
  if (without_motion_) {
    report_.status = PlanStatus::kGaveUp;
    report_.message = std::string(Describe(*without_motion_)) + " before the arm's motion was found";
  }
  if (limits_.Stopped()) report_.status = PlanStatus::kInterrupted;
}

}  // namespace

PlanReport PlanTask(const Problem& problem, const symbolic::Task& task,
                    const CandidateCallback& on_candidate) {
  try {
    return Planner(problem, task, on_candidate).Run();
  } catch (const LimitReached& reached) {  // before the search began
    PlanReport report;
    report.status = reached.limit() == Limit::kInterrupted ? PlanStatus::kInterrupted : PlanStatus::kGaveUp;
    report.message = reached.what();
    return report;
  }
}

}  // namespace tether::planning
