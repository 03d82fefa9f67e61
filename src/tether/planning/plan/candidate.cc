#include "tether/planning/plan/candidate.h"

#include <algorithm>
#include <limits>
#include <memory>
#include <optional>
#include <set>
#include <utility>

#include "tether/common/log.h"
#include "tether/planning/ik/ik_rows.h"
#include "tether/planning/modes/hand_bounds.h"
#include "tether/planning/modes/mode_assignment.h"
#include "tether/planning/modes/packing.h"
#include "tether/planning/program/effort.h"

namespace tether::planning {
namespace {

// The most mode assignments that are compared where the first one is unlikely to be the best.
constexpr size_t kLookedAt = 48;
// A mode assignment is not tried if this share of its guess's cost exceeds that of the best plan found: the
// optimiser rarely saves more than half of a guess's cost, by spreading a turn over two steps.
constexpr double kWorthTrying = 0.5;
// Of a row's violation, m or rad.
constexpr double kLeastSuspicious = constraints::kFeasibleLength;
// The number of best mode assignments that get further starts if none is accepted from its own guess.
constexpr size_t kRestarted = 2;
constexpr size_t kMostAlternatives = 2;
// The arrangements that are tried of objects that share a support.
constexpr int kArrangements = 16;
// The number of feasible arrangements that are compared; mode assignments that are tried before them.
constexpr int kMostArranged = 3;
constexpr int kBeforeArranging = 4;
// Where no arrangement is feasible either, the most mode assignments tried: another order of actions is
// likelier to succeed.
constexpr int kAfterArranging = 8;
// Violations that differ by so much, m or rad, are the same.
constexpr double kSameViolation = 1e-6;
// Results that the checker rejects rank behind all others.
constexpr double kRejected = 1e3;
// The most constraints that are named as conflicting.
constexpr size_t kMostBlocking = 6;

std::vector<BoundStep> FirstSteps(const std::vector<BoundStep>& steps, size_t actions) {
  std::vector<BoundStep> first;
  for (const BoundStep& step : steps) {
    if (step.action_index < static_cast<int>(actions)) first.push_back(step);
  }
  return first;
}

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
        effort_(EffortOf(problem_.program)),
        starts_(problem_.program.starts + effort_.more_starts),
        random_(Random(problem_.search.seed).Split("candidate 0")) {
    report_.plan.actions = actions_;
    report_.plan.scenario = problem_.title;
    report_.plan.robot = problem_.robot.name;
  }

  CandidateReport Run() {
    const auto refutation =
        NeedsIkSolutions(problem_) ? RefuteByReach(facts_, steps_) : std::optional<ReachRefutation>();
    if (refutation) {
      refutations_ = {refutation->reason};
      report_.reason = refutation->reason;
      refuted_actions_ = ToIndex(refutation->action_index) + 1;
      proved_ = true;
      unmoved_ = refutation->unmoved;
      Conclude();
      return std::move(report_);
    }
    try {
      Search();
    } catch (const LimitReached&) {  // What was found before counts.
    }
    Conclude();
    return std::move(report_);
  }

  /// After Run(): this many first actions are proved impossible, or not modelled; 0: none.
  size_t refuted_actions() const { return refuted_actions_; }
  /// After Run(): the last of these is so whatever comes before it.
  bool refuted_anywhere() const { return refuted_anywhere_; }
  /// After Run(): the last of these is impossible as long as nothing moves one of these objects.
  const std::vector<FrameId>& unmoved() const { return unmoved_; }
  /// After Run(): the best that was accepted; null: nothing.
  std::shared_ptr<Optimum> optimum() const { return optimum_; }
  /// After Run(), where nothing was accepted: the steps whose constraints conflict.
  const std::set<int>& blocking_steps() const { return blocking_steps_; }
  /// After Run(), where nothing was accepted: movable objects that there is no room beside.
  const std::vector<FrameId>& obstructions() const { return obstructions_; }

 private:
  void Search() {
    KeyPoseProgram key_poses = BuildProgram(facts_, steps_, {}, {.near = kNear});
    const ModeAssignment first = DescribeModeAssignment(facts_, {}, key_poses);
    if (first.likely_best && Try(first, key_poses)) {
      TryAlternatives(first);
    } else {
      TryModeAssignments(first.likely_best);
    }
    // Where none is feasible from its own guess: from other starts, and at last with less clearance.
    std::stable_sort(failed_.begin(), failed_.end(),
                     [](const Failure& a, const Failure& b) { return a.violation < b.violation; });
    failed_.resize(std::min(failed_.size(), kRestarted));
    for (int start = 1; start < starts_; ++start) {
      for (size_t i = 0; i < failed_.size() && !feasible() && !limits_.Over(); ++i)
        Restart(failed_[i].modes, start);
    }
  }

