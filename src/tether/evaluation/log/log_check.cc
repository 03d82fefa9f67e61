#include "tether/evaluation/log/log_check.h"

#include <algorithm>
#include <filesystem>
#include <optional>

#include "tether/common/text.h"
#include "tether/evaluation/log/log_files.h"
#include "tether/evaluation/pose_history.h"
#include "tether/math/so3.h"
#include "tether/scenario/perturb.h"
#include "tether/scenario/problem.h"

namespace tether::evaluation {
namespace {

constexpr double kMarginTolerance = 1e-3;  // Margins count as kept down to this, m or rad.

std::string TextOf(const Value& map, const char* key) {
  const Value* value = map.Find(key);
  return value == nullptr ? "" : value->AsText();
}

/// The pose at a share of the way between two.
math::Pose Blend(const math::Pose& X_WA, const math::Pose& X_WB, double share) {
  const Eigen::Vector3d turn = math::LogSO3(X_WA.R.transpose() * X_WB.R);
  return {X_WA.R * math::ExpSO3(share * turn), X_WA.p + share * (X_WB.p - X_WA.p)};
}

class LogJudge {
 public:
  LogJudge(const RunLog& log, const scene::Scene& scene, const symbolic::Task& task,
           const std::optional<task::TemporalGoal>& goal)
      : log_(log), scene_(scene), task_(task) {
    if (goal) temporal_.emplace(scene, task, *goal);
  }

  Judgement Judge() {
    if (log_.samples.empty()) return {};
    for (size_t i = 0; temporal_ && i < log_.samples.size(); ++i) {
      const LogSample& sample = log_.samples[i];
      temporal_->Feed([&] { return TruthAt(i); }, Actions(sample), sample.actions_done, sample.running);
    }
    const LogSample& last = log_.samples.back();
    if (temporal_) return temporal_->Judge(TruthAt(log_.samples.size() - 1));
    return JudgeGoal(scene_, TruthAt(log_.samples.size() - 1), task_, Actions(last), last.actions_done);
  }

 private:
  std::vector<std::string> Actions(const LogSample& sample) const {
    std::vector<std::string> actions;
    if (sample.plan >= log_.plans.size()) return actions;
    if (const Value* list = log_.plans[sample.plan].Find("actions")) {
      for (const Value& action : list->items()) actions.push_back(action.AsText());
    }
    return actions;
  }

  Truth TruthAt(size_t index) const {
    const LogSample& sample = log_.samples[index];
    Truth truth;
    for (const scene::Object& object : scene_.objects) {
      const auto found = sample.X_WO.find(object.name);
      truth.X_WO[object.name] = found == sample.X_WO.end() ? scene_.InitialPose(object.name) : found->second;
    }
    truth.X_WHand = sample.X_WHand;
    truth.X_WO_before = Before(index, truth.X_WO);
    truth.contact_force = [&sample](const std::string& a, const std::string& b) {
      double sum = 0;
      for (const sim::Contact& contact : sample.contacts) {
        if ((contact.a == a && contact.b == b) || (contact.a == b && contact.b == a)) sum += contact.force;
      }
      return sum;
    };
    return truth;
  }

  /// The poses kRestWindow before a sample, between those that were logged; at the start, the first.
  std::map<std::string, math::Pose> Before(size_t index, const std::map<std::string, math::Pose>& now) const {
    const double wanted = log_.samples[index].time - kRestWindow;
    size_t after = index;
    while (after > 0 && log_.samples[after - 1].time > wanted) --after;
    const LogSample& late = log_.samples[after];
    const LogSample& early = log_.samples[after > 0 ? after - 1 : 0];
    const double span = late.time - early.time;
    const double share = span > 0 ? std::clamp((wanted - early.time) / span, 0.0, 1.0) : 0.0;
    std::map<std::string, math::Pose> before;
    for (const auto& [name, X_WO] : now) {
      const auto a = early.X_WO.find(name), b = late.X_WO.find(name);
      before[name] =
          a == early.X_WO.end() || b == late.X_WO.end() ? X_WO : Blend(a->second, b->second, share);
    }
    return before;
  }

