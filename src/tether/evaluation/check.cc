#include "tether/evaluation/check.h"

#include <array>
#include <deque>
#include <filesystem>
#include <fstream>
#include <optional>
#include <variant>

#include "tether/common/file.h"
#include "tether/common/text.h"
#include "tether/constraints/core/kind.h"
#include "tether/evaluation/log/log_check.h"
#include "tether/evaluation/run.h"
#include "tether/planning/check/checker.h"
#include "tether/planning/plan/plan_file.h"
#include "tether/planning/skeleton/action_reader.h"
#include "tether/planning/skeleton/skeleton_binding.h"
#include "tether/scenario/problem.h"
#include "tether/scenario/scene_reader.h"
#include "tether/scene/resting_contact.h"
#include "tether/sim/world.h"

namespace tether::evaluation {
namespace {

class FileChecker {
 public:
  explicit FileChecker(Diagnostics& diagnostics) : diagnostics_(diagnostics) {}

  std::vector<FileCheck> Run(const std::vector<std::string>& files) {
    std::vector<std::pair<size_t, Value>> plans;
    std::vector<bool> mistaken(files.size(), false);
    for (const std::string& file : files) {
      const size_t before = diagnostics_.list().size();
      checks_.push_back({file, "", {}, {}});
      try {
        if (BeginsAsLog(file)) {
          CheckRunLog(file, checks_.back());
          mistaken[checks_.size() - 1] = false;
          continue;
        }
        const std::string text = ReadFile(file);  // Once: a pipe gives it only once.
        const Value document = ParseYaml(text, file);
        const Value* format = document.Find("format");
        const std::string name = format == nullptr ? "" : format->AsText();
        if (name == scenario::kScenarioFormat) {
          CheckScenario(file, text, checks_.back());
        } else if (name == planning::kActionsFormat) {
          CheckLibrary(document, checks_.back());
        } else if (name == "tether.events/1") {
          checks_.back().kind = "events";
          checks_.back().notes.push_back(
              std::to_string(scenario::ParseEvents(document, {}, diagnostics_).size()) + " events");
        } else if (name == planning::kPlanFormat) {
          checks_.back().kind = "plan";
          plans.emplace_back(checks_.size() - 1, document);
        } else {
          UnknownFormat(file, document, name);
        }
      } catch (const InputError& error) {
        diagnostics_.Add(error);
      }
      mistaken[checks_.size() - 1] = diagnostics_.list().size() > before;
    }
    // Plans come last: their scenario may stand anywhere among the files.
    for (const auto& [index, document] : plans) {
      try {
        CheckOnePlan(document, checks_[index]);
      } catch (const InputError& error) {
        diagnostics_.Add(error);
        mistaken[index] = true;
      }
    }
    std::vector<FileCheck> sound;
    for (size_t i = 0; i < checks_.size(); ++i) {
      if (!mistaken[i]) sound.push_back(std::move(checks_[i]));
    }
    return sound;
  }

 private:
  /// Whether a regular file begins as an MCAP file does; it may be larger than ReadFile() reads.
  static bool BeginsAsLog(const std::string& file) {
    std::error_code error;
    if (!std::filesystem::is_regular_file(file, error)) return false;
    std::array<char, 8> first{};
    std::ifstream stream(file, std::ios::binary);
    stream.read(first.data(), first.size());
    return IsMcap({first.data(), static_cast<size_t>(stream.gcount())});
  }

  void UnknownFormat(const std::string& file, const Value& document, const std::string& name) {
    const std::vector<std::string> formats = {scenario::kScenarioFormat, planning::kActionsFormat,
                                              "tether.events/1", planning::kPlanFormat};
    if (name == "tether.log/1") ParseRunLog("{\"format\": \"" + name + "\"}", file);  // which says what to do
    const Value* format = document.Find("format");
    diagnostics_.Add(format ? format->where() : Location{file, 1, 1},
                     format ? "unknown format '" + name + "'" : "there is no 'format'",
                     SuggestFrom(name, formats));
  }

