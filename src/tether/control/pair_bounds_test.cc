#include "tether/control/pair_bounds.h"

#include <cmath>

#include <gtest/gtest.h>

#include "testing/control/torque_arm.h"
#include "tether/common/random.h"
#include "tether/control/torque/constrained_torque.h"

namespace tether::control {
namespace {

using Eigen::Vector3d;
using math::Pose;

// An arm that moves and jumps among things that do, with a hand that opens and closes: a controller that has
// seen all of it finds the same rows as one that sees it for the first time.
TEST(PairBounds, WhatIsFoundDoesNotDependOnWhatWasSeenBefore) {
  Random random(7);
  TorqueArm arm;
  std::vector<Solid> solids;
  std::vector<MovingPose> poses;
  for (int i = 0; i < 6; ++i) {
    solids.push_back({"box", geometry::Primitive(geometry::Box{{0.05 + 0.1 * i, 0.08, 0.1}}), true});
    poses.push_back({Pose(Vector3d(random.Uniform(-0.6, 0.6), random.Uniform(-0.6, 0.6), 0.5))});
  }
  const auto make = [&] {
    return ConstrainedTorque(arm.model, Pose(), solids, {KeepClear(*arm.model, {0, 1, 2, 3, 4, 5})}, {}, {});
  };
  ConstrainedTorque seasoned = make();
  size_t rows = 0;
  double opening = 0.04;
  for (int tick = 0; tick < 400; ++tick) {
    const bool jump = tick % 50 == 49;
    Eigen::VectorXd q = arm.q, v(7);
    for (int i = 0; i < 7; ++i) {
      v[i] = random.Uniform(-1, 1);
      q[i] += jump ? random.Uniform(-0.5, 0.5) : 0.01 * v[i];
    }
    arm.Put(q, v);
    for (MovingPose& pose : poses) {
      for (int i = 0; i < 6; ++i) pose.V[i] = random.Uniform(-0.3, 0.3);
      const double by = tick % 70 == 69 ? 1 : 0.01;
      pose.X.p += by * pose.V.head<3>();
      pose.X.R = math::ExpSO3(by * pose.V.tail<3>()) * pose.X.R;
    }
    if (tick % 20 == 0) opening = random.Uniform(0, 0.08);
    if (tick == 200) seasoned.Hold(2);
    seasoned.Compute({arm.state, opening, poses}, {});
    if (tick % 4 != 0) continue;
    ConstrainedTorque fresh = make();
    if (tick >= 200) fresh.Hold(2);
    fresh.Compute({arm.state, opening, poses}, {});
    ASSERT_EQ(seasoned.num_rows(), fresh.num_rows()) << tick;
    for (int i = 0; i < fresh.num_rows(); ++i) {
      ASSERT_EQ(seasoned.row(i).value, fresh.row(i).value) << tick;
      ASSERT_EQ(seasoned.row(i).a, fresh.row(i).a);
      ASSERT_EQ(seasoned.row(i).b, fresh.row(i).b);
    }
    rows += static_cast<size_t>(fresh.num_rows());
  }
  EXPECT_GT(rows, 300u);
}

}  // namespace
}  // namespace tether::control
