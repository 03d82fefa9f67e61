#include "tether/planning/program/clearances.h"

#include <limits>
#include <set>
#include <tuple>

#include <gtest/gtest.h>

#include "testing/planning/test_scene.h"
#include "tether/common/random.h"
#include "tether/geometry/distance/distance.h"

namespace tether::planning {
namespace {

using math::Pose;

constexpr double kEverything = std::numeric_limits<double>::infinity();

/// The workspace, with the steps of a plan that pushes and places.
class ClearanceLaws : public ::testing::Test {
 protected:
  ClearanceLaws() : facts_(problem_), tree_(facts_.frames(), problem_.scene, problem_.robot.X_WHand) {
    Random random(3);
    for (const BoundStep& step : steps_) {
      EXPECT_TRUE(tree_.AddStep(step.control, step.target));
      math::Vector6d delta;
      for (int i = 0; i < 6; ++i) delta[i] = 0.2 * random.Normal();
      const int t = tree_.num_steps() - 2;
      poses_.push_back(
          math::Between(tree_.PoseAt(step.target, t, poses_), tree_.PoseAt(step.control, t, poses_)) *
          math::ExpSE3(delta));
    }
  }

  double DistanceOf(const ClearancePair& pair) const {
    const geometry::Part& a = facts_.ShapeOf(pair.a)->parts[ToIndex(pair.part_a)];
    const geometry::Part& b = facts_.ShapeOf(pair.b)->parts[ToIndex(pair.part_b)];
    return geometry::SignedDistance(a.primitive, tree_.PoseAt(pair.a, pair.step, poses_) * a.X_SP,
                                    b.primitive, tree_.PoseAt(pair.b, pair.step, poses_) * b.X_SP)
        .distance;
  }

  const Problem problem_ = ReachProblem();
  const SceneFacts facts_;
  const std::vector<BoundStep> steps_ =
      BindSkeleton(problem_, {"pick(hook)", "push(hook,box,table)", "place(hook,table)"});
  FrameTree tree_;
  std::vector<Pose> poses_;
};

// What moves at a step against what does not, part by part, each pair once: nothing is forgotten.
TEST_F(ClearanceLaws, EveryPairOfWhatMovesAndWhatDoesNotCounts) {
  Clearances clearances(facts_, steps_, tree_, {}, false);
  const std::vector<ClearancePair> all = clearances.TakeNear(tree_, poses_, kEverything);
  std::set<std::tuple<int, FrameId, FrameId, int, int>> expected, found;
  for (int t = 0; t < tree_.num_steps(); ++t) {
    const auto moves = [&](FrameId solid) {
      return solid == facts_.hand() || tree_.HangsOn(solid, steps_[ToIndex(t)].control, t);
    };
    for (const FrameId a : facts_.solids()) {
      for (const FrameId b : facts_.solids()) {
        if (!moves(a) || moves(b)) continue;
        for (int i = 0; i < static_cast<int>(facts_.ShapeOf(a)->parts.size()); ++i) {
          for (int j = 0; j < static_cast<int>(facts_.ShapeOf(b)->parts.size()); ++j)
            expected.insert({t, a, b, i, j});
        }
      }
    }
  }
  for (const ClearancePair& pair : all) {
    EXPECT_TRUE(found.insert({pair.step, pair.a, pair.b, pair.part_a, pair.part_b}).second) << "each once";
    const bool hand = pair.a == facts_.hand() || pair.b == facts_.hand();
    EXPECT_EQ(pair.clearance, hand ? problem_.program.hand_clearance : problem_.program.object_clearance);
  }
  EXPECT_EQ(found, expected);
}

TEST_F(ClearanceLaws, AContactThatAStepIntendsHasNone) {
  const FrameId hook = facts_.frames().Find("hook"), table = facts_.frames().Find("table");
  const std::vector<Exemption> exemptions = {{0, hook, table, -1}, {2, table, hook, -1}};
  Clearances clearances(facts_, steps_, tree_, exemptions, false);
  std::set<int> steps;
  for (const ClearancePair& pair : clearances.TakeNear(tree_, poses_, kEverything)) {
    if ((pair.a == hook && pair.b == table) || (pair.a == table && pair.b == hook)) steps.insert(pair.step);
  }
  EXPECT_FALSE(steps.contains(0));
  EXPECT_FALSE(steps.contains(2)) << "whichever is named first";
}

// Pairs come in growing radii, each once, and none that is nearer is left out.
TEST_F(ClearanceLaws, NearPairsComeOnceNoneIsMissed) {
  Clearances clearances(facts_, steps_, tree_, {}, true);
  size_t taken = 0;
  std::set<std::tuple<int, FrameId, FrameId, int, int>> seen;
  for (const double radius : {0.0, 0.05, 0.2, kEverything}) {
    for (const ClearancePair& pair : clearances.TakeNear(tree_, poses_, radius)) {
      EXPECT_TRUE(seen.insert({pair.step, pair.a, pair.b, pair.part_a, pair.part_b}).second);
      ++taken;
    }
    Clearances again(facts_, steps_, tree_, {}, true);
    for (const ClearancePair& pair : again.TakeNear(tree_, poses_, kEverything)) {
      if (DistanceOf(pair) >= pair.clearance + radius) continue;
      EXPECT_TRUE(seen.contains({pair.step, pair.a, pair.b, pair.part_a, pair.part_b}));
    }
  }
  EXPECT_GT(taken, 20u);
  EXPECT_TRUE(clearances.TakeNear(tree_, poses_, kEverything).empty());
  EXPECT_FALSE(clearances.AnyViolated(tree_, poses_, 0)) << "all have rows";
}

TEST_F(ClearanceLaws, AViolationIsWhatTheDistanceSays) {
  Clearances all(facts_, steps_, tree_, {}, false);
  double worst = -kEverything;
  for (const ClearancePair& pair : all.TakeNear(tree_, poses_, kEverything))
    worst = std::max(worst, pair.clearance - DistanceOf(pair));
  ASSERT_GT(worst, 0) << "poses at random overlap somewhere";
  EXPECT_TRUE(Clearances(facts_, steps_, tree_, {}, false).AnyViolated(tree_, poses_, 0.99 * worst));
  EXPECT_FALSE(Clearances(facts_, steps_, tree_, {}, false).AnyViolated(tree_, poses_, 1.01 * worst));
}

}  // namespace
}  // namespace tether::planning
