#include "tether/bench/campaigns/campaign_scene.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <numbers>
#include <vector>

#include "tether/bench/process_time.h"
#include "tether/common/random.h"
#include "tether/common/stop.h"
#include "tether/geometry/distance/distance.h"
#include "tether/planning/plan/candidate.h"
#include "tether/planning/program/program_builder.h"
#include "tether/scenario/generators/generate.h"
#include "tether/scenario/problem.h"
#include "tether/scene/resting_contact.h"

namespace tether::bench {
namespace {

constexpr double kIpoptLimit = 10;  // s per solve
constexpr double kLeastTime = 0.1;  // s: shorter times are measured again
constexpr int kMostRepetitions = 9;
constexpr int kWarmRepetitions = 3;
constexpr double kFarthestMove = 0.05, kMoveGap = 0.01;  // m
constexpr int kMoveDraws = 1000;

/// A generated scene, ready for planning.
struct Prepared {
  scenario::Scenario scenario;
  std::shared_ptr<const symbolic::Task> task;
  planning::Problem problem;

  explicit Prepared(const CampaignScene& scene, const SceneMeasurementOptions& options)
      : scenario(scenario::LoadGenerated(scenario::Generate(scene.kind, {scene.blocks, 0, 0}, scene.seed))),
        task(scenario::MakeTask(scenario)) {
    scenario::PlanningOverrides overrides;
    overrides.solver = "native";
    overrides.threads = 1;
    overrides.no_robot = true;
    overrides.stop = options.stop;
    problem = scenario::MakeProblem(scenario, scenario.scene, overrides);
  }
};

struct Planned {
  planning::PlanReport report;
  double cpu_s = 0;

