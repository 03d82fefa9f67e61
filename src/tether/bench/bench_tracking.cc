#include "tether/bench/bench_tracking.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "tether/control/operational_space.h"
#include "tether/control/torque/torque_limiter.h"
#include "tether/execution/servo/torque_servo.h"
#include "tether/sim/world.h"

namespace tether::bench {
namespace {

using Eigen::Vector3d;

constexpr double kPeriod = 0.001;                             // s
constexpr double kRadius = 0.1, kSpeed = 0.2;                 // m, m/s
constexpr double kRate = kSpeed / kRadius;                    // rad/s
constexpr double kBefore = 2 * 2 * std::numbers::pi / kRate;  // s

scene::Scene ArmAlone(const char* robot) {
  scene::Scene scene;
  const auto model = robot::Model::Load(robot);
  const Eigen::VectorXd& home = model->home();
  scene::Robot& arm = scene.robots.emplace_back();
  arm.name = "arm";
  arm.model = robot;
  arm.q.assign(home.data(), home.data() + home.size());
  return scene;
}

/// `compute` says the torques for a state, its external torques and a target.
template <typename Compute>
TrackingFigures Track(const scene::Scene& scene, std::shared_ptr<const robot::Model> model, double seconds,
                      const Compute& compute) {
  sim::World world(scene, {{"arm", model}});
  robot::State state(model);
  robot::Observations seen = world.Observe();
  state.Set(seen["arm"].q, seen["arm"].v);
  const math::Pose start = state.X_BH();
  robot::Commands commands;
  commands["arm"].gripper.opening = model->gripper().max_opening;
  TrackingFigures figures;
  int counted = 0;
  for (int i = 0; kPeriod * i < kBefore + seconds; ++i) {
    world.Observe(&seen);
    const robot::Observation& now = seen["arm"];
    state.Set(now.q, now.v);
    // The speed rises in the first turn.
    const double t = kPeriod * i, rise = 2 * std::numbers::pi / kRate;
    const double share = std::min(1.0, t / rise);
    const double angle = kRate * (t < rise ? 0.5 * t * share : t - 0.5 * rise);
    const double rate = kRate * share, c = std::cos(angle), s = std::sin(angle);
    control::HandTarget target;
    target.X_BH.R = start.R;
    target.X_BH.p = start.p + kRadius * Vector3d(0, s, c - 1);
    target.V_BH.head<3>() = kRadius * rate * Vector3d(0, c, -s);
    target.A_BH.head<3>() = -kRadius * rate * rate * Vector3d(0, s, c);
    if (t < rise) target.A_BH.head<3>() += kRadius * kRate / rise * Vector3d(0, c, -s);
    commands["arm"].torque = compute(state, now, target);
    if (t > kBefore) {
      const double error = (state.X_BH().p - target.X_BH.p).norm();
      figures.error += error;
      figures.worst = std::max(figures.worst, error);
      figures.work += kPeriod * std::abs(commands["arm"].torque.dot(now.v));
      ++counted;
    }
    world.Apply(commands, kPeriod);
  }
  figures.error /= std::max(1, counted);
  return figures;
}

Value WriteFigures(const TrackingFigures& figures) {
  return Value::Object()
      .Set("error_m", figures.error)
      .Set("worst_m", figures.worst)
      .Set("work_j", figures.work);
}

}  // namespace

TrackingBench BenchmarkTracking(const char* robot, double seconds) {
  const scene::Scene scene = ArmAlone(robot);
  const auto model = robot::Model::Load(robot);
  TrackingBench bench;
  {
    control::OperationalSpaceController controller(model, {}, model->home());
    control::TorqueLimiter limiter(model, {.period = kPeriod});
    bench.operational_space =
        Track(scene, model, seconds,
              [&](const robot::State& state, const robot::Observation&, const control::HandTarget& target) {
                return limiter.Limit(state, controller.Compute(state, target));
              });
  }
  execution::TorqueServoOptions options;
  options.controller.period = kPeriod;
  execution::TorqueServo servo(scene, "arm", model, options);
  const IndexedVector<ObjectId, control::MovingPose> objects;
  bench.constrained = Track(
      scene, model, seconds,
      [&](const robot::State& state, const robot::Observation& seen, const control::HandTarget& target) {
        const Eigen::VectorXd& torque = servo.Compute({state,
                                                       seen.gripper_opening,
                                                       objects,
                                                       seen.tau_external,
                                                       target,
                                                       model->home(),
                                                       {},
                                                       {},
                                                       options.max_force});
        bench.active_rows += servo.DescribeBinding().empty() ? 0 : 1;
        return torque;
      });
  return bench;
}

Value WriteTrackingBench(const TrackingBench& bench) {
  return Value::Object()
      .Set("operational_space", WriteFigures(bench.operational_space))
      .Set("constrained_torque", WriteFigures(bench.constrained))
      .Set("error_ratio", bench.error_ratio())
      .Set("work_ratio", bench.work_ratio())
      .Set("active_rows", bench.active_rows);
}

}  // namespace tether::bench
