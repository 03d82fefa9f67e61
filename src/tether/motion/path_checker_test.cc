#include "tether/motion/path_checker.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <tuple>

#include <gtest/gtest.h>

#include "testing/motion/random_scene.h"
#include "testing/motion/slow_checker.h"
#include "tether/motion/kernel/kernel_tables.h"

namespace tether::motion {
namespace {

using Eigen::VectorXd;

std::shared_ptr<const robot::Model> Panda() {
  static const std::shared_ptr<const robot::Model> model = robot::Model::Load("panda_flange");
  return model;
}

std::shared_ptr<const robot::Model> Jaco() {
  static const std::shared_ptr<const robot::Model> model = robot::Model::Load("j2n6s300");
  return model;
}

TEST(PathCheckerTest, AgreesWithAPlainLoopOverDistances) {
  int free = 0, blocked = 0;
  for (const auto& model : {Panda(), Jaco()}) {
    for (uint64_t seed = 1; seed <= 6; ++seed) {
      const Snapshot snapshot = RandomScene(model, seed, 10);
      const auto scene = CollisionScene::Compile(snapshot);
      PathChecker best(scene), plain(scene, Lanes::kPlain);
      Random random(seed);
      for (int i = 0; i < 60; ++i) {
        const VectorXd q = RandomConfiguration(*model, random);
        const double distance = SlowDistance(snapshot, q);
        if (std::abs(distance) < 1e-7) continue;
        EXPECT_EQ(best.IsFree(q), distance > 0) << distance;
        EXPECT_EQ(plain.IsFree(q), distance > 0) << distance;
        const auto touch = scene->FindTouch(q);
        EXPECT_EQ(touch.has_value(), distance < 0);
        if (touch) {
          EXPECT_NEAR(touch->distance, distance, 1e-9);
        }
        ++(distance > 0 ? free : blocked);
      }
    }
  }
  EXPECT_GT(free, 50);
  EXPECT_GT(blocked, 50);
}

// Clearance is kept from everything.
TEST(PathCheckerTest, KeepsTheClearance) {
  Snapshot snapshot = RandomScene(Panda(), 2, 6);
  snapshot.clearance = 0.03;
  PathChecker checker(CollisionScene::Compile(snapshot));
  Random random(1);
  int between = 0;
  for (int i = 0; i < 200; ++i) {
    const VectorXd q = RandomConfiguration(*Panda(), random);
    const double distance = SlowDistance(snapshot, q);
    EXPECT_EQ(checker.IsFree(q), distance > 0.03) << distance;
    between += distance > 0 && distance < 0.03;
  }
  EXPECT_GT(between, 5);
}

// A line that is called free is free between samples too; one that is called blocked comes near something.
TEST(PathCheckerTest, LinesAreProvedFree) {
  int free = 0, blocked = 0;
  for (uint64_t seed = 1; seed <= 2; ++seed) {
    const Snapshot snapshot = RandomScene(Panda(), seed, 8);
    PathChecker checker(CollisionScene::Compile(snapshot));
    Random random(seed);
    for (int i = 0; i < 40; ++i) {
      const VectorXd a = RandomConfiguration(*Panda(), random);
      const VectorXd b = a + 0.3 * (RandomConfiguration(*Panda(), random) - a);
      const bool is_free = checker.IsFree(a, b);
      EXPECT_EQ(checker.IsFree(b, a), is_free);
      double least = 1e300;
      for (int k = 0; k <= 150; ++k)
        least = std::min(least, SlowDistance(snapshot, a + (b - a) * (k / 150.0)));
      if (is_free) {
        EXPECT_GT(least, 0);
      }
      // What moves between the samples of this test.
      if (!is_free) {
        EXPECT_LT(least, (b - a).cwiseAbs().sum() / 150 + PathChecker::kResolution);
      }
      ++(is_free ? free : blocked);
    }
  }
  EXPECT_GT(free, 8);
  EXPECT_GT(blocked, 8);
}

// A plate of 1 mm, which samples a few centimetres apart would step over.
TEST(PathCheckerTest, ThinPlatesAreNotSteppedOver) {
  Snapshot snapshot;
  snapshot.model = Panda();
  snapshot.obstacles.push_back(
      {"plate", geometry::Shape(geometry::Box{{0.5, 0.001, 0.5}}), math::Pose(Eigen::Vector3d(0.6, 0, 0.5))});
  PathChecker checker(CollisionScene::Compile(snapshot));
  VectorXd a = Panda()->home(), b = a;
  a[0] = -0.6;
  b[0] = 0.6;
  EXPECT_TRUE(checker.IsFree(a));
  EXPECT_TRUE(checker.IsFree(b));
  EXPECT_FALSE(checker.IsFree(a, b));
}

// Beads that the arm only grazes between samples, by less than 2 mm.
TEST(PathCheckerTest, BeadsThatAreGrazedBlock) {
  Snapshot snapshot;
  snapshot.model = Panda();
  Random random(11);
  robot::Kinematics kinematics(Panda());
  int grazed = 0;
  for (int trial = 0; trial < 700; ++trial) {
    const VectorXd a = Panda()->home();
    const VectorXd b = a + (RandomConfiguration(*Panda(), random) - a).normalized() * 0.6;
    kinematics.Set(a + (b - a) * random.Uniform(0.2, 0.8));
    snapshot.obstacles = {{"bead", geometry::Shape(geometry::Sphere{0.001}),
                           math::Pose(kinematics.X_BH() * RandomPoint(random, -0.12, 0.12))}};
    double least = 1e300;
    for (int k = 0; k <= 60; ++k) least = std::min(least, SlowDistance(snapshot, a + (b - a) * (k / 60.0)));
    if (least > 0 || least < -0.002) continue;
    ++grazed;
    EXPECT_FALSE(PathChecker(CollisionScene::Compile(snapshot)).IsFree(a, b)) << least;
  }
  EXPECT_GT(grazed, 5);
}

using Pairs = std::set<std::tuple<int, int, int>>;

/// Single lanes and what was found in them.
Pairs Found(const internal::KernelAnswer& answer) {
  Pairs pairs;
  for (const auto& pair : answer.pairs) {
    for (int lane = 0; lane < internal::kLanes; ++lane) {
      if ((pair.lanes >> lane & 1) != 0) pairs.insert({pair.part, pair.other, lane});
    }
  }
  return pairs;
}

TEST(PathCheckerTest, KernelsGiveTheSameAnswers) {
  if (!internal::HaveWideKernel()) GTEST_SKIP() << "this processor has no AVX2";
  int compared = 0;
  for (uint64_t seed = 1; seed <= 10; ++seed) {
    const auto scene = CollisionScene::Compile(RandomScene(seed % 2 == 0 ? Panda() : Jaco(), seed, 10));
    Random random(seed);
    const std::vector<float> part_motion(scene->arm().size(), 0.01f),
        pair_motion(scene->pairs().size(), 0.01f);
    for (int i = 0; i < 100; ++i) {
      internal::KernelSegment segment;
      internal::KernelQuery query;
      query.part_motion = part_motion.data();
      query.part_curve = part_motion.data();
      query.pair_motion = pair_motion.data();
      query.half = 0.01f;
      query.lanes = 1 + random.Index(internal::kLanes);
      for (int j = 0; j < scene->model().dof(); ++j) {
        segment.begin[j] = static_cast<float>(random.Uniform(-3, 3));
        segment.along[j] = static_cast<float>(random.Uniform(-0.3, 0.3));
      }
      for (float& t : query.t) t = static_cast<float>(random.Uniform(0, 1));
      internal::KernelAnswer wide, plain;
      internal::CheckSpheresWide(scene->tables(), segment, query, wide);
      internal::CheckSpheresPlain(scene->tables(), segment, query, plain);
      ASSERT_EQ(wide.blocked != 0, plain.blocked != 0);
      if (wide.blocked != 0) continue;
      ++compared;
      ASSERT_EQ(wide.unsure, plain.unsure);
      ASSERT_EQ(Found(wide), Found(plain));
    }
  }
  EXPECT_GT(compared, 50);
}

}  // namespace
}  // namespace tether::motion