  bool interrupted() const { return report.status == planning::PlanStatus::kInterrupted; }
};

Planned PlanIt(const planning::Problem& problem, const symbolic::Task& task) {
  Planned planned;
  const Stopwatch clock;
  planned.report = planning::PlanTask(problem, task);
  planned.cpu_s = clock.cpu_s();
  return planned;
}

/// Why there is no plan: the reason of each candidate.
std::string Reasons(const planning::PlanReport& report) {
  std::string text;
  for (const planning::CandidateReport& candidate : report.candidates) {
    if (candidate.feasible()) continue;
    for (const std::string& action : candidate.plan.actions) text += action + " ";
    text += "(" + planning::ToString(candidate.status) + "): " + candidate.reason + "; ";
  }
  return text.empty() ? report.message : text.substr(0, text.size() - 2);
}

Value BeginRecord(const CampaignScene& scene, const Planned& planned) {
  Value record = Value::Object();
  record.Set("kind", scene.kind).Set("seed", scene.seed);
  if (scene.blocks > 0) record.Set("blocks", scene.blocks);
  record.Set("status", planning::ToString(planned.report.status)).Set("plan_cpu_s", planned.cpu_s);
  record.Set("candidates", static_cast<int>(planned.report.candidates.size()));
  const auto feasible = std::count_if(planned.report.candidates.begin(), planned.report.candidates.end(),
                                      [](const auto& candidate) { return candidate.feasible(); });
  record.Set("feasible", static_cast<int>(feasible));
  if (const planning::CandidateReport* best = planned.report.best()) {
    record.Set("cost", best->plan.cost);
  } else {
    record.Set("reason", Reasons(planned.report));
  }
  return record;
}

/// A plan from a random start, as the independent checker judges it.
struct RestartResult {
  bool feasible = false;
  double cost = std::numeric_limits<double>::infinity();
};

/// Every discrete choice is the planner's first with probability ½, else any; a choice may lead to further
/// ones.
planning::Variant DrawVariant(const planning::SceneFacts& facts,
                              const std::vector<planning::BoundStep>& steps, Random& random) {
  planning::Variant variant;
  for (int round = 0; round < 2; ++round) {
    for (const planning::ChoicePoint& choice : planning::BuildProgram(facts, steps, variant).choices) {
      if (variant.contains(choice.key)) continue;
      const int any = random.Index(static_cast<int>(choice.options.size()));
      variant[choice.key] = random.Index(2) == 0 ? 0 : any;
    }
  }
  return variant;
}

/// One random start of one candidate: random choices, a displaced guess, with or without room to spare.
RestartResult Restart(const planning::SceneFacts& facts, const std::vector<std::string>& actions,
                      Random random) {
  const planning::Problem& problem = facts.problem();
  const std::vector<planning::BoundStep> steps = planning::BindSkeleton(problem, actions);
  const planning::Variant variant = DrawVariant(facts, steps, random);
  planning::ProgramStart start;
  start.noise = random.Uniform(0.2, 1.5);
  start.tight = random.Index(2) == 0;
  start.random = random.Split("guess");
  const planning::KeyPoseProgram key_poses = planning::BuildProgram(facts, steps, variant, start);
  RestartResult outcome;
  if (!key_poses.refutations.empty()) return outcome;
  nlp::Options options = problem.program.solver;
  options.stop = problem.search.stop;
  const nlp::Result result =
      nlp::MakeSolver(nlp::Backend::kNative)->Solve(key_poses.program, key_poses.guess, options);
  if (static_cast<int>(result.x.poses.size()) != key_poses.program.num_poses()) return outcome;
  const planning::CheckResult check = planning::CheckKeyPoses(facts, steps, result.x.poses);
  // It is judged like the planner's own results.
  outcome.feasible = check.Feasible(problem.program) && planning::KeepsRows(result);
  if (outcome.feasible) outcome.cost = check.cost;
  return outcome;
}

/// Restart `index` of the whole scene: one random start of every candidate; the best counts.
RestartResult RestartAll(const planning::SceneFacts& facts, const planning::PlanReport& report, int index) {
  RestartResult best;
  for (const planning::CandidateReport& candidate : report.candidates) {
    std::string name = "restart " + std::to_string(index);
    for (const std::string& action : candidate.plan.actions) name += " " + action;
    const RestartResult one =
        Restart(facts, candidate.plan.actions, Random(facts.problem().search.seed).Split(name));
    if (one.feasible && one.cost < best.cost) best = one;
  }
  return best;
}

struct MovedScene {
  scene::Scene scene;
  std::string object;
  double distance = 0;  ///< m
};

/// Moves one movable object, by up to 5 cm, to where it has the same support and is clear of all others.
std::optional<MovedScene> MoveOneObject(const scene::Scene& scene, Random random) {
  std::vector<size_t> movable;
  for (size_t i = 0; i < scene.objects.size(); ++i) {
    if (scene.objects[i].movable()) movable.push_back(i);
  }
  const auto X_WO = scene::InitialPoses(scene);
  for (int draw = 0; draw < kMoveDraws && !movable.empty(); ++draw) {
    const size_t index = movable[random.Index(static_cast<int>(movable.size()))];
    const scene::Object& object = scene.objects[index];
    const double distance = kFarthestMove * std::sqrt(random.Uniform(0, 1));
    const double direction = random.Uniform(0, 2 * std::numbers::pi);
    math::Pose X = X_WO.at(object.name);
    X.p += distance * Eigen::Vector3d(std::cos(direction), std::sin(direction), 0);
    const scene::Object* support = scene::FindSupport(scene, X_WO, object);
    const bool fits =
        support != nullptr && std::all_of(scene.objects.begin(), scene.objects.end(), [&](const auto& other) {
          if (&other == &object) return true;
          if (&other == support) return scene::FindResting(object, X, other, X_WO.at(other.name)).Holds(1e-3);
          return geometry::SignedDistance(object.shape, X, other.shape, X_WO.at(other.name)).distance >
                 kMoveGap;
        });
    if (!fits) continue;
    MovedScene moved{scene, object.name, distance};
    moved.scene.objects[index].X_ParentObject = math::Between(scene.InitialPose(object.parent), X);
    return moved;
  }
  return std::nullopt;
}

}  // namespace

std::string TextOf(const Value& record, const char* key) {
  const Value* value = record.Find(key);
  return value == nullptr ? "" : value->AsText();
}

std::string CampaignScene::Label() const {
  return kind + (blocks > 0 ? " of " + std::to_string(blocks) + " blocks" : "") + ", seed " +
         std::to_string(seed);
}

std::optional<Value> MeasureRobustness(const CampaignScene& scene, const SceneMeasurementOptions& options) {
  const Prepared prepared(scene, options);
  const Planned planned = PlanIt(prepared.problem, *prepared.task);
  if (planned.interrupted()) return std::nullopt;
  Value record = BeginRecord(scene, planned);
  bool solvable = planned.report.ok();
  if (!planned.report.ok()) {
    const planning::SceneFacts facts(prepared.problem);
    int solved_at = 0;
    for (int i = 1; i <= options.restarts && solved_at == 0; ++i) {
      if (RestartAll(facts, planned.report, i).feasible) solved_at = i;
      if (IsStopped(options.stop)) return std::nullopt;
    }
    record.Set("restart_solved_at", solved_at);
    solvable = solved_at > 0;
  }
  if (options.ipopt) {
    planning::Problem problem = prepared.problem;
    problem.program.backend = nlp::Backend::kIpopt;
    problem.program.solver.time_limit_s = kIpoptLimit;
    const Planned ipopt = PlanIt(problem, *prepared.task);
    if (ipopt.interrupted()) return std::nullopt;
    solvable = solvable || ipopt.report.ok();
    Value value = Value::Object();
    value.Set("status", planning::ToString(ipopt.report.status)).Set("plan_cpu_s", ipopt.cpu_s);
    if (const planning::CandidateReport* best = ipopt.report.best()) value.Set("cost", best->plan.cost);
    record.Set("ipopt", value);
  }
  return record.Set("solvable", solvable);
}

std::optional<Value> MeasureQuality(const CampaignScene& scene, const SceneMeasurementOptions& options) {
  const Prepared prepared(scene, options);
  const Planned planned = PlanIt(prepared.problem, *prepared.task);
  if (planned.interrupted()) return std::nullopt;
  Value record = BeginRecord(scene, planned);
  const planning::SceneFacts facts(prepared.problem);
  RestartResult best;
  int feasible = 0, best_at = 0;
  for (int i = 1; i <= options.restarts; ++i) {
    const RestartResult one = RestartAll(facts, planned.report, i);
    if (IsStopped(options.stop)) return std::nullopt;
    feasible += one.feasible ? 1 : 0;
    if (one.cost < best.cost) {
      best = one;
      best_at = i;
    }
  }
  record.Set("restarts_feasible", feasible);
  if (best.feasible) record.Set("restart_cost", best.cost).Set("restart_best_at", best_at);
  return record;
}

std::optional<Value> MeasureGrowth(const CampaignScene& scene, const SceneMeasurementOptions& options) {
  const Prepared prepared(scene, options);
  const auto repeat = [&](const auto& once) -> std::optional<double> {
    std::vector<double> times;
    double total = 0;
    do {
      const std::optional<double> cpu_s = once();
      if (!cpu_s || IsStopped(options.stop)) return std::nullopt;
      times.push_back(*cpu_s);
      total += *cpu_s;
    } while (total < kLeastTime && times.size() < kMostRepetitions);
    return Quantile(std::move(times), 0.5);
  };
  Planned planned;
  const auto plan_cpu_s = repeat([&]() -> std::optional<double> {
    planned = PlanIt(prepared.problem, *prepared.task);
    if (planned.interrupted()) return std::nullopt;
    return std::max(0.0, planned.cpu_s - planned.report.search_s);
  });
  if (!plan_cpu_s) return std::nullopt;
  Value record = BeginRecord(scene, planned);
  if (planned.report.candidates.empty()) return record;

  size_t steps = 0;
  nlp::Result result;
  bool feasible = false;
  const auto solve_cpu_s = repeat([&]() -> std::optional<double> {
    const Stopwatch clock;
    const planning::SceneFacts facts(prepared.problem);
    const std::vector<std::string>& actions = planned.report.candidates.front().plan.actions;
    const std::vector<planning::BoundStep> bound = planning::BindSkeleton(prepared.problem, actions);
    steps = bound.size();
    const planning::KeyPoseProgram key_poses = planning::BuildProgram(facts, bound);
    nlp::Options solver_options = prepared.problem.program.solver;
    solver_options.stop = options.stop;
    result =
        nlp::MakeSolver(nlp::Backend::kNative)->Solve(key_poses.program, key_poses.guess, solver_options);
    if (result.status == nlp::Status::kInterrupted) return std::nullopt;
    feasible = planning::CheckKeyPoses(facts, bound, result.x.poses).Feasible(prepared.problem.program);
    return clock.cpu_s();
  });
  if (!solve_cpu_s) return std::nullopt;
  const auto live =
      std::count_if(prepared.scenario.scene.objects.begin(), prepared.scenario.scene.objects.end(),
                    [](const scene::Object& object) { return object.movable(); });
  record.Set("steps", static_cast<int>(steps)).Set("live_objects", static_cast<int>(live));
  record.Set("optimize_cpu_s", *plan_cpu_s);
  return record.Set("first_solve", Value::Object()
                                       .Set("feasible", feasible)
                                       .Set("iterations", result.iterations)
                                       .Set("cpu_s", *solve_cpu_s));
}

std::optional<Value> MeasureWarmStart(const CampaignScene& scene, const SceneMeasurementOptions& options) {
  const Prepared prepared(scene, options);
  const Planned planned = PlanIt(prepared.problem, *prepared.task);
  if (planned.interrupted()) return std::nullopt;
  Value record = BeginRecord(scene, planned);
  const planning::CandidateReport* best = planned.report.best();
  if (best == nullptr) return record;
  const auto optimize = [&](const planning::Problem& problem) {
    return planning::OptimizeCandidate(planning::SceneFacts(problem), best->plan.actions, 0,
                                       planning::Limits(problem.search));
  };
  const planning::Verdict before = optimize(prepared.problem);
  if (IsStopped(options.stop)) return std::nullopt;
  const auto moved = MoveOneObject(prepared.problem.scene, Random(scene.seed).Split("move"));
  if (!moved || before.optimum == nullptr) return record.Set("moved", "no object has room to be moved");
  planning::Problem problem = prepared.problem;
  problem.scene = moved->scene;
  const auto measure = [&](bool warm) {
    std::vector<double> times;
    planning::CandidateReport report;
    for (int i = 0; i < kWarmRepetitions; ++i) {
      planning::Optimum optimum = *before.optimum;
      const Stopwatch clock;
      report = warm ? planning::Reoptimize(planning::SceneFacts(problem), planning::Limits(problem.search),
                                           optimum)
                    : optimize(problem).report;
      times.push_back(clock.cpu_s());
    }
    return Value::Object()
        .Set("feasible", report.feasible())
        .Set("cost", report.plan.cost)
        .Set("evaluations", report.evaluations)
        .Set("cpu_s", *std::min_element(times.begin(), times.end()));
  };
  record.Set("moved", moved->object).Set("moved_by_m", moved->distance);
  record.Set("cold", measure(false)).Set("warm", measure(true));
  if (IsStopped(options.stop)) return std::nullopt;
  return record;
}

}  // namespace tether::bench
