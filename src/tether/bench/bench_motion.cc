#include "tether/bench/bench_motion.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <utility>

#include "tether/bench/motion_problem.h"
#include "tether/bench/process_time.h"
#include "tether/common/output/output_header.h"
#include "tether/common/random.h"
#include "tether/common/stop.h"
#include "tether/common/text.h"
#include "tether/motion/path_search.h"

namespace tether::bench {
namespace {

using Eigen::VectorXd;

// Paths are verified at steps of at most this in any joint, rad.
constexpr double kVerifiedStep = 1e-3;
// Limits are written with this precision, rad.
constexpr double kLimitTolerance = 1e-6;
// Rates are measured on so many lines of this length (rad) in each scene, …
constexpr int kLines = 12;
constexpr double kLineLength = 1.0;
// … and those of the plain loop on every so many.
constexpr size_t kEveryScene = 10;

/// Whether a problem's joint is the model's: MoveIt's names have the robot's before them.
bool IsJoint(const std::string& in_problem, const std::string& joint) {
  return in_problem == joint || in_problem.ends_with("_" + joint);
}

const JointPosition* FindJoint(const std::vector<JointPosition>& joints, const std::string& name) {
  for (const JointPosition& joint : joints) {
    if (IsJoint(joint.name, name)) return &joint;
  }
  return nullptr;
}

/// The arm's configuration. Joints that are not named are where `rest` has them; those beyond their limits
/// are named in `beyond`.
VectorXd Configuration(const robot::Model& model, const std::vector<JointPosition>& joints,
                       const VectorXd& rest, std::string* beyond) {
  VectorXd q = rest;
  for (int i = 0; i < model.dof(); ++i) {
    const std::string& name = model.joint_names()[i];
    if (const JointPosition* joint = FindJoint(joints, name)) q[i] = joint->position;
    const double over = std::max(model.lower()[i] - q[i], q[i] - model.upper()[i]);
    if (over > kLimitTolerance && beyond->empty())
      *beyond = name + " is at " + Fixed(q[i], 4) + ", " + Fixed(over, 4) + " rad beyond its limit";
  }
  return q;
}

double Opening(const robot::Model& model, const std::vector<JointPosition>& joints) {
  double opening = 0;
  bool any = false;
  const size_t fingers = model.finger_joints().size();
  for (size_t i = 0; i < fingers; ++i) {
    const JointPosition* joint = FindJoint(joints, model.finger_joints()[i]);
    if (joint == nullptr) continue;
    any = true;
    opening += model.gripper().OpeningShare(i, fingers, joint->position);
  }
  return any ? opening : model.gripper().max_opening;
}

/// The first collision of the path by exact distances at small steps; empty if there is none.
std::string Refute(const motion::CollisionScene& scene, const std::vector<VectorXd>& path) {
  for (size_t i = 0; i + 1 < path.size(); ++i) {
    const VectorXd along = path[i + 1] - path[i];
    const int steps = std::max(1, static_cast<int>(std::ceil(along.cwiseAbs().maxCoeff() / kVerifiedStep)));
    for (int k = 0; k <= steps; ++k) {
      if (const auto touch = scene.FindTouch(path[i] + along * (static_cast<double>(k) / steps)))
        return "the path collides: " + touch->Text();
    }
  }
  return "";
}

/// One problem, and its scene where it could be read.
class Runner {
 public:
  Runner(const MotionBenchOptions& options, std::shared_ptr<const robot::Model> model)
      : options_(options), model_(std::move(model)) {}

  MotionMeasurement Run(const MotionProblemFiles& files) {
    row_ = {};
    row_.name = files.name;
    scene_ = nullptr;
    MotionProblem problem;
    try {
      problem = ReadMotionProblem(files);
    } catch (const InputError& error) {
      return End(MotionOutcome::kNotRead, error.what());
    }
    row_.unknown = problem.unknown;
    if (!problem.unknown.empty())
      return End(MotionOutcome::kNotRead, "we have no shape for " + problem.unknown.front());
    motion::Snapshot snapshot;
    snapshot.model = model_;
    snapshot.opening = Opening(*model_, problem.start);
    snapshot.obstacles = problem.obstacles;
    const Stopwatch build;
    scene_ = motion::CollisionScene::Compile(snapshot);
    row_.build_s = build.cpu_s();
    return Plan(problem);
  }
  const std::shared_ptr<const motion::CollisionScene>& scene() const { return scene_; }

 private:
  MotionMeasurement End(MotionOutcome outcome, std::string reason) {
    row_.outcome = outcome;
    row_.reason = std::move(reason);
    return row_;
  }

