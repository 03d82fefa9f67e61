#include "tether/robot/kinematics.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <memory>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <mujoco/mujoco.h>

#include "testing/common/heap_counter.h"
#include "testing/common/scratch_folder.h"
#include "tether/common/document/value.h"
#include "tether/common/error.h"
#include "tether/common/random.h"
#include "tether/geometry/distance/distance.h"
#include "tether/robot/model.h"
#include "tether/robot/posture.h"

namespace tether::robot {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;
using math::Pose;
using testing::HasSubstr;
using testing::Pair;
using RowMajor = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

// An arm as crooked as the format allows: two joints in one body, offset and slanted axes, references that
// are not zero, a joint that is not the arm's, the hand's site on the last link, a visual geom, and a mesh.
constexpr const char* kCrookedMjcf = R"(<mujoco model="crooked">
  <compiler angle="radian" autolimits="true"/>
  <asset><mesh name="wedge" vertex="0 0 0  0.1 0 0  0 0.08 0  0 0 0.06"/></asset>
  <worldbody>
    <body name="foot" pos="0.1 0 0.05" euler="0.1 0.2 0.3">
      <inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
      <geom type="box" size="0.05 0.06 0.02"/>
      <body name="upper" pos="0 0.1 0.2" euler="0.4 0 0.1">
        <inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
        <joint name="yaw" axis="0 0.2 1" pos="0.01 0.02 0.03" range="-2 2" ref="0.3"/>
        <joint name="pitch" axis="1 0.1 0" pos="0 0 0.1" range="-1.5 1.5"/>
        <geom type="capsule" size="0.03" fromto="0 0 0 0 0.1 0.3"/>
        <geom type="sphere" size="0.5" contype="0" conaffinity="0"/>
        <body name="lower" pos="0 0.1 0.3">
          <inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
          <joint name="elbow" axis="0 1 0" range="-2 2" ref="-0.2"/>
          <geom type="mesh" mesh="wedge"/>
          <body name="spacer" pos="0.1 0 0.1">
            <inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
            <joint name="idle" axis="1 0 0" range="-1 1"/>
            <geom type="cylinder" size="0.02 0.05"/>
            <body name="last" pos="0.05 0 0.1" euler="0 0.5 0">
              <inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
              <joint name="roll" axis="0 0 -1" range="-3 3"/>
              <geom type="sphere" size="0.03"/>
              <site name="grasp" pos="0 0.01 0.12" euler="0.1 0 0.7"/>
              <body name="thumb" pos="0 0.02 0.08">
                <inertial pos="0 0 0" mass="0.1" diaginertia="0.1 0.1 0.1"/>
                <joint name="thumb" type="slide" axis="0 1 0" range="0 0.05"/>
                <geom type="box" size="0.01 0.01 0.02"/>
              </body>
            </body>
          </body>
        </body>
      </body>
    </body>
  </worldbody>
  <contact><exclude body1="upper" body2="last"/></contact>
</mujoco>
)";
constexpr const char* kCrookedYaml = R"(format: tether.robot/1
name: crooked
mjcf: crooked.xml
joints: [yaw, pitch, elbow, roll]
max_torque: [9, 9, 9, 9]
max_velocity: [1, 1, 1, 1]
home: [0.1, 0.2, 0.3, 0.4]
hand: grasp
gripper: {joints: [thumb], max_opening: 0.05, pad_half_width: 0.01, pad_half_height: 0.01, palm_depth: 0.04, max_force: 20}
reach: {centre: [0, 0, 0], wrist: [0, 0, 0], min: 0, max: 2}
solid:
  palm: {radius: 0.03, length: 0.05, position: [0, 0, -0.07]}
  finger: {radius: 0.01, outward: 0.01, from: -0.04, to: 0}
)";

std::shared_ptr<const Model> LoadCrooked(const std::string& yaml = kCrookedYaml) {
  static const ScratchFolder folder;  // MuJoCo reads the files again later
  std::ofstream(folder.File("crooked.yaml")) << yaml;
  std::ofstream(folder.File("crooked.xml")) << kCrookedMjcf;
  return Model::Load(folder.File("crooked.yaml"));
}

