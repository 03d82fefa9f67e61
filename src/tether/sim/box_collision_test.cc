#include "tether/sim/box_collision.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <memory>
#include <string>

#include <gtest/gtest.h>
#include <mujoco/mujoco.h>

#include "testing/common/scratch_folder.h"
#include "tether/common/random.h"

namespace tether::sim {
namespace {

// Unguarded, about one in a thousand of these collisions reports a contact a metre deep.
TEST(BoxCollisionTest, BoxesThatLieFlatUpToRoundingTouchAsDeepAsTheyAre) {
  GuardBoxCollision();
  const ScratchFolder folder;
  const std::string path = folder.File("flat_box.xml");
  std::ofstream(path) << R"(<mujoco><worldbody><geom type="box" size="1 0.5 0.25" pos="0.5 0 -0.25"/>
      <body pos="0.4 0.1 0.024996"><freejoint/><geom type="box" size="0.025 0.025 0.025" mass="0.1"/></body>
      </worldbody></mujoco>)";
  std::array<char, 500> error{};
  const std::unique_ptr<mjModel, decltype(&mj_deleteModel)> model(
      mj_loadXML(path.c_str(), nullptr, error.data(), error.size()), mj_deleteModel);
  ASSERT_NE(model, nullptr) << error.data();
  const std::unique_ptr<mjData, decltype(&mj_deleteData)> data(mj_makeData(model.get()), mj_deleteData);
  Random random(3);
  for (int i = 0; i < 100000; ++i) {
    const double tilt = std::pow(10, random.Uniform(-17, -8));
    const double yaw = i % 2 == 0 ? 0.6 : random.Uniform(-M_PI, M_PI);
    const mjtNum turned[4] = {std::cos(yaw / 2), 0, 0, std::sin(yaw / 2)};
    const mjtNum tilted[4] = {1, tilt * random.Uniform(-1, 1), tilt * random.Uniform(-1, 1), 0};
    mju_mulQuat(data->qpos + 3, turned, tilted);
    mj_kinematics(model.get(), data.get());
    mj_collision(model.get(), data.get());
    ASSERT_GE(data->ncon, 4) << i;
    for (int c = 0; c < data->ncon; ++c) {
      ASSERT_LE(data->contact[c].dist, 0) << i;
      ASSERT_GE(data->contact[c].dist, -4.01e-6) << i;
      ASSERT_NEAR(std::abs(data->contact[c].frame[2]), 1, 1e-6) << i;
    }
  }
}

}  // namespace
}  // namespace tether::sim
