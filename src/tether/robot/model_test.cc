#include "tether/robot/model.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <mujoco/mujoco.h>
#include <Eigen/Eigenvalues>

#include "testing/common/scratch_folder.h"
#include "tether/common/document/value.h"
#include "tether/common/error.h"
#include "tether/common/file.h"
#include "tether/common/random.h"
#include "tether/geometry/distance/bounds.h"
#include "tether/geometry/polygon/support.h"

namespace tether::robot {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;

std::shared_ptr<const Model> Panda() {
  static const std::shared_ptr<const Model> model = Model::Load("panda");
  return model;
}

Eigen::VectorXd RandomConfiguration(const Model& model, Random* random) {
  Eigen::VectorXd q(model.dof());
  for (int i = 0; i < model.dof(); ++i) q[i] = random->Uniform(model.lower()[i], model.upper()[i]);
  return q;
}

// The Panda's modified Denavit–Hartenberg parameters as its manufacturer publishes them, and the grasp point
// 0.2104 m beyond joint 7.
math::Pose PandaByDenavitHartenberg(const Eigen::VectorXd& q) {
  constexpr double h = M_PI / 2;
  constexpr double a[] = {0, 0, 0, 0.0825, -0.0825, 0, 0.088};
  constexpr double d[] = {0.333, 0, 0.316, 0, 0.384, 0, 0};
  constexpr double alpha[] = {0, -h, h, h, -h, h, h};
  Eigen::Isometry3d X = Eigen::Isometry3d::Identity();
  for (int i = 0; i < 7; ++i) {
    X = X * Eigen::AngleAxisd(alpha[i], Eigen::Vector3d::UnitX()) * Eigen::Translation3d(a[i], 0, 0) *
        Eigen::AngleAxisd(q[i], Eigen::Vector3d::UnitZ()) * Eigen::Translation3d(0, 0, d[i]);
  }
  X = X * Eigen::Translation3d(0, 0, 0.2104);
  return {X.linear(), X.translation()};
}

TEST(ModelTest, ThePandaStandsAsDenavitAndHartenbergSay) {
  Random random(1);
  State state(Panda());
  for (int i = 0; i < 100; ++i) {
    const Eigen::VectorXd q = i == 0 ? Panda()->home() : RandomConfiguration(*Panda(), &random);
    state.Set(q, Eigen::VectorXd::Zero(7));
    const math::Pose X_BH = PandaByDenavitHartenberg(q);
    EXPECT_LT((state.X_BH().p - X_BH.p).norm(), 1e-10);
    EXPECT_LT((state.X_BH().R - X_BH.R).norm(), 1e-10);
  }
}

TEST(ModelTest, AtHomeTheHandPointsDownAndClosesAlongTheBasesY) {
  const State state(Panda());
  EXPECT_LT((state.X_BH().p - Eigen::Vector3d(0.375, 0, 0.317)).norm(), 1e-3);
  EXPECT_NEAR(state.X_BH().R(2, 2), -1, 1e-6);
  EXPECT_NEAR(std::abs(state.X_BH().R(1, 1)), 1, 1e-6);
}

// Real Pandas, and problems made for them, turn the hand by −45° about the flange.
TEST(ModelTest, TheManufacturersMountTurnsTheHand) {
  const std::shared_ptr<const Model> flange = Model::Load("panda_flange");
  Random random(5);
  for (int i = 0; i < 10; ++i) {
    Eigen::VectorXd q = RandomConfiguration(*Panda(), &random);
    State straight(Panda()), turned(flange);
    straight.Set(q, Eigen::VectorXd::Zero(7));
    q[6] += M_PI / 4;
    turned.Set(q, Eigen::VectorXd::Zero(7));
    EXPECT_LT((straight.X_BH().p - turned.X_BH().p).norm(), 1e-12);
    EXPECT_LT(math::AngleBetween(straight.X_BH().R, turned.X_BH().R), 1e-7);
  }
}

TEST(ModelTest, TheJacobianIsTheDerivative) {
  Random random(2);
  State state(Panda());
  State moved(Panda());
  for (int i = 0; i < 20; ++i) {
    const Eigen::VectorXd q = RandomConfiguration(*Panda(), &random);
    state.Set(q, Eigen::VectorXd::Zero(7));
    for (int j = 0; j < 7; ++j) {
      constexpr double step = 1e-6;
      Eigen::VectorXd dq = Eigen::VectorXd::Zero(7);
      dq[j] = step;
      moved.Set(q + dq, dq);
      const math::Pose X_plus = moved.X_BH();
      moved.Set(q - dq, dq);
      const math::Pose X_minus = moved.X_BH();
      math::Vector6d column;
      column.head<3>() = (X_plus.p - X_minus.p) / (2 * step);
      column.tail<3>() = math::LogSO3(X_plus.R * X_minus.R.transpose()) / (2 * step);
      EXPECT_LT((state.J_BH().col(j) - column).norm(), 1e-7);
    }
  }
}

TEST(ModelTest, TheInertiaIsSymmetricAndPositive) {
  Random random(3);
  State state(Panda());
  for (int i = 0; i < 100; ++i) {
    state.Set(RandomConfiguration(*Panda(), &random), Eigen::VectorXd::Zero(7));
    EXPECT_LT((state.M() - state.M().transpose()).norm(), 1e-12);
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(state.M());
    EXPECT_GT(eigen.eigenvalues().minCoeff(), 0.05);
    EXPECT_LT(eigen.eigenvalues().maxCoeff(), 10);
  }
}

// At rest, bias is the gradient of the potential energy; in motion, it changes the kinetic energy as dM/dt
// does.
TEST(ModelTest, BiasConservesEnergy) {
  std::array<char, 500> error{};
  const std::unique_ptr<mjModel, decltype(&mj_deleteModel)> model(
      mj_loadXML(Panda()->mjcf_path().c_str(), nullptr, error.data(), error.size()), mj_deleteModel);
  ASSERT_NE(model, nullptr);
  const std::unique_ptr<mjData, decltype(&mj_deleteData)> data(mj_makeData(model.get()), mj_deleteData);
  double mass = 0;
  for (int body = 0; body < model->nbody; ++body) mass += model->body_mass[body];
  EXPECT_NEAR(mass, 17.45, 0.05);
  const auto potential = [&](const Eigen::VectorXd& q) {
    for (int i = 0; i < 7; ++i) {
      data->qpos[model
                     ->jnt_qposadr[mj_name2id(model.get(), mjOBJ_JOINT, Panda()->joint_names()[i].c_str())]] =
          q[i];
    }
    mj_kinematics(model.get(), data.get());
    double energy = 0;
    for (int body = 0; body < model->nbody; ++body) {
      energy += 9.81 * model->body_mass[body] * data->xipos[3 * body + 2];
    }
    return energy;
  };
  Random random(4);
  State state(Panda());
  constexpr double step = 1e-5;
  for (int i = 0; i < 20; ++i) {
    const Eigen::VectorXd q = RandomConfiguration(*Panda(), &random);
    state.Set(q, Eigen::VectorXd::Zero(7));
    const Eigen::VectorXd gravity = state.bias();
    for (int j = 0; j < 7; ++j) {
      Eigen::VectorXd dq = Eigen::VectorXd::Zero(7);
      dq[j] = step;
      EXPECT_NEAR(gravity[j], (potential(q + dq) - potential(q - dq)) / (2 * step), 1e-6);
    }
    Eigen::VectorXd v(7);
    for (int j = 0; j < 7; ++j) v[j] = random.Uniform(-1, 1);
    state.Set(q + step * v, v);
    const Eigen::MatrixXd M_plus = state.M();
    state.Set(q - step * v, v);
    const Eigen::MatrixXd M_minus = state.M();
    state.Set(q, v);
    EXPECT_NEAR(v.dot(state.bias() - gravity), 0.5 * v.dot((M_plus - M_minus) * v) / (2 * step), 1e-6);
  }
}

TEST(ModelTest, GravityFollowsATiltedBase) {
  State upright(Panda());
  State hanging(Panda(), Eigen::Vector3d(0, 0, 9.81));
  EXPECT_LT((upright.bias() + hanging.bias()).norm(), 1e-9);
}

TEST(ModelTest, StatesOfOneModelAreIndependent) {
  State a(Panda());
  State b(Panda());
  const Eigen::VectorXd before = a.bias();
  b.Set(Eigen::VectorXd::Constant(7, -0.5), Eigen::VectorXd::Ones(7));
  a.Set(Panda()->home(), Eigen::VectorXd::Zero(7));
  EXPECT_EQ(a.bias(), before);
}

TEST(ModelTest, TheReachIsAnOuterBound) {
  Random random(5);
  State state(Panda());
  const Reach& reach = Panda()->reach();
  double farthest = 0;
  int down = 0, below = 0;
  for (int i = 0; i < 20000; ++i) {
    state.Set(RandomConfiguration(*Panda(), &random), Eigen::VectorXd::Zero(7));
    const double distance = (state.X_BH() * reach.wrist_hand - reach.centre).norm();
    farthest = std::max(farthest, distance);
    if (state.X_BH().R(2, 2) > -std::cos(0.6)) continue;
    ++down;
    below += distance < reach.min;
  }
  EXPECT_LE(farthest, reach.max);
  EXPECT_GE(farthest, reach.max - 0.02);
  // Inside of the shell the arm folds onto its own base: few configurations with the hand downwards are
  // there.
  EXPECT_LT(below, 0.05 * down);
}

TEST(ModelTest, TheHandsFingersTouchWhatIsHeld) {
  const Gripper& gripper = Panda()->gripper();
  for (const double opening : {0.0, 0.05, 0.08}) {
    const geometry::Shape hand = Panda()->HandShape(opening);
    ASSERT_EQ(hand.parts.size(), 3u);
    const geometry::Part& palm = hand.parts[0];
    const geometry::Aabb box = geometry::BoundingBox(palm.primitive, palm.X_SP);
    EXPECT_NEAR(box.upper.z(), -gripper.palm_depth, 1e-9);
    // It lies across, along the closing axis.
    EXPECT_GT(box.upper.y() - box.lower.y(), 2 * (box.upper.x() - box.lower.x()));
    for (int i : {1, 2}) {
      const auto& finger = std::get<geometry::Capsule>(hand.parts[i].primitive);
      const math::Pose& X = hand.parts[i].X_SP;
      EXPECT_NEAR(std::abs(X.p.y()) - finger.radius, opening / 2, 1e-9);
      EXPECT_NEAR(X.p.z() + finger.length / 2 + finger.radius, gripper.pad_half_height, 1e-9);
    }
    EXPECT_LT(hand.parts[1].X_SP.p.y() * hand.parts[2].X_SP.p.y(), 0);
  }
}

class OwnRobotTest : public testing::Test {
 protected:
  void SetUp() override {
    const fs::path shipped = fs::path(DataDirectory()) / "models" / "robots";
    yaml_ = ReadFile((shipped / "panda.yaml").string());
    mjcf_ = ReadFile((shipped / "panda.xml").string());
  }