  /// There is a result that the checker accepts and that keeps every row.
  bool feasible() const { return least_violation_ == 0.0; }

  /// Key poses of the first `actions` actions with these modes; empty: none were found. Kept for other
  /// candidates with the same prefix; depends on nothing but the problem.
  std::vector<math::Pose> SolvePrefix(const ModeAssignment& modes, size_t actions) const {
    const Variant variant = FirstChoices(modes, actions);
    const auto end = actions_.begin() + static_cast<std::ptrdiff_t>(actions);
    return *facts_.beginnings().Get({{actions_.begin(), end}, variant}, [&] {
      const std::vector<BoundStep> steps = FirstSteps(steps_, actions);
      KeyPoseProgram key_poses = BuildProgram(facts_, steps, variant, {.near = kNear});
      nlp::Result result;
      if (key_poses.refutations.empty())
        result = SolveKeyPoses(facts_, steps, limits_, effort_.beginning, nullptr, key_poses);
      if (result.x.poses.size() != steps.size() ||
          (!KeepsRows(result) && !CheckKeyPoses(facts_, steps, result.x.poses).Feasible(problem_.program)))
        result.x.poses.clear();
      return std::move(result.x.poses);
    });
  }

  /// The mode assignment fails at a prefix at which an earlier one failed.
  bool BeginsBadly(const ModeAssignment& modes) const {
    return std::any_of(suspects_.begin(), suspects_.end(),
                       [&](size_t actions) { return SolvePrefix(modes, actions).empty(); });
  }

  /// Where a prefix failed that is feasible by itself: again, started at its key poses.
  bool TryFromPrefix(const ModeAssignment& modes) {
    if (last_suspect_ == 0) return false;
    ProgramStart start;
    start.near = kNear;
    start.beginning = SolvePrefix(modes, last_suspect_);
    if (start.beginning.empty()) return false;
    KeyPoseProgram key_poses = BuildProgram(facts_, steps_, modes.variant, start);
    return key_poses.refutations.empty() && SolveAndJudge(key_poses, 0, effort_.first);
  }

  bool Try(const ModeAssignment& modes, KeyPoseProgram& key_poses) {
    // Rows may refute what the guess did not.
    if (!key_poses.refutations.empty()) {
      NoteRefutation(DescribeModeAssignment(facts_, modes.variant, key_poses));
      return false;
    }
    all_refuted_ = false;
    const bool had_one = optimum_ != nullptr;
    if (SolveAndJudge(key_poses, 0, effort_.first) || TryFromPrefix(modes)) return true;
    // Feasible but for the planner's own margins: again with smaller ones.
    if (!had_one && optimum_ != nullptr && Restart(modes, starts_ - 1)) return true;
    failed_.push_back({last_violation_, modes});
    return false;
  }

  /// Others have about the predicted cost of the first, which is feasible: the best of them may be cheaper.
  void TryAlternatives(const ModeAssignment& first) {
    const std::vector<ModeAssignment> alternatives = FindAlternatives(facts_, steps_, first, limits_);
    for (size_t i = 0; i < std::min(alternatives.size(), kMostAlternatives) && !limits_.Over(); ++i) {
      KeyPoseProgram key_poses = BuildProgram(facts_, steps_, alternatives[i].variant, {.near = kNear});
      if (key_poses.refutations.empty()) SolveAndJudge(key_poses, 0, effort_.first);
    }
  }

  /// Where several objects are put on one support: starts from places that were found for all of them
  /// together; the best of a few that are feasible. False if no support gets enough objects.
  bool TryArrangements(const Variant& variant) {
    if (!Packing::IsNeeded(facts_, steps_)) return false;
    const KeyPoseProgram guess = BuildProgram(facts_, steps_, variant, {.guess_only = true});
    if (!guess.refutations.empty()) return true;
    const Packing packing(facts_, steps_, guess);
    // With less clearance the places found for each by itself may serve.
    if (!failed_.empty() && Restart(failed_.front().modes, starts_ - 1)) return true;
    int feasible_ones = 0;
    for (int attempt = 0; attempt < kArrangements && feasible_ones < kMostArranged && !limits_.Over();
         ++attempt) {
      auto arrangement = packing.Arrange(attempt, random_.Split("arrangement " + std::to_string(attempt)));
      if (!arrangement) continue;
      ProgramStart start;
      start.near = kNear;
      start.tight = arrangement->tight;
      start.placed = std::move(arrangement->placed);
      KeyPoseProgram key_poses = BuildProgram(facts_, steps_, variant, start);
      if (!key_poses.refutations.empty()) continue;
      all_refuted_ = false;
      if (SolveAndJudge(key_poses, attempt, effort_.restart)) ++feasible_ones;
    }
    return true;
  }