class KinematicsTest : public testing::TestWithParam<std::string> {
 protected:
  void SetUp() override {
    model_ = GetParam() == "crooked" ? LoadCrooked() : Model::Load(GetParam());
    random_ = std::make_unique<Random>(7);
  }

  VectorXd RandomConfiguration() {
    VectorXd q(model_->dof());
    for (int i = 0; i < model_->dof(); ++i) q[i] = random_->Uniform(model_->lower()[i], model_->upper()[i]);
    return q;
  }
  /// Random ones, and each joint at each of its limits.
  std::vector<VectorXd> Configurations() {
    std::vector<VectorXd> all{model_->home(), model_->lower(), model_->upper()};
    for (int i = 0; i < model_->dof(); ++i) {
      for (const double limit : {model_->lower()[i], model_->upper()[i]}) {
        all.push_back(RandomConfiguration());
        all.back()[i] = limit;
      }
    }
    for (int i = 0; i < 50; ++i) all.push_back(RandomConfiguration());
    return all;
  }

  std::shared_ptr<const Model> model_;
  std::unique_ptr<Random> random_;
};

TEST_P(KinematicsTest, TheHandAndItsJacobianAreThoseOfMujoco) {
  State state(model_);
  Kinematics kinematics(model_);
  const int n = model_->dof();
  MatrixXd J(6, n);
  for (const VectorXd& q : Configurations()) {
    state.Set(q, VectorXd::Zero(n));
    kinematics.Set(q);
    EXPECT_LT((kinematics.X_BH().p - state.X_BH().p).norm(), 1e-12);
    EXPECT_LT((kinematics.X_BH().R - state.X_BH().R).norm(), 1e-12);
    kinematics.HandJacobian(J);
    EXPECT_LT((J - state.J_BH()).norm(), 1e-12);
  }
}

// Each part of each link stands where MuJoCo has a geom of its body.
TEST_P(KinematicsTest, LinksStandWhereMujocoHasThem) {
  std::array<char, 500> error{};
  const std::unique_ptr<mjModel, decltype(&mj_deleteModel)> mujoco(
      mj_loadXML(model_->mjcf_path().c_str(), nullptr, error.data(), error.size()), mj_deleteModel);
  ASSERT_NE(mujoco, nullptr);
  const std::unique_ptr<mjData, decltype(&mj_deleteData)> data(mj_makeData(mujoco.get()), mj_deleteData);
  Kinematics kinematics(model_);
  for (const VectorXd& q : Configurations()) {
    for (int i = 0; i < model_->dof(); ++i) {
      const int joint = mj_name2id(mujoco.get(), mjOBJ_JOINT, model_->joint_names()[i].c_str());
      data->qpos[mujoco->jnt_qposadr[joint]] = q[i];
    }
    mj_kinematics(mujoco.get(), data.get());
    kinematics.Set(q);
    for (int k = 0; k < model_->solids().hand(); ++k) {
      const LinkSolid& solid = model_->solids().links[k];
      const int body = mj_name2id(mujoco.get(), mjOBJ_BODY, solid.name.c_str());
      ASSERT_GE(body, 0);
      int geom = mujoco->body_geomadr[body];
      for (const geometry::Part& part : solid.shape.parts) {
        while (mujoco->geom_contype[geom] == 0) ++geom;
        const Vector3d centre(data->geom_xpos + 3 * geom);
        const Pose X_BP = kinematics.X_BSolid(k) * part.X_SP;
        if (const auto* hull = std::get_if<geometry::Hull>(&part.primitive)) {
          // MuJoCo moves a mesh's frame to its centre of mass, as CentredPart does to a hull's.
          EXPECT_LT((X_BP * geometry::CentreOfMass(*hull) - centre).norm(), 1e-7);
        } else {
          EXPECT_LT((X_BP.p - centre).norm(), 1e-12) << solid.name;
          EXPECT_LT((X_BP.R - RowMajor(data->geom_xmat + 9 * geom)).norm(), 1e-12) << solid.name;
        }
        ++geom;
      }
    }
  }
}

