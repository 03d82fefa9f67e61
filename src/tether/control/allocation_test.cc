// A file of its own: it replaces malloc for the whole test program.
#include "testing/common/heap_counter.h"

#include <limits>

#include <gtest/gtest.h>

#include "tether/constraints/core/field_function.h"
#include "tether/control/constrained_velocity.h"
#include "tether/control/objective.h"
#include "tether/control/operational_space.h"
#include "tether/control/torque/constrained_torque.h"
#include "tether/control/torque/torque_limiter.h"

namespace tether::control {
namespace {

#ifdef TETHER_COUNTS_ALLOCATIONS

TEST(AllocationTest, OperationalSpaceControlTakesNothingFromTheHeap) {
  const auto model = robot::Model::Load("panda");
  robot::State state(model);
  OperationalSpaceController controller(model, {}, model->home());
  HandTarget target;
  target.X_BH = state.X_BH();
  target.X_BH.p.x() += 0.3;
  const Eigen::VectorXd q = model->home() + Eigen::VectorXd::Constant(7, 0.1), v = Eigen::VectorXd::Zero(7);
  const long before = heap_allocations;
  for (int i = 0; i < 10; ++i) {
    state.Set(q, v);
    controller.Compute(state, target);
  }
  target.X_BH.p.x() = std::numeric_limits<double>::quiet_NaN();
  controller.Compute(state, target);
  EXPECT_EQ(heap_allocations, before);
  EXPECT_GT(before, 0);
}

/// An arm that holds a box between a table and a post, with clearances, two fields and a goal.
struct CrowdedArm {
  explicit CrowdedArm(const robot::Model& model) {
    Add("table", geometry::Box{{1.4, 1.8, 0.04}}, {0, 0, -0.02});
    Add("post", geometry::Cylinder{0.05, 0.4}, {0.3, 0.3, 0.2});
    Add("held", geometry::Box{{0.05, 0.05, 0.1}}, {0.3, 0, 0.3});
    for (int body = 0; body <= model.solids().hand(); ++body) clearance.of.push_back(body);
    goal.functions =
        MakeObjective(Objective::kPose, math::Pose(math::RotationFromRpy({M_PI, 0, 0}), {0.4, 0.2, 0.05}));
  }
  void Add(const char* object, const geometry::Primitive& primitive, const Eigen::Vector3d& p) {
    solids.push_back({object, primitive, true});
    poses.push_back({math::Pose(p)});
  }

  std::vector<Solid> solids;
  std::vector<MovingPose> poses;
  ClearanceConstraint clearance{"clearance", {}, true, {0, 1, 2}, 0.01, 0};
  const std::vector<FieldConstraint> fields = {
      {"tilt", constraints::MakeAngle(Eigen::Vector3d::UnitZ(), -Eigen::Vector3d::UnitZ(), 0.35), {}, {}, 1},
      {"cone", constraints::MakePointCone(0.05, {0.2, 0.2, 0.3}, Eigen::Vector3d::Zero()), {}, {2, {}}, 0}};
  Goal goal;
};

TEST(AllocationTest, ConstrainedVelocityControlTakesNothingFromTheHeap) {
  for (const char* name : {"j2n6s300", "panda"}) {
    const auto model = robot::Model::Load(name);
    CrowdedArm scene(*model);
    VelocityOptions options;
    options.range = 2;
    ConstrainedVelocity controller(model, math::Pose(), scene.solids, {scene.clearance}, scene.fields,
                                   options);
    controller.Hold(2);
    Eigen::VectorXd q = model->home();
    robot::Kinematics kinematics(model);
    int relaxed = 0;
    long allocations = 0;
    for (int tick = 0; tick < 600; ++tick) {
      kinematics.Set(q);
      scene.poses[2].X = kinematics.X_BH();
      // A post that runs over the arm: rows conflict.
      if (tick > 300) scene.poses[1].X.p = Eigen::Vector3d(0.3 - 0.002 * (tick - 300), 0, 0.2);
      const long before = heap_allocations;
      const Eigen::VectorXd& v =
          controller.Compute({q, 0.02, scene.poses}, tick < 500 ? &scene.goal : nullptr);
      allocations += heap_allocations - before;
      relaxed += controller.flags().relaxed ? 1 : 0;
      q += 0.005 * v;
    }
    EXPECT_EQ(allocations, 0) << name;
    EXPECT_GT(relaxed, 0) << name;
  }
}

TEST(AllocationTest, ConstrainedTorqueControlTakesNothingFromTheHeap) {
  for (const char* name : {"j2n6s300", "panda"}) {
    const auto model = robot::Model::Load(name);
    CrowdedArm scene(*model);
    ConstrainedTorque controller(model, math::Pose(), scene.solids, {scene.clearance}, scene.fields, {});
    TorqueLimiter limiter(model, {});
    controller.Hold(2);
    HandTarget target;
    Eigen::VectorXd q = model->home(), v = Eigen::VectorXd::Zero(model->dof()), external = v;
    robot::State state(model);
    target.X_BH = state.X_BH();
    const std::pair<int, int> allowed[] = {{controller.bodies().hand(), controller.bodies().object(0)}};
    int relaxed = 0, yielding = 0;
    long allocations = 0;
    for (int tick = 0; tick < 2500; ++tick) {
      state.Set(q, v);
      scene.poses[2].X = state.X_BH();
      // A post that runs over the arm: rows conflict.
      if (tick > 1000 && tick < 1800) {
        scene.poses[1].X.p = Eigen::Vector3d(0.3 - 0.001 * (tick - 1000), 0, 0.2);
        scene.poses[1].V[0] = -1;
      }
      // NOLINTNEXTLINE: an arm that is pushed.
      external.setConstant(tick > 2000 ? 8 : 0);
      HandTarget given = target;
      if (tick == 2400) given.X_BH.p.x() = std::numeric_limits<double>::quiet_NaN();
      const TorqueTask task{tick > 500 ? &given : nullptr, tick < 1500 ? &scene.goal : nullptr,
                            &model->home()};
      const long before = heap_allocations;
      controller.Allow(allowed);
      const Eigen::VectorXd& torque =
          limiter.Limit(state, controller.Compute({state, 0.02, scene.poses, &external}, task));
      allocations += heap_allocations - before;
      relaxed += controller.flags().relaxed ? 1 : 0;
      yielding += controller.flags().yielding ? 1 : 0;
      v += 0.001 * state.M().llt().solve(torque - state.bias());
      q += 0.001 * v;
    }
    EXPECT_EQ(allocations, 0) << name;
    EXPECT_GT(relaxed, 0) << name;
    EXPECT_GT(yielding, 0) << name;
  }
}

#endif

}  // namespace
}  // namespace tether::control
