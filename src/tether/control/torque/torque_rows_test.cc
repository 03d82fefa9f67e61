#include "tether/control/torque/constrained_torque.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "testing/control/torque_arm.h"
#include "tether/common/random.h"
#include "tether/constraints/core/field_function.h"

namespace tether::control {
namespace {

using Eigen::Vector3d;
using Eigen::VectorXd;
using math::Pose;

/// A scene with every kind of row: links, hand, held object, the arm itself; tilt, axis, cone.
struct RowScene {
  std::vector<Solid> solids;
  std::vector<MovingPose> poses;
  std::vector<ClearanceConstraint> clearances;
  std::vector<FieldConstraint> fields;

  explicit RowScene(const robot::Model& model) {
    const auto add = [&](const char* name, const geometry::Primitive& primitive, const Vector3d& p) {
      solids.push_back({name, primitive, true});
      // Nothing is parallel: there distances have kinks.
      poses.push_back({Pose(math::ExpSO3(Vector3d(0.02, 0.03, 0.01)), p)});
    };
    add("table", geometry::Box{{1.4, 1.8, 0.04}}, {0, 0, -0.02});
    add("post", geometry::Cylinder{0.05, 0.4}, {0.35, 0.3, 0.2});
    add("held", geometry::Box{{0.05, 0.05, 0.1}}, {0.3, 0, 0.3});
    add("ball", geometry::Sphere{0.06}, {0.3, -0.3, 0.5});
    clearances = {KeepClear(model, {0, 1, 2, 3})};
    fields = {{"tilt", constraints::MakeAngle(Vector3d::UnitZ(), -Vector3d::UnitZ(), 0.35), {}, {}, 1},
              {"axis",
               constraints::MakeAxisDistance(Vector3d::Zero(), Vector3d::UnitZ(), Vector3d::Zero(), 0.15, -1),
               {},
               {}},
              {"cone",
               constraints::MakePointCone(0.05, {0.2, 0.2, 0.3}, Vector3d(0, 0, 0.01)),
               {1, Pose(Vector3d(0, 0, 0.2))},
               {2, Pose(Vector3d(0.01, 0, 0))}}};
  }

  /// Everything `t` later: the arm accelerates with `a`, objects move on.
  std::vector<MovingPose> After(double t, const Pose& X_WH, const Pose& X_HO, int held) const {
    std::vector<MovingPose> later = poses;
    for (size_t i = 0; i < later.size(); ++i) {
      later[i].X.p += t * poses[i].V.head<3>();
      later[i].X.R = math::ExpSO3(Vector3d(t * poses[i].V.tail<3>())) * poses[i].X.R;
    }
    later[static_cast<size_t>(held)].X = X_WH * X_HO;
    return later;
  }
};

// Each row's value, its rate, and its second derivative J q̈ + J̇ q̇, against numeric differentiation along the
// motion, with obstacles that move and turn.
TEST(ConstrainedTorque, TheSecondDerivativeOfEveryRowIsExact) {
  const auto model = robot::Model::Load("panda");
  RowScene scene(*model);
  TorqueOptions options;
  options.range = 0.4;
  ConstrainedTorque controller(model, Pose(), scene.solids, scene.clearances, scene.fields, options);
  controller.Hold(2);
  Random random(4);
  robot::State state(model);
  int looked_at = 0, of_fields = 0;
  for (int trial = 0; trial < 150; ++trial) {
    VectorXd q = model->home(), v(7), a(7);
    for (int i = 0; i < 7; ++i) {
      q[i] += random.Uniform(-0.3, 0.3);
      v[i] = random.Uniform(-1, 1);
      a[i] = random.Uniform(-3, 3);
    }
    for (MovingPose& pose : scene.poses) {
      for (int i = 0; i < 6; ++i) pose.V[i] = random.Uniform(-0.5, 0.5);
    }
    const Pose X_HO(math::ExpSO3(Vector3d(0.1, 0.2, 0.3)), Vector3d(0, 0, 0.03));
    using Rows = std::vector<std::pair<ConstrainedTorque::Row, Eigen::RowVectorXd>>;
    const auto rows_at = [&](double t) {
      state.Set(q + t * v + 0.5 * t * t * a, v + t * a);
      const std::vector<MovingPose> poses = scene.After(t, state.X_BH(), X_HO, 2);
      controller.Restart();
      controller.Compute({state, 0.04, poses}, {});
      Rows rows;
      for (int i = 0; i < controller.num_rows(); ++i) {
        rows.emplace_back(controller.row(i), controller.row_jacobian(i));
      }
      return rows;
    };
    const double h = 1e-5;
    const Rows now = rows_at(0), after = rows_at(h), before = rows_at(-h);
    ASSERT_EQ(now.size(), after.size());
    ASSERT_EQ(now.size(), before.size());
    for (size_t i = 0; i < now.size(); ++i) {
      const ConstrainedTorque::Row& row = now[i].first;
      const double forward = (after[i].first.rate - row.rate) / h;
      const double backward = (row.rate - before[i].first.rate) / h;
      // The nearest feature changes here.
      if (std::abs(forward - backward) > 1e-2 * (1 + std::abs(forward))) continue;
      const double rate = (after[i].first.value - before[i].first.value) / (2 * h);
      EXPECT_NEAR(row.rate, rate, 1e-5 * (1 + std::abs(rate)));
      const double acceleration = now[i].second.dot(a) + row.bias;
      if (std::abs(forward) > 15) continue;
      EXPECT_NEAR(acceleration, 0.5 * (forward + backward), 5e-3 * (1 + std::abs(forward)))
          << controller.constraint_name(row.constraint) << " " << row.a << " " << row.b;
      ++looked_at;
      of_fields += row.a < 0 ? 1 : 0;
    }
  }
  EXPECT_GT(looked_at, 800);
  EXPECT_GT(of_fields, 300);
}

}  // namespace
}  // namespace tether::control