  MotionMeasurement Plan(const MotionProblem& problem) {
    motion::PathProblem query;
    query.scene = scene_;
    query.lower = model_->lower();
    query.upper = model_->upper();
    query.seed = options_.seed;
    std::string beyond;
    query.start = Configuration(*model_, problem.start, model_->home(), &beyond);
    if (!beyond.empty()) return End(MotionOutcome::kInvalid, "at the start, " + beyond);
    if (const auto touch = scene_->FindTouch(query.start))
      return End(MotionOutcome::kInvalid, "at the start, " + touch->Text());
    std::string why;
    for (const auto& goal : problem.goals) {
      beyond.clear();
      const VectorXd q = Configuration(*model_, goal, query.start, &beyond);
      if (beyond.empty()) {
        if (const auto touch = scene_->FindTouch(q)) beyond = touch->Text();
      }
      if (beyond.empty()) query.goals.push_back(q);
      if (!beyond.empty() && why.empty()) why = "at the goal, " + beyond;
    }
    if (query.goals.empty()) return End(MotionOutcome::kInvalid, why);
    const Stopwatch plan;
    const motion::Path path = motion::FindPath(query);
    row_.plan_s = plan.cpu_s();
    row_.checks = path.checks;
    row_.exact_checks = path.exact_checks;
    if (path.status != motion::PathStatus::kFound) return End(MotionOutcome::kUnsolved, path.reason);
    row_.length_rad = motion::PathLength(path.q);
    const std::string refuted = Refute(*scene_, path.q);
    return End(refuted.empty() ? MotionOutcome::kSolved : MotionOutcome::kCollides, refuted);
  }

  const MotionBenchOptions& options_;
  std::shared_ptr<const robot::Model> model_;
  std::shared_ptr<const motion::CollisionScene> scene_;
  MotionMeasurement row_;
};

/// Adds up checks and their CPU time.
struct Rate {
  double checks = 0, seconds = 0;
  double value() const { return seconds > 0 ? checks / seconds : 0; }
};

/// The same random lines with each way of checking.
class RateMeter {
 public:
  explicit RateMeter(uint64_t seed) : random_(Random(seed).Split("rates")) {}

  void Measure(const std::shared_ptr<const motion::CollisionScene>& scene, bool geometry_too) {
    const std::vector<std::pair<VectorXd, VectorXd>> lines = Lines(scene->model());
    for (const auto& [lanes, rate] :
         {std::pair{motion::Lanes::kBest, &simd_}, std::pair{motion::Lanes::kPlain, &plain_}}) {
      motion::PathChecker checker(scene, lanes);
      for (const auto& [a, b] : lines) checker.IsFree(a, b);  // warms the caches
      const auto before = checker.checks();
      const Stopwatch time;
      for (const auto& [a, b] : lines) checker.IsFree(a, b);
      rate->seconds += time.cpu_s();
      rate->checks += static_cast<double>(checker.checks() - before);
    }
    if (!geometry_too) return;
    const Stopwatch time;
    for (const auto& [a, b] : lines) {
      for (int i = 0; i <= 16; ++i) {
        geometry_.checks += 1;
        if (scene->FindTouch(a + (b - a) * (i / 16.0))) break;
      }
    }
    geometry_.seconds += time.cpu_s();
  }
  CheckRates rates() const { return {simd_.value(), plain_.value(), geometry_.value()}; }

 private:
  std::vector<std::pair<VectorXd, VectorXd>> Lines(const robot::Model& model) {
    std::vector<std::pair<VectorXd, VectorXd>> lines;
    for (int i = 0; i < kLines; ++i) {
      VectorXd a(model.dof()), b(model.dof());
      for (int j = 0; j < model.dof(); ++j) {
        a[j] = random_.Uniform(model.lower()[j], model.upper()[j]);
        b[j] = random_.Uniform(model.lower()[j], model.upper()[j]);
      }
      b = a + (b - a).normalized() * kLineLength;
      lines.emplace_back(a, b);
    }
    return lines;
  }

