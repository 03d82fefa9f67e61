#include <algorithm>
#include <cstddef>
#include <future>
#include <limits>
#include <optional>
#include <utility>

#include "tether/common/text.h"
#include "tether/planning/action_reader.h"
#include "tether/planning/candidate.h"
#include "tether/planning/cost_bound.h"
#include "tether/planning/relaxed.h"
#include "tether/planning/skeleton_source.h"

namespace tether::planning {
namespace {

std::vector<std::string> ActionNames(const symbolic::Task& task, const std::vector<int>& actions) {
  std::vector<std::string> names;
  for (int action : actions) names.push_back(task.actions()[static_cast<size_t>(action)].name);
  return names;
}

/// The outer loop: candidates come from the task search in batches, are optimised in the order of what they
/// cost at least, several at once, and are dealt with in that order, so that the number of threads changes
/// nothing but the time.
class Planner {
 public:
  Planner(const Problem& problem, const symbolic::Task& task, const CandidateCallback& on_candidate)
      : problem_(problem),
        task_(task),
        on_candidate_(on_candidate),
        limits_(problem.search),
        scope_(limits_),
        facts_(problem),
        source_(task, problem.goal, problem.search) {}

  PlanReport Run() {
    try {
      Search();
    } catch (const LimitReached& reached) {
      reached_ = reached.limit();
    }
    Conclude();
    return std::move(report_);
  }

 private:
  void Search() {
    while (!limits_.Over() && !EnoughWithout(std::numeric_limits<double>::infinity())) {
      const double begin = limits_.Elapsed();
      const std::vector<std::vector<int>> batch = source_.NextBatch(limits_);
      report_.search_s += limits_.Elapsed() - begin;
      if (batch.empty() && !(costs_.empty() && source_.AllowReturns())) break;
      Optimize(batch);
    }
  }

  struct Candidate {
    std::vector<int> actions;
    int index;     // in the order of finding
    double bound;  // on its cost
  };
  /// As many plans as are wanted cost no more than `bound`; infinity: there are as many.
  bool EnoughWithout(double bound) const {
    const int wanted = problem_.search.max_plans;
    if (wanted == 0) return false;
    return std::count_if(costs_.begin(), costs_.end(), [&](double cost) { return cost <= bound; }) >= wanted;
  }

  bool Refuted(const Candidate& candidate) const {
    return std::any_of(conflicts_.begin(), conflicts_.end(),
                       [&](const task::Conflict& conflict) { return conflict.RulesOut(candidate.actions); });
  }

  std::future<Verdict> Begin(const Candidate& candidate) const {
    const auto policy = problem_.search.threads > 1 ? std::launch::async : std::launch::deferred;
    return std::async(policy, [this, names = ActionNames(task_, candidate.actions), index = candidate.index] {
      const LimitsScope scope(limits_);
      try {
        return IsRelaxed(problem_, names) ? CheckRelaxed(facts_, names, index, limits_)
                                          : OptimizeCandidate(facts_, names, index, limits_);
      } catch (const LimitReached& reached) {
        Verdict verdict;
        verdict.report.plan.actions = names;
        verdict.report.reason = reached.what();
        return verdict;
      }
    });
  }

  void Optimize(const std::vector<std::vector<int>>& batch) {
    std::vector<Candidate> candidates;
    for (const std::vector<int>& actions : batch) {
      const bool bounded = problem_.search.max_plans > 0 && !problem_.search.cheapest_only;
      candidates.push_back(
          {actions, next_index_++,
           bounded ? LowerCostBound(facts_, BindSkeleton(problem_, ActionNames(task_, actions))) : 0});
    }
    std::stable_sort(candidates.begin(), candidates.end(),
                     [](const Candidate& a, const Candidate& b) { return a.bound < b.bound; });
    std::vector<std::future<Verdict>> verdicts(candidates.size());  // Their destructors wait.
    const size_t window = static_cast<size_t>(std::max(1, problem_.search.threads));
    size_t begun = 0;
    for (size_t i = 0; i < candidates.size(); ++i) {
      if (Refuted(candidates[i])) continue;
      // What is left can't be among the best.
      if (EnoughWithout(candidates[i].bound)) {
        for (; i < candidates.size(); ++i) Prune(candidates[i]);
        return;
      }
      for (; begun < candidates.size() && begun < i + window; ++begun) {
        if (!Refuted(candidates[begun])) verdicts[begun] = Begin(candidates[begun]);
      }
      DealWith(candidates[i], verdicts[i].get());
      if (limits_.Over()) return;
    }
  }

  void Prune(const Candidate& candidate) {
    CandidateReport pruned;
    pruned.status = CandidateStatus::kPruned;
    pruned.plan.actions = ActionNames(task_, candidate.actions);
    pruned.bound = candidate.bound;
    char text[64];
    FormatInto(text, sizeof text, "it costs at least %.4f", candidate.bound);
    pruned.reason = text;
    if (on_candidate_) on_candidate_(pruned);
    report_.candidates.push_back(std::move(pruned));
  }

