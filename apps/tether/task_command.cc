#include "apps/tether/task_command.h"

#include <algorithm>
#include <chrono>
#include <utility>

#include "apps/tether/commands.h"
#include "apps/tether/terminal.h"
#include "tether/common/exit_code.h"
#include "tether/common/output/output_header.h"
#include "tether/common/output/outputs.h"
#include "tether/common/text.h"
#include "tether/scenario/problem.h"
#include "tether/symbolic/grounding/relevance.h"
#include "tether/task/search/greedy.h"

namespace tether::app {
namespace {

void Validate(const TaskArguments& arguments) {
  Diagnostics mistakes;
  if (std::find(scenario::SearchNames().begin(), scenario::SearchNames().end(), arguments.search) ==
      scenario::SearchNames().end()) {
    mistakes.Add({}, "--search: unknown '" + arguments.search + "'",
                 SuggestFrom(arguments.search, scenario::SearchNames()));
  }
  if (arguments.max_plans < 0) {
    mistakes.Add({}, "--max-plans is " + std::to_string(arguments.max_plans), "1 or more, or 0 for all");
  } else if (arguments.search == "greedy" && arguments.max_plans != 1) {
    mistakes.Add(
        {}, "--max-plans is " + std::to_string(arguments.max_plans) + ", but --search greedy finds one plan",
        "astar, dijkstra or bfs find as many as are wanted");
  }
  if (!(arguments.time_limit_s >= 0)) {
    mistakes.Add({},
                 std::string("--time-limit is ") + (arguments.time_limit_s < 0 ? "negative" : "not a number"),
                 "seconds, or 0 for no limit");
  }
  if (arguments.goal.empty() && arguments.semantics != "cosafe") {
    mistakes.Add({}, "--semantics has no effect without --goal", "--goal FORMULA");
  }
  mistakes.ThrowIfAny();
}

double Since(std::chrono::steady_clock::time_point begin) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

std::string StatusName(const TaskReport& report) {
  if (report.ended == task::SearchStatus::kInterrupted) return "interrupted";
  if (!report.plans.empty()) return "solved";
  return report.ended == task::SearchStatus::kExhausted ? "impossible" : "gave_up";
}

int ExitCodeOf(const TaskReport& report) {
  if (report.ended == task::SearchStatus::kInterrupted) return kExitInterrupted;
  if (!report.plans.empty()) return kExitSuccess;
  return report.ended == task::SearchStatus::kExhausted ? kExitImpossible : kExitGaveUp;
}

std::string Message(const TaskReport& report) {
  if (report.unsatisfiable) return task::kUnsatisfiable;
  if (report.plans.empty() && report.ended == task::SearchStatus::kExhausted) {
    return "no sequence of actions reaches the goal";
  }
  if (report.ended == task::SearchStatus::kFound) return "";
  return (report.grounded ? "" : "grounding: ") + std::string(Describe(report.ended));
}

std::string Count(uint64_t number, const std::string& what) {
  return std::to_string(number) + " " + what + (number == 1 ? "" : "s");
}

void PrintPlans(const TaskReport& report, const symbolic::Task* task, const Terminal& terminal) {
  constexpr size_t kPiece = size_t{1} << 16;
  std::string text;  // Some plans at once: there may be millions.
  const auto print = [&] {
    if (!text.empty()) text.pop_back();
    if (!text.empty()) terminal.Print(text);
    text.clear();
  };
  for (const task::Skeleton& plan : report.plans) {
    char cost[32];
    FormatInto(cost, sizeof cost, "%.10g", plan.cost);
    text += terminal.Bold("cost " + std::string(cost)) + "  " +
            terminal.Dim(Count(plan.actions.size(), "action")) + "\n";
    for (const ActionId action : plan.actions) text += "  " + task->actions()[action].name + "\n";
    if (text.size() > kPiece) print();
  }
  print();
}

void Print(const TaskReport& report, const symbolic::Task* task, const Terminal& terminal) {
  PrintPlans(report, task, terminal);
  const std::string message = Message(report);
  if (!message.empty())
    terminal.Print(report.plans.empty() ? terminal.Red(message) : terminal.Yellow(message));
  std::string line = Count(report.expanded, "state") + " expanded, " + std::to_string(report.generated) +
                     " generated" +
                     (report.reachable ? ", " + std::to_string(*report.reachable) + " reachable" : "");
  if (report.automaton_states) {
    line += "; " + Count(static_cast<uint64_t>(*report.automaton_states), "state") + " of the automaton";
  }
  terminal.Print(terminal.Dim(line + "; grounding " + Fixed(1e3 * report.ground_s, 2) + " ms, search " +
                              Fixed(1e3 * report.search_s, 2) + " ms"));
}

}  // namespace

Limits TaskArguments::MakeLimits() const {
  Limits limits;
  limits.interrupted = stop;
  limits.memory = memory_limit;
  limits.SetTimeLimit(time_limit_s);
  return limits;
}

namespace {

void SearchGreedily(task::Product& product, const task::SearchLimits& limits, TaskReport& report) {
  task::GreedyResult result = FindGreedily(product, limits);
  report.ended = result.status;
  if (result.skeleton) report.plans.push_back(std::move(*result.skeleton));
  report.expanded = result.expanded;
  report.generated = result.generated;
  if (product.automaton() != nullptr) report.automaton_states = product.automaton()->states();
  report.complete = result.skeleton.has_value() || report.ended == task::SearchStatus::kExhausted;
}

/// Counts the reachable states of the whole task, whatever part of it was searched.
void CountReachable(task::SkeletonSearch& search, const std::shared_ptr<const symbolic::Task>& whole,
                    const task::SearchLimits& limits, TaskReport& report) {
  std::optional<task::SkeletonSearch> other;
  if (&search.task() != whole.get()) other.emplace(whole, task::SkeletonOptions{.blind = true});
  task::SkeletonSearch& all = other ? *other : search;
  const auto stop = all.ExploreAll(limits);
  if (stop) {
    report.ended = *stop;
    report.complete = false;
  } else {
    report.reachable = all.graph().states();
  }
}

void SearchInOrder(std::unique_ptr<task::Product> product, const std::shared_ptr<const symbolic::Task>& whole,
                   const TaskArguments& arguments, const task::SearchLimits& limits, TaskReport& report) {
  const bool blind = arguments.search != "astar";
  task::SkeletonSearch search(
      std::move(product), {.blind = blind, .unit_costs = arguments.search == "bfs", .first_at_once = true});
  const size_t wanted = static_cast<size_t>(arguments.max_plans);
  try {
    do {
      task::SearchOutcome outcome = search.Next(limits);
      report.ended = outcome.status;
      if (!outcome.found()) break;
      report.plans.push_back(std::move(*outcome.skeleton));
    } while (wanted == 0 || report.plans.size() < wanted);
    report.complete =
        report.ended == task::SearchStatus::kFound || report.ended == task::SearchStatus::kExhausted;
    if (blind && report.complete) CountReachable(search, whole, limits, report);
  } catch (const LimitReached& reached) {
    // The plans found so far are kept.
    report.ended = task::StatusOf(reached.limit());
    report.complete = false;
  }
  if (report.ended == task::SearchStatus::kExhausted && !report.plans.empty())
    report.ended = task::SearchStatus::kFound;
  report.expanded = search.graph().expanded();
  report.generated = search.graph().generated();
  if (search.product().automaton() != nullptr)
    report.automaton_states = search.product().automaton()->states();
}

}  // namespace

TaskReport SearchTask(std::shared_ptr<const symbolic::Task> task, const TaskArguments& arguments,
                      const Limits& common) {
  Validate(arguments);
  TaskReport report;
  std::optional<task::TemporalGoal> goal;
  if (!arguments.goal.empty()) goal = scenario::ReadTemporalGoal(arguments.goal, arguments.semantics);
  const auto begin = std::chrono::steady_clock::now();
  const task::SearchLimits limits{common};
  // A plan's word has a letter for each action, so a temporal goal may depend on any of them.
  symbolic::RelevantTask relevant;
  if (arguments.max_plans == 1 && !goal) relevant = symbolic::KeepRelevant(task);
  auto product = std::make_unique<task::Product>(relevant.task ? relevant.task : task, goal);
  report.unsatisfiable = product->IsUnsatisfiable();
  if (arguments.search == "greedy") {
    SearchGreedily(*product, limits, report);
  } else {
    SearchInOrder(std::move(product), task, arguments, limits, report);
  }
  for (task::Skeleton& plan : report.plans) {
    if (relevant.task) {
      for (ActionId& action : plan.actions) action = relevant.actions[action];
    }
    // Whatever the search minimised.
    plan.cost = 0;
    for (const ActionId action : plan.actions) plan.cost += static_cast<double>(task->actions()[action].cost);
    plan.cost *= task->cost_unit();
  }
  report.search_s = Since(begin);
  return report;
}

namespace {

/// The members of an object without its braces, as they stand in one of two spaces' indent.
std::string MembersText(const Value& object) {
  const std::string text = WriteJson(object);
  return text.substr(2, text.size() - 5);  // "{\n", "\n}\n"
}

/// The member "plans": there may be millions, so that they are never a document in memory.
void WritePlans(const TaskReport& report, const symbolic::Task* task, const TextSink& sink) {
  sink("  \"plans\": [");
  std::vector<std::string> names;
  if (task != nullptr && !report.plans.empty()) {
    for (const auto& action : task->actions()) names.push_back(WriteJson(Value(action.name), 0));
  }
  std::string text;
  for (const task::Skeleton& plan : report.plans) {
    text =
        &plan == &report.plans.front() ? "\n    {\n      \"actions\": [" : ",\n    {\n      \"actions\": [";
    for (size_t i = 0; i < plan.actions.size(); ++i) {
      if (i > 0) text += ", ";
      text += names[plan.actions[i].index()];
    }
    text += "],\n      \"cost\": " + WriteJson(Value(plan.cost), 0) + "\n    }";
    sink(text);
  }
  sink(report.plans.empty() ? "]" : "\n  ]");
}

}  // namespace

void WriteTaskReport(const TaskReport& report, const symbolic::Problem& problem, const symbolic::Task* task,
                     const TaskArguments& arguments, const TextSink& sink) {
  Value head = OutputHeader("tether.task_report/1", 0);
  head.Set("domain", problem.domain->name).Set("problem", problem.name);
  if (!arguments.goal.empty()) head.Set("goal", arguments.goal).Set("semantics", arguments.semantics);
  head.Set("status", StatusName(report)).Set("complete", report.complete).Set("message", Message(report));
  sink("{\n" + MembersText(head) + ",\n");
  WritePlans(report, task, sink);
  Value search = Value::Object();
  search.Set("algorithm", arguments.search);
  search.Set("expanded", report.expanded).Set("generated", report.generated);
  if (report.reachable) search.Set("reachable", *report.reachable);
  search.Set("search_s", report.search_s).Set("ground_s", report.ground_s).Set("parse_s", report.parse_s);
  Value tail = Value::Object();
  tail.Set("search", std::move(search));
  tail.Set("search_s", report.search_s).Set("ground_s", report.ground_s).Set("parse_s", report.parse_s);
  if (task != nullptr) {
    tail.Set("task", Value::Object()
                         .Set("atoms", static_cast<uint64_t>(task->atoms().size()))
                         .Set("actions", static_cast<uint64_t>(task->actions().size())));
  }
  if (report.automaton_states) tail.Set("automaton", Value::Object().Set("states", *report.automaton_states));
  sink(",\n" + MembersText(tail) + "\n}\n");
}

int TaskCommand(const TaskArguments& arguments) {
  Validate(arguments);
  Outputs outputs;
  outputs.Add(arguments.json, "--json");
  outputs.Require({arguments.domain, arguments.problem});
  const Terminal terminal(arguments.json == "-");
  const Limits limits = arguments.MakeLimits();
  const LimitsScope scope(limits);
  std::optional<ReportingScope> reporting;  // Outlives the report.
  auto begin = std::chrono::steady_clock::now();
  const auto problem = symbolic::ReadProblem(arguments.domain, arguments.problem);
  const double parse_s = Since(begin);
  begin = std::chrono::steady_clock::now();
  std::shared_ptr<const symbolic::Task> task;
  TaskReport report;
  double ground_s = 0;
  try {
    task = symbolic::Task::Ground(problem, limits);
    ground_s = Since(begin);
    report = SearchTask(task, arguments, limits);
  } catch (const LimitReached& reached) {
    report.ended = task::StatusOf(reached.limit());
    report.grounded = task != nullptr;
    (task == nullptr ? ground_s : report.search_s) = Since(begin);
  }
  report.parse_s = parse_s;
  report.ground_s = ground_s;
  reporting.emplace();
  Print(report, task.get(), terminal);
  outputs.WriteText(arguments.json, [&](const TextSink& sink) {
    WriteTaskReport(report, *problem, task.get(), arguments, sink);
  });
  outputs.Finish();
  reporting->Done();
  return ExitCodeOf(report);
}

}  // namespace tether::app
