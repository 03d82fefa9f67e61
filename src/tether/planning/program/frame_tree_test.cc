#include "tether/planning/program/frame_tree.h"

#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tether/common/random.h"

namespace tether::planning {
namespace {

using math::Pose;

Pose RandomPose(Random& random) {
  math::Vector6d delta;
  for (int i = 0; i < 6; ++i) delta[i] = random.Uniform(-1, 1);
  return math::ExpSE3(delta);
}

double Difference(const Pose& a, const Pose& b) { return (a.R - b.R).norm() + (a.p - b.p).norm(); }

/// Objects on one another at random, a region, a robot, and a skeleton that attaches them to one another;
/// what a step would attach to a descendant of itself is refused.
class FrameTreeLaws : public ::testing::TestWithParam<int> {
 protected:
  FrameTreeLaws() {
    Random random(static_cast<uint64_t>(GetParam()));
    const auto parent = [&](int before) {
      const int i = random.Index(before + 1);
      return i == 0 ? std::string(scene::kWorld) : "o" + std::to_string(i - 1);
    };
    for (int i = 0; i < 7; ++i) {
      scene::Object object;
      object.name = "o" + std::to_string(i);
      object.parent = parent(i);
      object.X_ParentObject = RandomPose(random);
      scene_.objects.push_back(object);
    }
    scene_.regions.push_back({"region", scene::Disc{0.1}, parent(7), RandomPose(random)});
    scene_.robots.push_back({"robot", "panda", {}, parent(7), RandomPose(random)});
    X_WHand_ = RandomPose(random);
    const scene::Frames frames(scene_);
    tree_.emplace(frames, scene_, X_WHand_);
    for (int tries = 0; tries < 30; ++tries) {
      const FrameId control(1 + random.Index(static_cast<int>(frames.size()) - 1));
      const FrameId target(random.Index(static_cast<int>(frames.size())));
      const bool circle = tree_->HangsOn(target, control, tree_->num_steps() - 1);
      const int before = tree_->num_steps();
      EXPECT_EQ(tree_->AddStep(control, target), !circle);
      EXPECT_EQ(tree_->num_steps(), before + (circle ? 0 : 1));
      if (circle) continue;
      controls_.push_back(control);
      targets_.push_back(target);
      variables_.push_back(RandomPose(random));
    }
  }

  IdRange<FrameId> frames() const { return scene::Frames(scene_).ids(); }