TEST_P(KinematicsTest, JacobiansAreDerivatives) {
  Kinematics kinematics(model_), moved(model_);
  const int n = model_->dof();
  constexpr double step = 1e-6;
  MatrixXd J(3, n), J_hand(6, n);
  Eigen::RowVectorXd row(n);
  for (const VectorXd& q : Configurations()) {
    for (int link = 0; link <= n; ++link) {
      kinematics.Set(q);
      const Vector3d p_LQ(random_->Uniform(-0.3, 0.3), random_->Uniform(-0.3, 0.3),
                          random_->Uniform(-0.3, 0.3));
      const Vector3d normal = Vector3d(random_->Normal(), random_->Normal(), random_->Normal()).normalized();
      const Vector3d p_BQ = kinematics.X_BL(link) * p_LQ;
      kinematics.PointJacobian(link, p_BQ, J);
      kinematics.AlongNormal(link, p_BQ, normal, row);
      kinematics.HandBodyJacobian(J_hand);
      EXPECT_LT((row - normal.transpose() * J).norm(), 1e-12);
      for (int i = 0; i < n; ++i) {
        moved.Set(q + step * VectorXd::Unit(n, i));
        const Vector3d plus = moved.X_BL(link) * p_LQ;
        const Pose X_plus = moved.X_BH();
        moved.Set(q - step * VectorXd::Unit(n, i));
        EXPECT_LT((J.col(i) - (plus - moved.X_BL(link) * p_LQ) / (2 * step)).norm(), 1e-7);
        const math::Vector6d difference = (math::LogSE3(math::Between(kinematics.X_BH(), X_plus)) -
                                           math::LogSE3(math::Between(kinematics.X_BH(), moved.X_BH()))) /
                                          (2 * step);
        EXPECT_LT((J_hand.col(i) - difference).norm(), 1e-7);
      }
    }
  }
}

TEST_P(KinematicsTest, NothingIsBeyondTheOuterReach) {
  Kinematics kinematics(model_);
  const OuterReach& reach = model_->outer_reach();
  double farthest = 0;
  for (int i = 0; i < 20000; ++i) {
    kinematics.Set(RandomConfiguration());
    farthest = std::max(farthest, (kinematics.X_BH() * reach.p_HW - reach.centre).norm());
  }
  EXPECT_LE(farthest, reach.radius);
  EXPECT_GT(farthest, 0.8 * reach.radius);
}

#ifdef TETHER_COUNTS_ALLOCATIONS
TEST_P(KinematicsTest, AllocatesNothing) {
  Kinematics kinematics(model_);
  const VectorXd q = RandomConfiguration();
  const int n = model_->dof();
  MatrixXd J(6, n), J_point(3, n);
  Eigen::RowVectorXd row(n);
  const long before = heap_allocations;
  kinematics.Set(q);
  kinematics.HandJacobian(J);
  kinematics.HandBodyJacobian(J);
  kinematics.PointJacobian(2, Vector3d::Ones(), J_point);
  kinematics.AlongNormal(2, Vector3d::Ones(), Vector3d::UnitX(), row);
  EXPECT_EQ(heap_allocations, before);
}
#endif

#ifdef TETHER_COUNTS_ALLOCATIONS
TEST_P(KinematicsTest, ASecondSearchForAPostureAllocatesNothing) {
  PostureSolver solver(model_);
  Kinematics kinematics(model_);
  PostureProblem problem;
  problem.X_BH = kinematics.X_BH() * Pose(Vector3d(0.02, 0.03, 0));
  problem.rest = model_->home();
  NarrowLimits(*model_, 0.03, problem.lower, problem.upper);
  const geometry::Part ball{geometry::Sphere{0.05}, Pose(kinematics.X_BL(3).p)};
  problem.obstacles.emplace_back(ball, Pose(), true);
  Posture posture;
  posture.q = model_->home();
  solver.Solve(problem, posture);
  posture.q = model_->home();
  const long before = heap_allocations;
  solver.Solve(problem, posture);
  EXPECT_EQ(heap_allocations, before);
}
#endif