  void CheckScenario(const std::string& file, const std::string& text, FileCheck& check) {
    check.kind = "scenario";
    scenario::Scenario scenario = scenario::LoadScenario(file, {{file, text}});
    // What only the simulation refuses is reported too.
    sim::RequireSimulable(scenario.scene, scenario.models, scene::InitialPoses(scenario.scene));
    check.problems = CheckGeometry(scenario);
    for (std::string& problem : CheckArms(scenario)) check.problems.push_back(std::move(problem));
    check.notes.push_back(std::to_string(scenario.scene.objects.size()) + " objects, " +
                          std::to_string(scenario.scene.regions.size()) + " regions, " +
                          std::to_string(scenario.scene.robots.size()) + " robots, " +
                          std::to_string(scenario.actions.size()) + " actions");
    if (scenario.problem != nullptr) {
      const auto task = symbolic::Task::Ground(scenario.problem);
      check.notes.push_back(std::to_string(task->actions().size()) + " ground actions, " +
                            std::to_string(task->atoms().size()) + " atoms that change");
      if (scenario.goal) {
        const task::Product product(task, scenario.goal);  // throws where it names what does not exist
        check.notes.push_back("a temporal goal");
        if (product.IsUnsatisfiable())
          check.problems.push_back(scenario.goal->where.ToString() +
                                   ": the goal can't be reached: " + task::kUnsatisfiable);
      }
    }
    scenarios_.push_back(std::move(scenario));
  }

  void CheckLibrary(const Value& document, FileCheck& check) {
    check.kind = "action library";
    const auto actions =
        planning::ParseActions(document, {constraints::KindNames(), std::nullopt}, diagnostics_);
    std::string names;
    for (const planning::ActionSchema& action : actions) {
      names += (names.empty() ? "" : ", ") + action.name;
      for (const planning::StepSchema& step : action.steps) {
        for (const planning::ConstraintSpec& spec : step.constraints) {
          if (const auto* kind = constraints::FindKind(spec.kind)) {
            constraints::ReadParameters(*kind, spec.parameters, diagnostics_);
          }
        }
      }
    }
    check.notes.push_back("actions " + names);
  }

  /// The scenario that a plan belongs to.
  const scenario::Scenario& FindScenario(const Value& document, const std::string& file) {
    const Value* title = document.Find("scenario");
    for (const scenario::Scenario& scenario : scenarios_) {
      if (title != nullptr && scenario.title == title->AsText()) return scenario;
    }
    const std::string named = planning::ReadPlanOrigin(document).scenario_file;
    const std::filesystem::path beside = std::filesystem::path(file).parent_path() / named;
    for (const std::filesystem::path& path : {std::filesystem::path(named), beside}) {
      std::error_code ignored;
      if (named.empty() || !std::filesystem::is_regular_file(path, ignored)) continue;
      scenarios_.push_back(scenario::LoadScenario(path.string()));
      return scenarios_.back();
    }
    throw InputError({{Location{file, 0, 0},
                       "the scenario of this plan, '" + (title ? title->AsText() : "") + "' (" +
                           (named.empty() ? "no file named" : named) + "), is not there",
                       "its scenario file beside the plan's: tether check SCENARIO PLAN"}});
  }

  void CheckOnePlan(const Value& document, FileCheck& check) {
    const scenario::Scenario& scenario = FindScenario(document, check.file);
    Diagnostics mistakes;
    const planning::Plan plan = planning::ParsePlan(document, scenario.scene, scenario.actions, mistakes);
    mistakes.ThrowIfAny();
    RequireRunnablePlan(scenario, plan, check.file);
    const planning::Problem problem = scenario::MakeProblem(scenario, scenario.scene, {});
    const planning::CheckResult result = planning::CheckPlan(problem, plan);
    for (const planning::CheckFinding& finding : result.findings) {
      const bool metres = finding.unit == nlp::Unit::kMetre;
      if (finding.amount <= (metres ? problem.program.feasible_m : problem.program.feasible_rad)) continue;
      check.problems.push_back(finding.action + ": " + finding.label + " is violated by " +
                               Fixed(1e3 * finding.amount, 2) + (metres ? " mm" : " mrad"));
    }
    CheckGrasps(scenario, plan, check);
    CheckGoal(scenario, plan, check);
    check.notes.push_back("cost " + Fixed(result.cost, 4) + ", largest violation " +
                          Fixed(1e3 * result.max_violation_m, 3) + " mm and " +
                          Fixed(1e3 * result.max_violation_rad, 3) + " mrad");
  }