  scene::Scene scene_;
  Pose X_WHand_;
  std::optional<FrameTree> tree_;
  std::vector<FrameId> controls_, targets_;
  std::vector<Pose> variables_;
};

// Paper A, eq. (19): the pose of a frame in its parent is the variable of the last step that moved it.
TEST_P(FrameTreeLaws, TheLastStepThatMovedAFrameSaysWhereItHangs) {
  const scene::Frames frames(scene_);
  for (int step = -1; step < tree_->num_steps(); ++step) {
    for (const FrameId frame : frames.ids()) {
      int last = -1;
      for (int s = 0; s <= step; ++s) {
        if (controls_[ToIndex(s)] == frame) last = s;
      }
      EXPECT_EQ(tree_->LastMoved(frame, step), last);
      EXPECT_EQ(tree_->ParentAt(frame, step), last < 0 ? frames.Parent(frame) : targets_[ToIndex(last)]);
    }
  }
}

// Paper A, eq. (18): a pose in the world is that of the parent, times the pose in it.
TEST_P(FrameTreeLaws, PosesAreThoseOfTheParentsTimesOnesOwn) {
  const scene::Frames frames(scene_);
  for (int step = -1; step < tree_->num_steps(); ++step) {
    FrameTree::Poses all;
    tree_->PosesAt(step, variables_, all);
    for (const FrameId frame : frames.ids()) {
      const Pose X_WF = tree_->PoseAt(frame, step, variables_);
      EXPECT_LT(Difference(all[frame], X_WF), 1e-12);
      if (frame == scene::Frames::world()) {
        EXPECT_EQ(Difference(X_WF, Pose()), 0);
        continue;
      }
      const int last = tree_->LastMoved(frame, step);
      const FrameId parent = tree_->ParentAt(frame, step);
      const Pose X_WP = tree_->PoseAt(parent, step, variables_);
      const Pose X_PF = last >= 0
                            ? variables_[ToIndex(last)]
                            : math::Between(tree_->PoseAt(parent, -1, {}), tree_->PoseAt(frame, -1, {}));
      EXPECT_LT(Difference(X_WF, X_WP * X_PF), 1e-12);
    }
  }
}

// Residuals compose chains link by link, the checker asks for poses: the same to the last bit.
TEST_P(FrameTreeLaws, ChainsComposeToThePose) {
  for (int step = -1; step < tree_->num_steps(); ++step) {
    for (const FrameId frame : frames()) {
      Pose X_WF;
      bool given = false;
      for (const ChainLink& link : tree_->ChainTo(frame, step)) {
        EXPECT_NE(link.variable < 0, link.parameter < 0);
        EXPECT_LE(link.variable, step) << "later steps do not count";
        EXPECT_FALSE(given && link.variable < 0) << "neighbouring given links are merged";
        given = link.variable < 0;
        X_WF = X_WF * (link.variable < 0 ? tree_->parameters()[ToIndex(link.parameter)]
                                         : variables_[ToIndex(link.variable)]);
      }
      EXPECT_EQ(Difference(X_WF, tree_->PoseAt(frame, step, variables_)), 0);
    }
  }
}

TEST_P(FrameTreeLaws, AFrameHangsOnItselfAndOnWhatItsParentHangsOn) {
  for (int step = -1; step < tree_->num_steps(); ++step) {
    for (const FrameId frame : frames()) {
      EXPECT_TRUE(tree_->HangsOn(frame, frame, step));
      EXPECT_TRUE(tree_->HangsOn(frame, scene::Frames::world(), step)) << "there are no circles";
      const FrameId parent = tree_->ParentAt(frame, step);
      for (const FrameId other : frames()) {
        if (other == frame) continue;
        EXPECT_EQ(tree_->HangsOn(frame, other, step), parent.valid() && tree_->HangsOn(parent, other, step));
      }
    }
  }
}

// Moving the world moves every pose, and no pose within it: chains, and so programs, stay as they are.
TEST_P(FrameTreeLaws, MovingTheWorldMovesEveryPoseAlike) {
  Random random(static_cast<uint64_t>(GetParam()) + 100);
  const Pose X = RandomPose(random);
  scene::Scene moved = scene_;
  for (scene::Object& object : moved.objects) {
    if (object.parent == scene::kWorld) object.X_ParentObject = X * object.X_ParentObject;
  }
  for (scene::Region& region : moved.regions) {
    if (region.parent == scene::kWorld) region.X_ParentRegion = X * region.X_ParentRegion;
  }
  for (scene::Robot& robot : moved.robots) {
    if (robot.parent == scene::kWorld) robot.X_ParentBase = X * robot.X_ParentBase;
  }
  std::vector<Pose> variables = variables_;
  for (size_t s = 0; s < variables.size(); ++s) {
    if (targets_[s] == scene::Frames::world()) variables[s] = X * variables[s];
  }
  FrameTree tree = *tree_;
  tree.MoveTo(moved, X * X_WHand_);
  for (int step = -1; step < tree.num_steps(); ++step) {
    for (const FrameId frame : frames()) {
      EXPECT_EQ(tree.ChainTo(frame, step), tree_->ChainTo(frame, step));
      if (frame == scene::Frames::world()) continue;
      EXPECT_LT(Difference(tree.PoseAt(frame, step, variables), X * tree_->PoseAt(frame, step, variables_)),
                1e-12);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Seeds, FrameTreeLaws, ::testing::Range(1, 9));

}  // namespace
}  // namespace tether::planning
