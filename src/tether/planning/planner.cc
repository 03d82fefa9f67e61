#include <algorithm>
#include <cstddef>
#include <cstdio>
#include <future>
#include <limits>
#include <utility>

#include "tether/planning/action_reader.h"
#include "tether/planning/candidate.h"
#include "tether/planning/cost_bound.h"
#include "tether/planning/impossibility.h"
#include "tether/planning/relaxed.h"
#include "tether/planning/skeleton_source.h"

namespace tether::planning {
namespace {

// So many states are looked at after each proof, and when nothing was found.
constexpr size_t kFewStates = 2000;
constexpr size_t kManyStates = 100'000;

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
        facts_(problem),
        source_(task, problem.goal, problem.search) {}

  PlanReport Run() {
    while (!limits_.Over() && !impossible_ && !EnoughWithout(std::numeric_limits<double>::infinity())) {
      const double begin = limits_.Elapsed();
      const std::vector<std::vector<int>> batch = source_.NextBatch(limits_);
      report_.search_s += limits_.Elapsed() - begin;
      if (batch.empty() && !(costs_.empty() && source_.AllowReturns())) break;
      Optimize(batch);
    }
    Conclude();
    return std::move(report_);
  }

 private:
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
      return IsRelaxed(problem_, names) ? CheckRelaxed(facts_, names, index, limits_)
                                        : OptimizeCandidate(facts_, names, index, limits_);
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
      if (limits_.Over() || impossible_) return;
    }
  }

  void Prune(const Candidate& candidate) {
    CandidateReport pruned;
    pruned.status = CandidateStatus::kPruned;
    pruned.plan.actions = ActionNames(task_, candidate.actions);
    pruned.bound = candidate.bound;
    char text[64];
    std::snprintf(text, sizeof text, "it costs at least %.4f", candidate.bound);
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
      impossible_ = costs_.empty() && conflicts_.back().kind == task::Conflict::Kind::kProved &&
                    NoSequenceIsLeft(task_, problem_.goal, conflicts_, kFewStates, limits_);
    }
    if (on_candidate_) on_candidate_(report);
    report_.candidates.push_back(std::move(report));
  }

  /// Ground actions with a step that brings one of these objects somewhere.
  std::vector<int> ActionsThatMove(const std::vector<std::string>& objects) {
    if (moved_by_.empty()) {
      for (const auto& action : task_.actions()) {
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
  const SceneFacts facts_;
  SkeletonSource source_;
  int next_index_ = 0;
  std::vector<double> costs_;  // of the feasible ones
  std::vector<task::Conflict> conflicts_;
  bool impossible_ = false;  // What is proved rules out every sequence.
  std::vector<std::vector<std::string>>
      moved_by_;  // The frames that each ground action moves; filled when asked for.
  PlanReport report_;
};

void Planner::Conclude() {
  const task::SearchStatus ended = source_.ended();
  report_.expanded = static_cast<int>(source_.expanded());
  report_.generated = static_cast<int>(source_.generated());
  report_.total_s = limits_.Elapsed();
  report_.optimize_s = report_.total_s - report_.search_s;
  const bool all_seen = ended == task::SearchStatus::kExhausted;
  const bool enough = EnoughWithout(std::numeric_limits<double>::infinity());
  const bool best_is_first = problem_.search.cheapest_only && problem_.search.method != SearchMethod::kGreedy;
  // What a limit on the length cut short may be no sequence at all.
  impossible_ = impossible_ || (costs_.empty() && !all_seen && !limits_.Over() &&
                                NoSequenceIsLeft(task_, problem_.goal, conflicts_, kManyStates, limits_));
  report_.complete =
      impossible_ || (!limits_.Over() &&
                      (all_seen || ended == task::SearchStatus::kDepthLimit || (enough && best_is_first)));
  const bool all_proved =
      std::all_of(report_.candidates.begin(), report_.candidates.end(),
                  [](const CandidateReport& c) { return c.status == CandidateStatus::kInfeasible; });
  if (!costs_.empty()) {
    report_.status = PlanStatus::kSolved;
    if (!report_.complete && enough && !limits_.Over())
      report_.message = "of the shortest candidates these are the best; longer ones were not compared";
    else if (!report_.complete)
      report_.message = task::Describe(limits_.Over() ? task::SearchStatus::kTimeLimit : ended);
  } else if (limits_.Stopped()) {
    report_.status = PlanStatus::kInterrupted;
  } else if (impossible_ || (all_seen && all_proved)) {
    report_.status = PlanStatus::kImpossible;
    if (source_.search().product().IsUnsatisfiable()) {
      report_.message = task::kUnsatisfiable;
    } else if (report_.candidates.empty()) {
      report_.message = "no sequence of actions reaches the goal";
    } else {
      // The proof that closed the last way, or with all of them the first.
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
    } else if (limits_.Over()) {
      report_.message = "the time limit was reached";
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
  return Planner(problem, task, on_candidate).Run();
}

}  // namespace tether::planning