  /// Tries mode assignments by predicted cost, except the first one if that was `tried`.
  void TryModeAssignments(bool tried) {
    const ModeAssignments assignments = FindModeAssignments(facts_, steps_, kLookedAt, limits_);
    for (const ModeAssignment& modes : assignments.refuted) {
      NoteRefutation(modes);
      if (refuted_actions_ > 0) return;
    }
    int count = 0, most = problem_.program.max_variants;
    for (const ModeAssignment& modes : assignments.open) {
      if (feasible() && kWorthTrying * modes.predicted_cost > report_.plan.cost) break;
      if (tried && modes.variant.empty()) continue;
      if (BeginsBadly(modes)) continue;
      if (limits_.Over() || ++count > most) break;
      KeyPoseProgram key_poses = BuildProgram(facts_, steps_, modes.variant, {.near = kNear});
      Try(modes, key_poses);
      if (!feasible() && count == kBeforeArranging && TryArrangements(assignments.open.front().variant))
        most = std::min(most, kAfterArranging);
    }
    if (!feasible() && count > 0 && count < kBeforeArranging)
      TryArrangements(assignments.open.front().variant);
  }

  void NoteRefutation(const ModeAssignment& modes) {
    refutations_.insert(refutations_.end(), modes.refutations.begin(), modes.refutations.end());
    constant_proof_ = constant_proof_ || modes.constant_proof;
    if (modes.refuted_action < 0) return;
    refuted_actions_ = ToIndex(modes.refuted_action) + 1;
    refuted_anywhere_ = modes.refuted_anywhere;
    proved_ = modes.refuted_proved;
    report_.reason = modes.refuted_reason;
  }

  /// Tries a mode assignment again, from a displaced guess. The last start asks for smaller margins.
  bool Restart(const ModeAssignment& modes, int start) {
    ProgramStart how;
    how.tight = start == starts_ - 1;
    how.noise = how.tight ? 0 : 0.5;
    how.random = random_.Split("start " + std::to_string(start));
    how.near = kNear;
    KeyPoseProgram key_poses = BuildProgram(facts_, steps_, modes.variant, how);
    return key_poses.refutations.empty() && SolveAndJudge(key_poses, start, effort_.restart);
  }

  bool SolveAndJudge(KeyPoseProgram& key_poses, int start, int max_iterations) {
    const nlp::Result result = SolveKeyPoses(facts_, steps_, limits_, max_iterations, nullptr, key_poses);
    LogDebug("candidate " + std::to_string(index_) + " start " + std::to_string(start) + ": " +
             result.Summary() + ArmProblems(key_poses.ik_solutions));
    report_.evaluations += result.evaluations;
    if (result.status == nlp::Status::kFailed && !optimum_) report_.reason = result.message;
    last_violation_ = result.max_violation_m + result.max_violation_rad;
    NoteSuspect(key_poses.program, result);
    return static_cast<int>(result.x.poses.size()) == key_poses.program.num_poses() &&
           Judge(key_poses, result);
  }

  /// Why these key poses have no IK solutions, for the log.
  std::string ArmProblems(const std::vector<IkSolution>& ik_solutions) const {
    std::string all;
    for (size_t t = 0; t < ik_solutions.size(); ++t) {
      if (!ik_solutions[t].problem.empty()) all += "; " + steps_[t].action + ": " + ik_solutions[t].problem;
    }
    return all;
  }

  /// The first action with a violated row may be where it fails.
  void NoteSuspect(const nlp::Program& program, const nlp::Result& result) {
    last_suspect_ = 0;
    if (KeepsRows(result)) return;
    int first = static_cast<int>(actions_.size());
    for (const nlp::Assessment::Violation& violation : nlp::Assess(program, result.x).violations) {
      if (violation.amount < kLeastSuspicious) break;
      const size_t step = ToIndex(violation.residual->step());
      first = std::min(first, steps_[step].action_index + 1);
    }
    if (first == static_cast<int>(actions_.size())) return;
    last_suspect_ = ToIndex(first);
    suspects_.insert(last_suspect_);
  }