  void DealWith(const Candidate& candidate, Verdict verdict) {
    CandidateReport& report = verdict.report;
    report.bound = candidate.bound;
    // Where no poses are to be compared, plans cost what their actions do.
    if (problem_.search.cheapest_only) report.bound = report.plan.cost = CostOf(candidate.actions);
    if (report.feasible()) costs_.push_back(report.plan.cost);
    if (verdict.failing_actions > 0) {
      task::Conflict conflict;
      conflict.kind = report.status == CandidateStatus::kInfeasible ? task::Conflict::Kind::kProved
                                                                    : task::Conflict::Kind::kGaveUp;
      const auto end = candidate.actions.begin() + static_cast<std::ptrdiff_t>(verdict.failing_actions);
      conflict.prefix = {candidate.actions.begin(), end};
      conflict.anywhere = verdict.failing_anywhere;
      if (!verdict.unmoved.empty()) {
        conflict.unless = ActionsThatMove(verdict.unmoved);
        conflict.anywhere = conflict.unless.empty();
      }
      conflict.constraints = report.blocking;
      conflict.reason = report.reason;
      source_.AddConflict(conflict);
      conflicts_.push_back(std::move(conflict));
    }
    if (on_candidate_) on_candidate_(report);
    report_.candidates.push_back(std::move(report));
  }

  /// Ground actions with a step that brings one of these objects somewhere.
  std::vector<int> ActionsThatMove(const std::vector<std::string>& objects) {
    if (moved_by_.empty()) {
      for (const auto& action : task_.actions()) {
        PollLimits();
        std::vector<std::string>& moved = moved_by_.emplace_back();
        const ActionCall call = ParseActionCall(action.name);
        for (const ActionSchema& schema : problem_.actions) {
          if (schema.name != call.name) continue;
          for (const StepSchema& step : BindAction(schema, call.arguments)) moved.push_back(step.control);
        }
      }
    }
    std::vector<int> all;
    for (size_t action = 0; action < moved_by_.size(); ++action) {
      PollLimits();
      const std::vector<std::string>& moved = moved_by_[action];
      if (std::find_first_of(moved.begin(), moved.end(), objects.begin(), objects.end()) != moved.end())
        all.push_back(static_cast<int>(action));
    }
    return all;
  }

  double CostOf(const std::vector<int>& actions) const {
    int64_t cost = 0;
    for (int action : actions) cost += task_.actions()[static_cast<size_t>(action)].cost;
    return static_cast<double>(cost) * task_.cost_unit();
  }

  void Conclude();

  const Problem& problem_;
  const symbolic::Task& task_;
  const CandidateCallback& on_candidate_;
  const Limits limits_;
  const LimitsScope scope_;
  std::optional<Limit> reached_;  // What ended the search from within.
  const SceneFacts facts_;
  SkeletonSource source_;
  int next_index_ = 0;
  std::vector<double> costs_;  // of the feasible ones
  std::vector<task::Conflict> conflicts_;
  std::vector<std::vector<std::string>>
      moved_by_;  // The frames that each ground action moves; filled when asked for.
  PlanReport report_;
};

void Planner::Conclude() {
  const auto limit = reached_ ? reached_ : limits_.Reached();
  const task::SearchStatus ended = limit ? task::StatusOf(*limit) : source_.ended();
  report_.expanded = static_cast<int>(source_.expanded());
  report_.generated = static_cast<int>(source_.generated());
  report_.total_s = limits_.Elapsed();
  report_.optimize_s = report_.total_s - report_.search_s;
  const bool all_seen = ended == task::SearchStatus::kExhausted;
  const bool enough = EnoughWithout(std::numeric_limits<double>::infinity());
  const bool best_is_first = problem_.search.cheapest_only && problem_.search.method != SearchMethod::kGreedy;
  report_.complete =
      !limit && (all_seen || ended == task::SearchStatus::kDepthLimit || (enough && best_is_first));
  const bool all_proved =
      std::all_of(report_.candidates.begin(), report_.candidates.end(),
                  [](const CandidateReport& c) { return c.status == CandidateStatus::kInfeasible; });
  if (!costs_.empty()) {
    report_.status = PlanStatus::kSolved;
    if (!report_.complete && enough && !limit)
      report_.message = "of the shortest candidates these are the best; longer ones were not compared";
    else if (!report_.complete)
      report_.message = task::Describe(ended);
  } else if (limits_.Stopped()) {
    report_.status = PlanStatus::kInterrupted;
  } else if (all_seen && all_proved) {
    report_.status = PlanStatus::kImpossible;
    if (source_.search().product().IsUnsatisfiable()) {
      report_.message = task::kUnsatisfiable;
    } else if (report_.candidates.empty()) {
      report_.message = "no sequence of actions reaches the goal";
    } else {
      report_.message =
          "every sequence of actions is geometrically impossible: " + report_.candidates.front().reason;
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
  if (limits_.Stopped()) report_.status = PlanStatus::kInterrupted;
}

}  // namespace

PlanReport PlanTask(const Problem& problem, const symbolic::Task& task,
                    const CandidateCallback& on_candidate) {
  try {
    return Planner(problem, task, on_candidate).Run();
  } catch (const LimitReached& reached) {  // before the search began
    PlanReport report;
    const bool interrupted = reached.limit() == Limit::kInterrupted;
    report.status = interrupted ? PlanStatus::kInterrupted : PlanStatus::kGaveUp;
    report.message = reached.what();
    return report;
  }
}

}  // namespace tether::planning
