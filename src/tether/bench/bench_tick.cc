#include "tether/bench/bench_tick.h"

#include <algorithm>
#include <chrono>
#include <cmath>

#include <Eigen/Cholesky>

#include "tether/bench/process_time.h"
#include "tether/common/random.h"
#include "tether/constraints/core/field_function.h"
#include "tether/control/constrained_velocity.h"
#include "tether/control/objective.h"
#include "tether/control/torque/constrained_torque.h"

namespace tether::bench {
namespace {

using Clock = std::chrono::steady_clock;
using Eigen::Vector3d;
using math::Pose;

constexpr double kPeriod = 0.005;
constexpr double kTorquePeriod = 0.001;
// Ticks between new goals.
constexpr int kTicksPerGoal = 400;
constexpr double kSafe = 0.01;
constexpr double kLimit = 1e-3;  // s

/// The scene of a tick.
struct TickScene {
  std::vector<control::Solid> solids;
  std::vector<control::MovingPose> poses;
  std::vector<control::ClearanceConstraint> clearances;
  std::vector<control::FieldConstraint> fields;
  int held = 0;

  explicit TickScene(const robot::Model& model) {
    const auto add = [&](const char* name, const Vector3d& size, bool movable, const Vector3d& p_WO) {
      solids.push_back({name, geometry::Primitive(geometry::Box{size}), movable});
      poses.push_back({Pose(p_WO)});
    };
    add("table", {1.4, 1.8, 0.04}, false, {0, 0, -0.02});
    add("wall_left", {1.4, 0.04, 1.2}, false, {0, 0.85, 0.6});
    add("wall_front", {0.04, 1.8, 1.2}, false, {-0.65, 0, 0.6});
    add("a", {0.06, 0.04, 0.10}, true, {0.49, 0.12, 0.05});
    add("b", {0.06, 0.04, 0.10}, true, {0.40, -0.30, 0.05});
    add("c", {0.04, 0.06, 0.12}, true, {0.23, 0.44, 0.06});
    held = static_cast<int>(solids.size());
    add("held", {0.06, 0.03, 0.12}, true, {0, 0, 0});
    control::ClearanceConstraint clearance{"clearance", {}, true, {}, kSafe, 0};
    for (int body = 0; body <= model.solids().hand(); ++body) clearance.of.push_back(body);
    for (int i = 0; i < static_cast<int>(solids.size()); ++i) clearance.to.push_back(i);
    clearances = {clearance};
    fields = {{"outside",
               constraints::MakeAxisDistance(Vector3d::Zero(), Vector3d::UnitZ(), Vector3d::Zero(), 0.15, -1),
               {},
               {}},
              {"tilt", constraints::MakeAngle(Vector3d::UnitZ(), -Vector3d::UnitZ(), 0.35), {}, {}, 1}};
  }