  /// Than the best so far. Violations that differ by rounding are the same: the cost decides.
  bool IsBetter(double violation, double cost) const {
    if (!least_violation_) return true;
    const double same = *least_violation_ == 0 || violation == 0 ? 0 : kSameViolation;
    return violation < *least_violation_ - same ||
           (violation <= *least_violation_ + same && cost < report_.plan.cost);
  }

  /// Stores the result if it is the best so far; true if the checker accepts it and it keeps every row.
  bool Judge(KeyPoseProgram& key_poses, const nlp::Result& result) {
    const CheckResult check = CheckKeyPoses(facts_, steps_, result.x.poses, JointsOf(key_poses.ik_solutions));
    const bool accepted = check.Feasible(problem_.program) && AllHaveIkSolutions(facts_, key_poses);
    // Results that the checker accepts without the planner's own margins count only if there is none with
    // them.
    const bool kept = KeepsRows(result);
    const double violation = !accepted ? kRejected + check.max_violation_m + check.max_violation_rad
                             : !kept   ? result.max_violation_m + result.max_violation_rad
                                       : 0;
    if (IsBetter(violation, check.cost)) {
      least_violation_ = violation;
      ReportKeyPoses(facts_, actions_, steps_, result.x.poses, key_poses.ik_solutions, check, report_);
      report_.trace = result.trace;
      report_.blocking.clear();
      blocking_steps_.clear();
      optimum_.reset();
      if (accepted) {
        key_poses.guess = result.x;
        optimum_ =
            std::make_shared<Optimum>(Optimum{actions_, steps_, std::move(key_poses), result.warm_start});
      } else {
        NameBlocking(key_poses, result, check);
      }
    }
    return accepted && kept;
  }

  /// The constraints that conflict: by the solver, and by the checker.
  void NameBlocking(const KeyPoseProgram& key_poses, const nlp::Result& result, const CheckResult& check) {
    const auto name = [&](int step, const std::string& text) {
      blocking_steps_.insert(step);
      std::vector<std::string>& all = report_.blocking;
      if (all.size() < kMostBlocking && std::find(all.begin(), all.end(), text) == all.end())
        all.push_back(text);
    };
    for (const int term : result.blocking_terms) {
      const nlp::Residual& residual = *key_poses.program.terms()[ToIndex(term)].residual;
      name(residual.step(), residual.name());
    }
    for (size_t t = 0; t < key_poses.ik_solutions.size(); ++t) {
      const std::string& problem = key_poses.ik_solutions[t].problem;
      if (!problem.empty()) name(static_cast<int>(t), steps_[t].action + ": " + problem);
    }
    for (const CheckFinding& finding : check.findings) {
      const ProgramOptions& options = problem_.program;
      if (finding.amount > (finding.unit == nlp::Unit::kRadian ? options.feasible_rad : options.feasible_m))
        name(finding.step, finding.action + ": " + finding.label);
    }
    report_.reason += LackOfRoom(report_.blocking);
  }

  /// What there is no room beside, from the conflicting constraints; the worst violation may be of another
  /// one, since the optimiser spreads it: "; no room for the hand beside can and box".
  std::string LackOfRoom(const std::vector<std::string>& blocking) {
    const std::string word = "clearance(";
    std::string of, beside;
    obstructions_.clear();
    for (const std::string& text : blocking) {
      const size_t begin = text.find(word), comma = text.find(", ", begin), end = text.find(')', comma);
      if (begin == std::string::npos || comma == std::string::npos || end == std::string::npos) continue;
      const std::string moved = text.substr(begin + word.size(), comma - begin - word.size());
      const std::string other = text.substr(comma + 2, end - comma - 2);
      if (of.empty()) of = moved;
      const scene::Object* object = problem_.scene.FindObject(other);
      if (object != nullptr && object->movable()) obstructions_.push_back(facts_.frames().Find(other));
      if (moved != of || beside.find(other) != std::string::npos) continue;
      beside += (beside.empty() ? "" : " and ") + other;
    }
    if (beside.empty()) return "";
    return "; no room for " + (of == constraints::kHand ? "the hand" : of) + " beside " + beside;
  }