// The arm is free of self-collision at home, and not too many pairs are left out.
TEST_P(KinematicsTest, TheArmAtHomeIsClearOfItself) {
  Kinematics kinematics(model_);
  const ArmSolids& solids = model_->solids();
  const geometry::Shape hand = model_->HandShape(model_->gripper().max_opening);
  const auto shape = [&](int solid) -> const geometry::Shape& {
    return solid == solids.hand() ? hand : solids.links[solid].shape;
  };
  for (const auto& [a, b] : solids.pairs) {
    EXPECT_GT(
        geometry::SignedDistance(shape(a), kinematics.X_BSolid(a), shape(b), kinematics.X_BSolid(b)).distance,
        0)
        << a << ", " << b;
  }
}

INSTANTIATE_TEST_SUITE_P(Robots, KinematicsTest, testing::Values("panda", "crooked"),
                         [](const auto& robot) { return robot.param; });

// Shoulder to elbow, elbow to wrist, and the wrist's offset: the axes in between change nothing.
TEST(OuterReachTest, OfThePandaIsTheSumOfItsThreeLengths) {
  const OuterReach& reach = Model::Load("panda")->outer_reach();
  EXPECT_NEAR(reach.radius, std::hypot(0.316, 0.0825) + std::hypot(0.384, 0.0825) + 0.088, 1e-4);
  EXPECT_LT((reach.centre - Vector3d(0, 0, 0.333)).norm(), 1e-3);
  EXPECT_LT((reach.p_HW - Vector3d(0, 0, -0.2104)).norm(), 1e-3);
}

TEST(ArmSolidsTest, ThePandasLinksAreThoseOfItsDescription) {
  const auto model = Model::Load("panda");
  const ArmSolids& solids = model->solids();
  ASSERT_EQ(solids.hand(), 8);
  for (int i = 0; i < 8; ++i) {
    EXPECT_EQ(solids.links[i].name, "link" + std::to_string(i));
    EXPECT_EQ(solids.links[i].link, i);
  }
  EXPECT_EQ(solids.links[5].shape.parts.size(), 3u);
  // Next to each other; excluded by the file; far apart in the chain.
  EXPECT_THAT(solids.pairs, testing::Not(testing::Contains(Pair(2, 3))));
  EXPECT_THAT(solids.pairs, testing::Not(testing::Contains(Pair(5, 7))));
  EXPECT_THAT(solids.pairs, testing::Not(testing::Contains(Pair(6, 8))));
  EXPECT_THAT(solids.pairs, testing::IsSupersetOf({Pair(0, 5), Pair(0, 8), Pair(2, 7), Pair(3, 8)}));
}

TEST(ArmSolidsTest, FingersAndVisualGeomsAreNoLinks) {
  const auto model = LoadCrooked();
  const ArmSolids& solids = model->solids();
  std::vector<std::string> names;
  for (const LinkSolid& solid : solids.links) names.push_back(solid.name + ":" + std::to_string(solid.link));
  // The hand's site is fixed to the last link, which is a link nonetheless.
  EXPECT_THAT(names, testing::ElementsAre("foot:0", "upper:2", "lower:3", "spacer:3", "last:4"));
  EXPECT_EQ(solids.links[1].shape.parts.size(), 1u);
  EXPECT_TRUE(std::holds_alternative<geometry::Hull>(solids.links[2].shape.parts[0].primitive));
  EXPECT_THAT(solids.pairs, testing::Not(testing::Contains(Pair(1, 4))));
}

TEST(ArmSolidsTest, JointsOutOfOrderAreTold) {
  std::string yaml = kCrookedYaml;
  yaml.replace(yaml.find("[yaw, pitch, elbow"), 18, "[yaw, elbow, pitch");
  yaml.replace(yaml.find("home: [0.1, 0.2, 0.3"), 20, "home: [0.1, 0.1, 0.1");
  try {
    LoadCrooked(yaml);
    FAIL();
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), testing::AllOf(HasSubstr("joint 'elbow' does not move joint 'pitch'"),
                                             HasSubstr("crooked.yaml:4"), HasSubstr("a chain of joints")));
  }
}

}  // namespace
}  // namespace tether::robot