  /// One of the things goes to and fro.
  void Move(double time) {
    control::MovingPose& moving = poses[5];
    const double phase = 0.3 * time;
    moving.X.p = Vector3d(0.23 + 0.1 * std::sin(phase), 0.44, 0.06);
    moving.V.head<3>() = Vector3d(0.03 * std::cos(phase), 0, 0);
  }
};

/// A new place for the hand, or one for the foot of what it holds on a region, whose field is returned.
std::vector<control::FieldConstraint> DrawGoal(const TickScene& scene, const Pose& X_WH, BenchRegion form,
                                               bool of_hand, Random& random, control::Goal& goal,
                                               TickBench& bench) {
  const double angle = random.Uniform(-1.5, 1.5), radius = random.Uniform(0.3, 0.6);
  const Vector3d p(radius * std::cos(angle), radius * std::sin(angle), 0);
  goal = control::Goal{};
  if (of_hand) {
    const Pose X_WGoal(X_WH.R, p + Vector3d(0, 0, random.Uniform(0.2, 0.45)));
    goal.functions = control::MakeObjective(control::Objective::kPosition, X_WGoal);
    return {};
  }
  // The foot of the held object onto a region, as HOLD does.
  goal.target.X_OF = Pose(p);
  goal.frame = {scene.held, Pose(Vector3d(0, 0, -0.06))};
  goal.functions = control::MakeObjective(control::Objective::kDistance, Pose(Vector3d(0, 0, 0.015)));
  const Pose X_WF = scene.poses[scene.held].X * goal.frame.X_OF;
  Vector3d start = X_WF.p - p;
  start.z() = std::max(0.02, start.z());
  const auto function = form == BenchRegion::kDisc
                            ? constraints::MakePointCone(0.02, start, Vector3d::Zero())
                            : constraints::MakeFrustum({0.04, 0.04}, start, Vector3d::Zero());
  bench.region_rows = function->size();
  return {{"cone", function, goal.target, goal.frame, 0}};
}

void TakeTimes(std::vector<double> times, std::vector<double> clock, int cpu_slow, TickBench& bench) {
  const int ticks = std::max(1, bench.ticks);
  const auto slow = std::count_if(clock.begin(), clock.end(), [](double t) { return t > kLimit; });
  bench.over_1ms = static_cast<double>(slow) / ticks;
  bench.cpu_over_1ms = static_cast<double>(cpu_slow) / ticks;
  bench.max = *std::max_element(clock.begin(), clock.end());
  bench.median = Quantile(times, 0.5);
  bench.p99 = Quantile(times, 0.99);
  bench.p9999 = Quantile(times, 0.9999);
}

}  // namespace

TickBench BenchmarkTicks(const std::string& robot, BenchRegion form, int ticks, uint64_t seed) {
  const auto model = robot::Model::Load(robot);
  TickScene scene(*model);
  control::VelocityOptions options;
  options.joint_margin = 0.05;
  control::ConstrainedVelocity controller(model, Pose(), scene.solids, scene.clearances, scene.fields,
                                          options);
  controller.Hold(scene.held);
  Random random(seed);
  Eigen::VectorXd q = model->home();
  robot::Kinematics kinematics(model);
  const Pose X_HO(math::RotationFromRpy({M_PI, 0, 0}), {0, 0, 0.03});
  TickBench bench;
  bench.robot = robot;
  bench.ticks = ticks;
  control::Goal goal;
  std::vector<double> times;
  times.reserve(ticks);
  double rows = 0;
  int cpu_slow = 0;
  for (int tick = 0; tick < ticks; ++tick) {
    kinematics.Set(q);
    scene.poses[scene.held].X = kinematics.X_BH() * X_HO;
    if (tick % kTicksPerGoal == 0) {
      controller.SetExtraFields(
          DrawGoal(scene, kinematics.X_BH(), form, tick / kTicksPerGoal % 2 == 0, random, goal, bench));
    }
    scene.Move(kPeriod * tick);
    const Stopwatch own;
    const Clock::time_point before = Clock::now();
    const Eigen::VectorXd& v = controller.Compute({q, 0.03, scene.poses}, &goal);
    times.push_back(std::chrono::duration<double>(Clock::now() - before).count());
    const double cpu_s = own.cpu_s();
    bench.cpu_max = std::max(bench.cpu_max, cpu_s);
    cpu_slow += cpu_s > kLimit ? 1 : 0;
    q += kPeriod * v;
    rows += controller.num_rows();
    bench.max_rows = std::max(bench.max_rows, controller.num_rows());
    bench.relaxed += controller.flags().relaxed ? 1 : 0;
    bench.faults += controller.flags().fault ? 1 : 0;
    for (int i = 0; i < controller.num_rows(); ++i) {
      if (controller.row(i).a >= 0)
        bench.worst_m = std::max(bench.worst_m, -controller.row(i).value - options.buffer);
    }
  }
  bench.mean_rows = rows / std::max(1, ticks);
  TakeTimes(times, times, cpu_slow, bench);
  return bench;
}

TickBench BenchmarkTorqueTicks(const std::string& robot, BenchRegion form, int ticks, uint64_t seed,
                               const TickHooks& hooks) {
  const auto model = robot::Model::Load(robot);
  TickScene scene(*model);
  control::TorqueOptions options;
  options.joint_margin = 0.05;
  options.period = kTorquePeriod;
  control::ConstrainedTorque controller(model, Pose(), scene.solids, scene.clearances, scene.fields, options);
  controller.Hold(scene.held);
  Random random(seed);
  Eigen::VectorXd q = model->home(), v = Eigen::VectorXd::Zero(model->dof());
  const Eigen::VectorXd external = Eigen::VectorXd::Zero(model->dof());
  robot::State state(model);
  const Pose X_HO(math::RotationFromRpy({M_PI, 0, 0}), {0, 0, 0.03});
  TickBench bench;
  bench.robot = robot;
  bench.ticks = ticks;
  control::Goal goal;
  std::vector<double> times, clock;
  double rows = 0, qp_rows = 0;
  int cpu_slow = 0;
  for (int tick = 0; tick < ticks; ++tick) {
    state.Set(q, v);
    control::MovingPose& held = scene.poses[scene.held];
    held.X = state.X_BH() * X_HO;
    if (tick % (5 * kTicksPerGoal) == 0) {
      controller.SetExtraFields(
          DrawGoal(scene, state.X_BH(), form, tick / (5 * kTicksPerGoal) % 2 == 0, random, goal, bench));
    }
    scene.Move(kTorquePeriod * tick);
    if (hooks.begin) hooks.begin();
    const Stopwatch own;
    state.Set(q, v);
    const Eigen::VectorXd& torque =
        controller.Compute({state, 0.03, scene.poses, &external}, {nullptr, &goal, &model->home()});
    times.push_back(own.cpu_s());
    clock.push_back(own.wall_s());
    if (hooks.end) hooks.end();
    bench.cpu_max = std::max(bench.cpu_max, times.back());
    cpu_slow += times.back() > kLimit ? 1 : 0;
    v += kTorquePeriod * state.M().llt().solve(torque - state.bias());
    q += kTorquePeriod * v;
    rows += controller.num_rows();
    qp_rows += controller.num_qp_rows();
    bench.max_rows = std::max(bench.max_rows, controller.num_rows());
    bench.max_iterations = std::max(bench.max_iterations, controller.flags().iterations);
    bench.relaxed += controller.flags().relaxed ? 1 : 0;
    bench.conflicts += controller.flags().conflict ? 1 : 0;
    bench.faults += controller.flags().fault || controller.flags().braking ? 1 : 0;
    for (int i = 0; i < controller.num_rows(); ++i) {
      if (controller.row(i).a >= 0)
        bench.worst_m = std::max(bench.worst_m, -controller.row(i).value - options.buffer);
    }
  }
  bench.mean_rows = rows / std::max(1, ticks);
  bench.mean_qp_rows = qp_rows / std::max(1, ticks);
  TakeTimes(times, clock, cpu_slow, bench);
  return bench;
}

Value WriteTickBench(const TickBench& bench) {
  return Value::Object()
      .Set("median", bench.median)
      .Set("p99", bench.p99)
      .Set("p9999", bench.p9999)
      .Set("max", bench.max)
      .Set("over_1ms", bench.over_1ms)
      .Set("cpu_over_1ms", bench.cpu_over_1ms)
      .Set("cpu_max", bench.cpu_max)
      .Set("ticks", bench.ticks)
      .Set("mean_rows", bench.mean_rows)
      .Set("max_rows", bench.max_rows)
      .Set("relaxed", bench.relaxed)
      .Set("faults", bench.faults)
      .Set("worst_m", bench.worst_m)
      .Set("region_rows", bench.region_rows)
      .Set("mean_qp_rows", bench.mean_qp_rows)
      .Set("max_iterations", bench.max_iterations)
      .Set("conflicts", bench.conflicts);
}

}  // namespace tether::bench