  void Conclude() {
    if (optimum_ != nullptr) {
      report_.status = CandidateStatus::kFeasible;
      report_.reason.clear();
      return;
    }
    // That every mode assignment examined is refuted proves nothing: there are grasps and contacts that are
    // not among them.
    const bool refuted = (refuted_actions_ > 0 && proved_) || constant_proof_;
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
  Effort effort_;
  int starts_;
  Random random_;

  CandidateReport report_;
  std::optional<double> least_violation_;  // 0: feasible
  std::vector<std::string> refutations_;
  std::set<int> blocking_steps_;
  struct Failure {
    double violation;
    ModeAssignment modes;
  };
  std::vector<Failure> failed_;
  std::set<size_t> suspects_;  // Lengths of prefixes that may fail.
  double last_violation_ = 0;  // of the last solve
  size_t last_suspect_ = 0;    // of the last solve; 0: none
  std::shared_ptr<Optimum> optimum_;
  bool all_refuted_ = true;
  size_t refuted_actions_ = 0;
  bool refuted_anywhere_ = false, proved_ = false, constant_proof_ = false;
  std::vector<FrameId> unmoved_;
  std::vector<FrameId> obstructions_;
};

/// The objects that must be moved so that the last of the failing actions may succeed, if those before it
/// have to do with neither them nor it: then the same holds whatever else comes before.
std::vector<FrameId> FindObstructions(const SceneFacts& facts, const std::vector<std::string>& actions,
                                      const std::vector<BoundStep>& steps, const CandidateRun& run,
                                      size_t failing) {
  if (failing == 0) return {};
  std::vector<FrameId> involved = run.obstructions();
  for (const std::string& argument : ParseActionCall(actions[failing - 1]).arguments)
    involved.push_back(facts.frames().Find(argument));
  for (const BoundStep& step : steps) {
    const FrameId moved = step.control;
    if (step.action_index + 1 < static_cast<int>(failing) &&
        std::find(involved.begin(), involved.end(), moved) != involved.end())
      return {};
  }
  return run.obstructions();
}

/// The length of the shortest failing prefix of a candidate that was given up: up to an action among the
/// conflicting constraints, if that prefix fails by itself too; else all actions.
size_t FindFailingActions(const SceneFacts& facts, const std::vector<std::string>& actions,
                          const std::vector<BoundStep>& steps, const CandidateRun& run, int index,
                          const Limits& limits) {
  std::set<size_t> ends;
  for (const int step : run.blocking_steps()) ends.insert(ToIndex(steps[ToIndex(step)].action_index) + 1);
  for (const size_t end : ends) {
    if (end == actions.size() || limits.Over()) break;
    CandidateRun first(facts, {actions.begin(), actions.begin() + static_cast<std::ptrdiff_t>(end)},
                       FirstSteps(steps, end), index, limits);
    if (!first.Run().feasible() && !limits.Over()) return end;
  }
  return limits.Over() ? 0 : actions.size();
}

}  // namespace

Verdict OptimizeCandidate(const SceneFacts& facts, const Skeleton& skeleton, int index,
                          const Limits& limits) {
  const double begin = limits.Elapsed();
  CandidateRun run(facts, skeleton.actions, skeleton.steps, index, limits);
  Verdict verdict;
  verdict.report = run.Run();
  verdict.optimum = run.optimum();
  verdict.failing_actions = run.refuted_actions();
  verdict.failing_anywhere = run.refuted_anywhere();
  verdict.unmoved = run.unmoved();
  if (verdict.report.status == CandidateStatus::kGaveUp && verdict.failing_actions == 0 && !limits.Over())
    verdict.failing_actions = FindFailingActions(facts, skeleton.actions, skeleton.steps, run, index, limits);
  if (verdict.report.status == CandidateStatus::kGaveUp && verdict.unmoved.empty())
    verdict.unmoved = FindObstructions(facts, skeleton.actions, skeleton.steps, run, verdict.failing_actions);
  verdict.report.optimize_s = limits.Elapsed() - begin;
  return verdict;
}

Verdict OptimizeCandidate(const SceneFacts& facts, const std::vector<std::string>& actions, int index,
                          const Limits& limits) {
  const Problem& problem = facts.problem();
  const SkeletonBinder binder(problem.scene, facts.shared_frames(), problem.actions, problem.constraints);
  return OptimizeCandidate(facts, binder.Bind(actions), index, limits);
}

}  // namespace tether::planning