  const RunLog& log_;
  const scene::Scene& scene_;
  const symbolic::Task& task_;
  std::optional<TemporalJudge> temporal_;
};

void NoteOrigin(const RunLog& log, FileCheck& check) {
  check.notes.push_back(log.Metadata("scenario") + ", seed " + log.Metadata("seed") + ", " +
                        Fixed(log.end, 2) + " s, by tether " + log.Metadata("tether"));
  const LogSeries* worst = nullptr;
  double least = -kMarginTolerance, when = 0;
  for (const LogSeries& series : log.series) {
    if (series.unit != "m" && series.unit != "rad") continue;
    for (size_t i = 0; i < series.values.size(); ++i) {
      if (!(series.values[i] < least)) continue;
      worst = &series;
      least = series.values[i];
      when = series.times[i];
    }
  }
  if (worst != nullptr) {
    check.notes.push_back("margin " + worst->name + " was short by " + Fixed(-1e3 * least, 1) +
                          (worst->unit == "m" ? " mm" : " mrad") + " at " + Fixed(when, 2) + " s");
  }
}

void CheckReport(const RunLog& log, const Judgement& judged, FileCheck& check) {
  if (log.report.is_null()) return;
  const std::string status = TextOf(log.report, "status"), reason = TextOf(log.report, "reason");
  if (status != "success") {
    check.problems.push_back("the run ended as " + status +
                             (reason.empty() || reason == status ? "" : ": " + reason));
  }
  const Value* reached = log.report.Find("goal_reached");
  const bool said = reached != nullptr && reached->boolean();
  if (said != judged.goal_reached) {
    check.problems.push_back(std::string("the run's report says that the goal was ") + (said ? "" : "not ") +
                             "reached, its samples that it was " + (said ? "not" : "reached"));
  }
}

}  // namespace

Judgement JudgeLog(const RunLog& log) {
  const LogFiles files(log.files);
  const scenario::Scenario scenario = scenario::LoadScenario(files.PathOf(log.Metadata("scenario_file")));
  const auto task = scenario::MakeTask(scenario);
  Value seed = Value::FromText(log.Metadata("seed"));
  const scene::Scene scene =
      scenario::PerturbScene(scenario.scene, scenario.perturb, seed.natural().value_or(scenario.seed));
  std::optional<task::TemporalGoal> goal = scenario.goal;
  if (!log.Metadata("goal").empty())
    goal = scenario::ReadTemporalGoal(log.Metadata("goal"), log.Metadata("semantics"));
  return LogJudge(log, scene, *task, goal).Judge();
}

void CheckRunLog(const std::string& file, FileCheck& check) {
  check.kind = "log";
  const RunLog log = ReadRunLog(file, true);
  NoteOrigin(log, check);
  if (log.problem) {
    check.problems.push_back(log.problem->text + " (byte " + std::to_string(log.problem->offset) +
                             "); the log has the run up to " + Fixed(log.end, 2) + " s" +
                             (log.report.is_null() ? ", not to its end" : ", to its end"));
  }
  const Judgement judged = JudgeLog(log);
  for (const GoalFact& fact : judged.facts) {
    const char* how = fact.geometric ? "" : " (by the effects of the actions)";
    if (!judged.goal_reached && !fact.holds)
      check.problems.push_back(fact.atom + (fact.lapsed ? " held and no longer does" : " is false") + how);
  }
  check.notes.push_back(judged.goal_reached ? "by its samples the goal was reached"
                                            : "by its samples the goal was not reached");
  if (!judged.goal_reached && check.problems.empty()) check.problems.push_back("the goal was not reached");
  CheckReport(log, judged, check);
}

}  // namespace tether::evaluation