  // The message on loading the Panda with a piece of a file replaced; empty if it loads.
  std::string Replaced(std::string* text, const std::string& from, const std::string& to) {
    const std::string kept = *text;
    EXPECT_NE(text->find(from), std::string::npos) << from;
    text->replace(text->find(from), from.size(), to);
    std::ofstream(folder_.path() / "own.yaml") << yaml_;
    std::ofstream(folder_.path() / "panda.xml") << mjcf_;
    *text = kept;
    try {
      Model::Load(folder_.File("own.yaml"));
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  }

  ScratchFolder folder_;
  std::string yaml_, mjcf_;
};

TEST_F(OwnRobotTest, LoadsFromAPath) { EXPECT_EQ(Replaced(&yaml_, "name: panda", "name: own"), ""); }

TEST_F(OwnRobotTest, MistakesAreExplained) {
  EXPECT_THAT(Replaced(&yaml_, "max_torque:", "max_torqe:"),
              testing::AllOf(HasSubstr("own.yaml:"), HasSubstr("did you mean 'max_torque'?"),
                             HasSubstr("lacks 'max_torque'")));
  EXPECT_THAT(Replaced(&yaml_, "[joint1, joint2,", "[joint1, jointt2,"), HasSubstr("no joint 'jointt2'"));
  EXPECT_THAT(Replaced(&yaml_, "hand: hand ", "hand: hnad "), HasSubstr("did you mean 'hand'?"));
  EXPECT_THAT(Replaced(&yaml_, "home: [0, -0.5236,", "home: [0, -2.5,"), HasSubstr("'joint2' at -2.5"));
  EXPECT_THAT(
      Replaced(&yaml_, "{joint4: [-3.0718,", "{joint4: [-2.5,"),
      HasSubstr("planned_range of 'joint4' is -2.5 to -0.9 (a range about home (-2.618) within the limits"));
  EXPECT_THAT(Replaced(&yaml_, "{joint4: [-3.0718,", "{joint44: [-3.0718,"),
              HasSubstr("did you mean 'joint4'?"));
  EXPECT_THAT(Replaced(&yaml_, "min: 0", "min: 1"), HasSubstr("0 ≤ min < max"));
  EXPECT_THAT(Replaced(&yaml_, "max_force: 70", "max_force: -70"), HasSubstr("above zero"));
  EXPECT_THAT(Replaced(&yaml_, "  max_opening: 0.08", "  open: [0, 0]\n  max_opening: 0.08"),
              AllOf(HasSubstr("'closed'"), HasSubstr("'closing_torque'")));
  EXPECT_THAT(Replaced(&yaml_, "  max_opening: 0.08",
                       "  open: [0, 0]\n  closed: [1, 1]\n  closing_torque: [1, 1]\n  max_opening: 0.08"),
              HasSubstr("unknown key 'finger' in solid"));
  EXPECT_THAT(Replaced(&yaml_, "tether.robot/1\nname", "tether.robot/7\nname"),
              HasSubstr("tether.robot/1 is accepted"));
  EXPECT_THAT(Replaced(&yaml_, "mjcf: panda.xml", "mjcf: pandas.xml"), HasSubstr("pandas.xml"));
  EXPECT_THAT(Replaced(&yaml_, "[finger_joint1, finger_joint2]", "[joint1, finger_joint2]"),
              HasSubstr("not a slide with limits"));
  EXPECT_THAT(Replaced(&mjcf_, "<joint name=\"joint3\"", "<jiont name=\"joint3\""), HasSubstr("panda.xml"));
}

// Where the manufacturer's description puts the end effector, worked out from its joint frames one by one.
math::Pose JacoByItsDescription(const Eigen::VectorXd& q) {
  struct Frame {
    Eigen::Vector3d rpy, xyz;
  };
  constexpr double pi = M_PI;
  const std::array<Frame, 7> frames = {{{{0, pi, 0}, {0, 0, 0.15675}},
                                        {{-pi / 2, pi, pi}, {0, 0.0016, -0.11875}},
                                        {{0, pi, pi}, {0, -0.410, 0}},
                                        {{-pi / 2, 0, pi}, {0, 0.2073, -0.0114}},
                                        {{pi / 3, 0, pi}, {0, -0.03703, -0.06414}},
                                        {{pi / 3, 0, pi}, {0, -0.03703, -0.06414}},
                                        {{pi, 0, 0}, {0, 0, -0.16}}}};
  math::Pose X;
  for (size_t i = 0; i < frames.size(); ++i) {
    X = X * math::Pose(math::RotationFromRpy(frames[i].rpy), frames[i].xyz);
    if (i < 6)
      X = X * math::Pose(math::ExpSO3({0, 0, q[static_cast<Eigen::Index>(i)]}), Eigen::Vector3d::Zero());
  }
  return X;
}

TEST(ModelTest, TheJacoStandsAsItsDescriptionSays) {
  const auto jaco = Model::Load("j2n6s300");
  Random random(1);
  State state(jaco);
  for (int i = 0; i < 100; ++i) {
    const Eigen::VectorXd q = i == 0 ? jaco->home() : RandomConfiguration(*jaco, &random);
    state.Set(q, Eigen::VectorXd::Zero(6));
    EXPECT_LT((state.X_BH().p - JacoByItsDescription(q).p).norm(), 1e-9);
    EXPECT_LT((state.X_BH().R - JacoByItsDescription(q).R).norm(), 1e-9);
  }
  state.Set(jaco->home(), Eigen::VectorXd::Zero(6));
  EXPECT_LT((state.X_BH().p - Eigen::Vector3d(0.3, 0, 0.35)).norm(), 2e-3);
  EXPECT_LT(state.X_BH().R(2, 2), -0.999);
}

TEST(ModelTest, HingedFingersGoFromOpenToClosed) {
  const auto jaco = Model::Load("j2n6s300");
  const Gripper& gripper = jaco->gripper();
  ASSERT_TRUE(gripper.hinged());
  EXPECT_FALSE(Panda()->gripper().hinged());
  for (const double opening : {0.0, 0.05, gripper.max_opening}) {
    double sum = 0;
    for (size_t i = 0; i < 3; ++i) sum += gripper.OpeningShare(i, 3, gripper.FingerPosition(i, 3, opening));
    EXPECT_NEAR(sum, opening, 1e-12);
  }
  // The palm and two parts of each finger; the tips part as the hand opens.
  const geometry::Shape open = jaco->HandShape(gripper.max_opening), closed = jaco->HandShape(0);
  ASSERT_EQ(open.parts.size(), 7u);
  ASSERT_EQ(closed.parts.size(), 7u);
  EXPECT_GT(geometry::Support(open, Eigen::Vector3d::UnitY()), 0.1);
  EXPECT_LT(geometry::Support(closed, Eigen::Vector3d::UnitY()), 0.07);
}

TEST(LoadTest, UnknownModelsAreTold) {
  try {
    Model::Load("pandaa");
    FAIL();
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("did you mean 'panda'?"));
  }
  EXPECT_THROW(Model::Load("nowhere/robot.yaml"), InputError);
}

TEST(LoadTest, TheDataDirectoryCanBeSet) {
  ASSERT_EQ(setenv("TETHER_DATA_DIR", "/nowhere", 1), 0);
  try {
    DataDirectory();
    ADD_FAILURE();
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("TETHER_DATA_DIR is '/nowhere'"));
  }
  unsetenv("TETHER_DATA_DIR");
  EXPECT_TRUE(fs::is_directory(fs::path(DataDirectory()) / "models" / "robots"));
}

}  // namespace
}  // namespace tether::robot
