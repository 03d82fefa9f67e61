#include "tether/bench/bench_task.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include "tether/bench/process_time.h"
#include "tether/common/output/output_header.h"
#include "tether/common/stop.h"
#include "tether/common/text.h"
#include "tether/ltl/automaton/automaton.h"
#include "tether/ltl/formula/parser.h"
#include "tether/planning/modes/region_domain.h"
#include "tether/task/search/skeleton.h"
#include "tether/task/symmetry/symmetry.h"

namespace tether::bench {
namespace {

/// Automata beyond this are not built as a whole.
constexpr int kMostAutomatonStates = 10'000;

/// Paper B's scene: section 4.1.
planning::RegionLayout AssistiveLayout() {
  planning::RegionLayout layout;
  layout.hub = "inter";
  for (const char* name : {"person_1", "person_2", "book_place", "pen_place", "prep", "heat", "wait", "cool"})
    layout.regions.push_back({name, 1});
  layout.items = {{"meat", "prep"}, {"salad", "wait"}, {"book", "person_1"}, {"pen", "pen_place"}};
  layout.groups["person"] = {"person_1", "person_2"};
  return layout;
}

constexpr const char* kAssistiveGoal =
    "F(in(pen,person) & in(book,person)) & F(in(meat,heat) & X F(in(meat,person) & in(salad,person))) & "
    "F(in(book,book_place) & in(pen,pen_place))";

std::string Name(const char* kind, int number) { return kind + std::to_string(number); }

/// The same with more objects and regions, which eq. (21) is not about.
planning::RegionLayout LargerLayout(int items, int regions) {
  planning::RegionLayout layout = AssistiveLayout();
  for (int i = static_cast<int>(layout.regions.size()) + 1; i <= regions; ++i)
    layout.regions.push_back({Name("place", i), 1});
  // Downwards from the last region, skipping those that hold something.
  int at = regions;
  for (int i = static_cast<int>(layout.items.size()) + 1; i <= items; ++i) {
    const auto taken = [&](const std::string& region) {
      return std::any_of(layout.items.begin(), layout.items.end(),
                         [&](const planning::RegionLayout::Item& item) { return item.region == region; });
    };
    while (taken(layout.regions[static_cast<size_t>(at) - 1].name)) --at;
    layout.items.push_back({Name("thing", i), layout.regions[static_cast<size_t>(at) - 1].name});
  }
  return layout;
}

/// `count` tasks: an object into one region, and later into another.
std::string TasksGoal(const planning::RegionLayout& layout, int count) {
  std::string goal;
  const int items = static_cast<int>(layout.items.size()), regions = static_cast<int>(layout.regions.size());
  for (int i = 0; i < count; ++i) {
    const auto in = [&](int region) {
      return "in(" + layout.items[i % items].name + "," + layout.regions[region % regions].name + ")";
    };
    goal += (i > 0 ? " & " : "") + std::string("F(") + in(3 * i + 1) + " & X F " + in(3 * i + 5) + ")";
  }
  return goal;
}

std::unique_ptr<task::Product> MakeProduct(const std::string& domain, const std::string& problem,
                                           const std::string& formula) {
  auto parsed = symbolic::ParseProblem(problem, "problem", symbolic::ParseDomain(domain, "domain"));
  const task::TemporalGoal goal{ltl::ParseFormula(formula), ltl::Semantics::kCosafe, {}};
  return std::make_unique<task::Product>(symbolic::Task::Ground(std::move(parsed)), goal);
}

/// Whether all of `wanted` are reached within `max_states` states.
bool ReachesAll(task::Product& product, std::vector<symbolic::State> wanted, size_t max_states) {
  task::StateGraph graph(product, {.blind = true});
  size_t looked_at = 0;
  do {
    for (; looked_at < graph.states(); ++looked_at) {
      const symbolic::StateView state = graph.state(static_cast<int>(looked_at));
      std::erase_if(wanted, [&](const symbolic::State& one) { return std::ranges::equal(one, state); });
    }
  } while (!wanted.empty() && graph.states() < max_states && graph.ExpandBeyondGoals());
  return wanted.empty();
}

class TaskBenchRun {
 public:
  TaskBenchRun(const TaskBenchOptions& options, const std::function<void(const TaskRow&)>& on_row)
      : on_row_(on_row) {
    bench_.options = options;
  }

  TaskBench Run() {
    const planning::RegionLayout assistive = AssistiveLayout();
    Measure({.section = "eq. (21)", .name = "regions"}, assistive, kAssistiveGoal);
    for (int poses : {1, 2, 4, 9}) {
      Measure({.section = "abstractions", .name = std::to_string(poses) + " poses", .poses = poses},
              assistive, kAssistiveGoal);
    }
    for (int n = 1; n <= 8; ++n) {
      Measure({.section = "tasks", .name = std::to_string(n) + " tasks"}, assistive, TasksGoal(assistive, n));
    }
    for (const auto& [items, regions] : std::vector<std::pair<int, int>>{
             {4, 8}, {6, 8}, {4, 12}, {6, 12}, {8, 12}, {10, 12}, {4, 16}, {6, 16}, {8, 16}, {10, 16}}) {
      Measure({.section = "scenes",
               .name = std::to_string(items) + " objects, " + std::to_string(regions) + " regions"},
              LargerLayout(items, regions), kAssistiveGoal);
    }
    return std::move(bench_);
  }

 private:
  bool Stopped() const { return IsStopped(bench_.options.stop); }