  /// What only `tether run` refuses is reported too.
  static void RequireRunnablePlan(const scenario::Scenario& scenario, const planning::Plan& plan,
                                  const std::string& file) {
    if (scenario.problem == nullptr) return;
    try {
      RequireRunnable(scenario, *symbolic::Task::Ground(scenario.problem), plan);
    } catch (const InputError& error) {
      Diagnostics mistakes;
      for (const Diagnostic& mistake : error.diagnostics()) {
        mistakes.Add(mistake.where.file.empty() ? Location{file, 0, 0} : mistake.where, mistake.message,
                     mistake.accepted);
      }
      mistakes.ThrowIfAny();
    }
  }

  /// What is in the hand after these verbs, by the last gripper verb: a name, or empty; none: the same as
  /// before.
  static void Follow(const std::vector<planning::Verb>& verbs, std::optional<std::string>& held) {
    for (const planning::Verb& verb : verbs) {
      if (const auto* gripper = std::get_if<planning::GripperVerb>(&verb)) held = gripper->close_on;
    }
  }

  /// After each action the hand must hold what the action's schema says: a plan is run by the verbs in its
  /// file.
  static void CheckGrasps(const scenario::Scenario& scenario, const planning::Plan& plan, FileCheck& check) {
    if (scenario.execution.controller == "constrained_velocity") return;  // which reads none of them
    const auto name = [](const std::optional<std::string>& held) -> std::string {
      if (!held) return "leaves the gripper as it is";
      return held->empty() ? "opens the gripper" : "closes the gripper on '" + *held + "'";
    };
    for (size_t i = 0; i < plan.actions.size(); ++i) {
      const planning::ActionCall call = planning::ParseActionCall(plan.actions[i]);
      std::optional<std::string> asked, held;
      for (const planning::ActionSchema& schema : scenario.actions) {
        if (schema.name != call.name) continue;
        for (const planning::StepSchema& step : planning::BindAction(schema, call.arguments))
          Follow(step.execute, asked);
      }
      for (const planning::PlanStep& step : plan.steps) {
        if (step.action_index == static_cast<int>(i)) Follow(step.execute, held);
      }
      if (held != asked) {
        check.problems.push_back(plan.actions[i] + ": its `execute` " + name(held) + ", but the action " +
                                 name(asked));
      }
    }
  }

  /// The plan's actions must be applicable one after another and reach the goal.
  static void CheckGoal(const scenario::Scenario& scenario, const planning::Plan& plan, FileCheck& check) {
    if (scenario.problem == nullptr) return;
    const auto task = symbolic::Task::Ground(scenario.problem);
    task::Product product(task, scenario.goal);
    std::optional<symbolic::State> state = product.Start();
    for (const std::string& name : plan.actions) {
      if (!state) break;
      const ActionId action = task->FindAction(name);
      if (!action.valid() || !task->IsApplicable(action, *state)) {
        check.problems.push_back("action " + name + " is not possible where it stands in the plan");
        return;
      }
      symbolic::State next(product.words());
      if (product.Apply(action, *state, next)) {
        state = std::move(next);
      } else {
        state.reset();
      }
    }
    if (!state || !product.IsGoal(*state))
      check.problems.push_back("the plan's actions do not reach the goal");
  }

  Diagnostics& diagnostics_;
  std::vector<FileCheck> checks_;
  std::deque<scenario::Scenario> scenarios_;
};

}  // namespace

std::vector<FileCheck> CheckFiles(const std::vector<std::string>& files, Diagnostics& diagnostics) {
  return FileChecker(diagnostics).Run(files);
}

std::vector<FileCheck> CheckFiles(const std::vector<std::string>& files) {
  Diagnostics diagnostics;
  std::vector<FileCheck> checks = CheckFiles(files, diagnostics);
  diagnostics.ThrowIfAny();
  return checks;
}

}  // namespace tether::evaluation