  Random random_;
  Rate simd_, plain_, geometry_;
};

struct Quantiles {
  double median = 0, p95 = 0, max = 0;
};

Quantiles QuantilesOf(const std::vector<double>& values) {
  return {Quantile(values, 0.5), Quantile(values, 0.95), Quantile(values, 1)};
}

struct Totals {
  int invalid = 0, not_read = 0, solved = 0, collisions = 0;
  Quantiles plan, build;
  std::map<std::string, int> unknown;
};

Totals Sum(const MotionBench& bench) {
  Totals totals;
  std::vector<double> plan, build;
  for (const MotionMeasurement& row : bench.rows) {
    totals.invalid += row.outcome == MotionOutcome::kInvalid;
    totals.not_read += row.outcome == MotionOutcome::kNotRead;
    totals.collisions += row.outcome == MotionOutcome::kCollides;
    const bool found = row.outcome == MotionOutcome::kSolved || row.outcome == MotionOutcome::kCollides;
    totals.solved += found;
    for (const std::string& shape : row.unknown) ++totals.unknown[shape.substr(0, shape.find(" ("))];
    if (row.outcome != MotionOutcome::kNotRead) build.push_back(row.build_s);
    if (found || row.outcome == MotionOutcome::kUnsolved) plan.push_back(row.plan_s);
  }
  totals.plan = QuantilesOf(plan);
  totals.build = QuantilesOf(build);
  return totals;
}

Value WriteQuantiles(const Quantiles& quantiles) {
  return Value::Object().Set("median", quantiles.median).Set("p95", quantiles.p95).Set("max", quantiles.max);
}

const char* Name(MotionOutcome outcome) {
  switch (outcome) {
    case MotionOutcome::kSolved:
      return "solved";
    case MotionOutcome::kInvalid:
      return "invalid";
    case MotionOutcome::kNotRead:
      return "not read";
    case MotionOutcome::kUnsolved:
      return "unsolved";
    case MotionOutcome::kCollides:
      return "collides";
  }
  return "";
}

}  // namespace

MotionBench BenchmarkMotion(const MotionBenchOptions& options,
                            const std::function<void(const MotionMeasurement&)>& on_row) {
  MotionBench bench;
  bench.options = options;
  Runner runner(options, robot::Model::Load(options.robot));
  RateMeter meter(options.seed);
  const std::vector<MotionProblemFiles> problems = FindMotionProblems(options.problems);
  for (size_t i = 0; i < problems.size(); ++i) {
    if (IsStopped(options.stop)) {
      bench.interrupted = true;
      break;
    }
    bench.rows.push_back(runner.Run(problems[i]));
    on_row(bench.rows.back());
    if (runner.scene() != nullptr) meter.Measure(runner.scene(), i % kEveryScene == 0);
  }
  bench.rates = meter.rates();
  return bench;
}

int MotionBench::collisions() const { return Sum(*this).collisions; }

std::string MotionBenchText(const MotionBench& bench) {
  const Totals totals = Sum(bench);
  const auto ms = [](const Quantiles& q) {
    return Fixed(1e3 * q.median, 3) + " ms, 95 % " + Fixed(1e3 * q.p95, 3) + " ms, most " +
           Fixed(1e3 * q.max, 1) + " ms";
  };
  const auto million = [](double rate) { return Fixed(1e-6 * rate, 3) + " M/s"; };
  std::string text = std::to_string(bench.rows.size()) + " problems, " + std::to_string(totals.invalid) +
                     " invalid, " + std::to_string(totals.not_read) + " not read, " +
                     std::to_string(totals.solved) + " solved, " + std::to_string(totals.collisions) +
                     " of these collide\n";
  for (const auto& [shape, count] : totals.unknown)
    text += "no shape for " + shape + ": " + std::to_string(count) + "\n";
  text += "plan:  median " + ms(totals.plan) + "\nbuild: median " + ms(totals.build) +
          "\nconfigurations: " + million(bench.rates.simd) + " with SIMD, " + million(bench.rates.plain) +
          " without, " + million(bench.rates.geometry) + " by distances alone";
  return text;
}

Value WriteMotionBench(const MotionBench& bench) {
  const Totals totals = Sum(bench);
  Value failures = Value::Array(), rows = Value::Array(), unknown = Value::Object();
  for (const MotionMeasurement& row : bench.rows) {
    if (row.outcome != MotionOutcome::kSolved) {
      failures.Append(
          Value::Object().Set("name", row.name).Set("outcome", Name(row.outcome)).Set("reason", row.reason));
      if (row.outcome != MotionOutcome::kCollides && row.outcome != MotionOutcome::kUnsolved) continue;
    }
    rows.Append(Value::Object()
                    .Set("name", row.name)
                    .Set("plan_s", row.plan_s)
                    .Set("build_s", row.build_s)
                    .Set("checks", row.checks)
                    .Set("exact_checks", row.exact_checks)
                    .Set("length_rad", row.length_rad));
  }
  for (const auto& [shape, count] : totals.unknown) unknown.Set(shape, count);
  return OutputHeader("tether.bench/1", bench.options.seed)
      .Set("name", "motion")
      .Set("robot", bench.options.robot)
      .Set("problems", static_cast<int>(bench.rows.size()))
      .Set("invalid", totals.invalid)
      .Set("not_read", totals.not_read)
      .Set("unknown_shapes", unknown)
      .Set("solved", totals.solved)
      .Set("collisions", totals.collisions)
      .Set("plan_s", WriteQuantiles(totals.plan))
      .Set("build_s", WriteQuantiles(totals.build))
      .Set("checks_per_s", Value::Object()
                               .Set("simd", bench.rates.simd)
                               .Set("plain", bench.rates.plain)
                               .Set("geometry", bench.rates.geometry))
      .Set("failures", failures)
      .Set("rows", rows);
}

}  // namespace tether::bench