  void Measure(TaskRow row, const planning::RegionLayout& layout, const std::string& formula) {
    if (bench_.interrupted) return;
    row.items = static_cast<int>(layout.items.size());
    row.regions = static_cast<int>(layout.regions.size());
    const std::string domain = row.poses > 0 ? planning::PoseDomainText() : planning::RegionDomainText();
    const std::string problem =
        row.poses > 0 ? planning::PoseProblemText(layout, row.poses) : planning::RegionProblemText(layout);
    const auto automaton = ltl::BuildAutomaton(ltl::ParseFormula(formula), ltl::Semantics::kCosafe);
    if (automaton && automaton->states() <= kMostAutomatonStates) row.automaton_states = automaton->states();
    Search("astar", {}, domain, problem, formula, row);
    Search("astar, all states", {.symmetry = false}, domain, problem, formula, row);
    Search("dijkstra", {.blind = true}, domain, problem, formula, row);
    if (row.section == "eq. (21)" || row.section == "abstractions")
      row.reachable = CountReachable(domain, problem, formula, bench_.options.max_states);
    bench_.interrupted = bench_.interrupted || Stopped();
    if (bench_.interrupted) return;
    on_row_(row);
    bench_.rows.push_back(std::move(row));
  }

  void Search(const std::string& algorithm, task::SkeletonOptions options, const std::string& domain,
              const std::string& problem, const std::string& formula, TaskRow& row) {
    if (bench_.interrupted) return;
    TaskMeasurement measurement;
    measurement.algorithm = algorithm;
    options.first_at_once = true;
    options.max_states = bench_.options.max_states;
    task::SearchLimits limits;
    limits.interrupted = bench_.options.stop;
    for (int repetition = 0; repetition < bench_.options.repetitions; ++repetition) {
      const Stopwatch watch;
      task::SkeletonSearch search(MakeProduct(domain, problem, formula), options);
      const task::SearchOutcome outcome = search.Next(limits);
      const double seconds = watch.cpu_s();
      bench_.interrupted = outcome.status == task::SearchStatus::kInterrupted;
      if (bench_.interrupted) return;
      measurement.seconds = repetition == 0 ? seconds : std::min(measurement.seconds, seconds);
      measurement.expanded = search.graph().expanded();
      measurement.generated = search.graph().generated();
      if (outcome.found()) measurement.cost = outcome.skeleton->cost;
      if (seconds > 1 || options.blind) break;
    }
    row.searches.push_back(std::move(measurement));
  }

  const std::function<void(const TaskRow&)>& on_row_;
  TaskBench bench_;
};

}  // namespace

std::optional<double> CountReachable(const std::string& domain, const std::string& problem,
                                     const std::string& formula, size_t max_states) {
  const std::unique_ptr<task::Product> product = MakeProduct(domain, problem, formula);
  const auto start = product->Start();
  if (!start) return 0;
  task::Symmetry symmetry(*product);
  std::vector<symbolic::State> images;
  for (const std::vector<int>& members : symmetry.Classes()) {
    for (size_t i = 1; i < members.size(); ++i)
      images.push_back(task::ExchangeObjects(product->task(), *start, members.front(), members[i]));
  }
  // If the images of the start can be reached, so can those of every state that can.
  const bool closed = ReachesAll(*product, images, max_states);
  task::StateGraph graph(*product, {.blind = true, .symmetry = closed});
  while (graph.ExpandBeyondGoals()) {
    if (graph.states() > max_states) return std::nullopt;
  }
  if (!closed) return static_cast<double>(graph.states());
  double count = 0;
  for (size_t i = 0; i < graph.states(); ++i) count += symmetry.OrbitSize(graph.state(static_cast<int>(i)));
  return std::round(count);
}

TaskBench BenchmarkTasks(const TaskBenchOptions& options, const std::function<void(const TaskRow&)>& on_row) {
  return TaskBenchRun(options, on_row).Run();
}

std::string TaskRowText(const TaskRow& row) {
  char line[200];
  std::string text = row.section + ", " + row.name;
  if (row.automaton_states > 0) text += "; automaton " + std::to_string(row.automaton_states) + " states";
  if (row.reachable) {
    FormatInto(line, sizeof line, "; %.0f states reachable", *row.reachable);
    text += line;
  }
  for (const TaskMeasurement& search : row.searches) {
    const std::string cost =
        search.cost ? std::to_string(static_cast<int>(std::lround(*search.cost))) + " actions" : "gave up";
    FormatInto(line, sizeof line, "\n  %-18s %-11s %9llu expanded %10llu generated %10.1f ms",
               search.algorithm.c_str(), cost.c_str(), static_cast<unsigned long long>(search.expanded),
               static_cast<unsigned long long>(search.generated), 1e3 * search.seconds);
    text += line;
  }
  return text;
}

Value WriteTaskBench(const TaskBench& bench) {
  Value rows = Value::Array();
  for (const TaskRow& row : bench.rows) {
    Value searches = Value::Array();
    for (const TaskMeasurement& search : row.searches) {
      Value one = Value::Object();
      one.Set("algorithm", search.algorithm).Set("solved", search.cost.has_value());
      if (search.cost) one.Set("cost", *search.cost);
      one.Set("expanded", search.expanded).Set("generated", search.generated).Set("cpu_s", search.seconds);
      searches.Append(std::move(one));
    }
    Value one = Value::Object();
    one.Set("section", row.section)
        .Set("name", row.name)
        .Set("objects", row.items)
        .Set("regions", row.regions);
    one.Set("poses_per_region", row.poses);
    if (row.automaton_states > 0) one.Set("automaton_states", row.automaton_states);
    if (row.reachable) one.Set("reachable", *row.reachable);
    rows.Append(one.Set("searches", std::move(searches)));
  }
  return OutputHeader("tether.bench/1", 0)
      .Set("name", "task")
      .Set("max_states", static_cast<uint64_t>(bench.options.max_states))
      .Set("rows", std::move(rows));
}

}  // namespace tether::bench
