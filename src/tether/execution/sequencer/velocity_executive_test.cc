#include "tether/execution/sequencer/velocity_executive.h"

#include <cmath>
#include <functional>
#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "testing/common/heap_count.h"
#include "testing/execution/fake_arm.h"
#include "tether/common/error.h"
#include "tether/geometry/distance/distance.h"
#include "tether/planning/skeleton/action_reader.h"
#include "tether/robot/kinematics.h"

namespace tether::execution {
namespace {

using Eigen::Vector3d;
using Eigen::VectorXd;
using math::Pose;
using ::testing::HasSubstr;

using Fake = FakeArm;

const std::vector<std::string> kCarry = {"move(left)",        "grasp(block,left)",  "hold(block,hub)",
                                         "hold(block,right)", "place(block,right)", "move(hub)"};

TEST(VelocityExecutiveTest, ABlockGoesFromRegionToRegion) {
  Fake fake;
  fake.Start(kCarry);
  double released = 0, done = 0;
  fake.Run(120, [&] {
    if (!fake.held.empty()) released = fake.truth.time;
    done = fake.truth.time;
  });
  ASSERT_EQ(fake.executive->status().state, ExecutiveStatus::State::kFinished) << fake.Story();
  const Vector3d p = fake.truth.X_WO["block"].p;
  // The whole footprint is in the disc: the centre is within its radius less half the block's diagonal.
  EXPECT_LT((p.head<2>() - Eigen::Vector2d(0.3, -0.35)).norm(), 0.06 - 0.036);
  EXPECT_NEAR(p.z(), 0.05, 0.004);
  EXPECT_GT(fake.truth.X_WO["block"].R(2, 2), std::cos(0.03));
  EXPECT_EQ(fake.executive->retries(), 0) << fake.Story();
  EXPECT_GT(done - released, 0.5);  // it waited
  EXPECT_EQ(fake.executive->records().size(), 7u);
}

TEST(VelocityExecutiveTest, RectanglesAreRegionsToo) {
  Fake fake;
  fake.Start(
      {"move(left)", "grasp(block,left)", "hold(block,hub)", "hold(block,square)", "place(block,square)"});
  fake.Run(120);
  ASSERT_EQ(fake.executive->status().state, ExecutiveStatus::State::kFinished) << fake.Story();
  const Vector3d p = fake.truth.X_WO["block"].p - Vector3d(0.45, 0, 0);
  EXPECT_LT(std::max(std::abs(p.x()), std::abs(p.y())), 0.06 - 0.02);
}

TEST(VelocityExecutiveTest, ARegionThatMovesIsFollowed) {
  Fake fake;
  fake.Start(kCarry);
  fake.Run(120, [&] {
    if (fake.executive->step() != 4) return;
    // The table, with all regions, creeps along y while the block is brought down.
    fake.truth.X_WO["table"].p.y() += 0.005 * fake.options.period;
  });
  ASSERT_EQ(fake.executive->status().state, ExecutiveStatus::State::kFinished) << fake.Story();
  const Vector3d p_WR = fake.truth.X_WO["table"] * Vector3d(0.3, -0.35, 0.02);
  EXPECT_LT((fake.truth.X_WO["block"].p - p_WR).head<2>().norm(), 0.06 - 0.036);
}

// cups, seed 2077: a cylinder stands on a table and trembles by hundredths of a millimetre, in turns of three
// ticks. Taken for motion, that was more than joints may change their velocity by, and the grasp stood still
// 3 mm before its pose.
TEST(VelocityExecutiveTest, WhatTremblesIsAtRest) {
  for (const int turn : {2, 3}) {
    Fake fake;
    fake.Start({"move(left)", "grasp(block,left)"});
    const Pose X_WO = fake.truth.X_WO["block"];
    int ticks = 0, sudden = 0;
    VectorXd q = Jaco()->home(), v = VectorXd::Zero(6);
    fake.Run(60, [&] {
      const VectorXd now = (fake.observations["jaco"].q - q) / fake.options.period;
      if (fake.executive->step() == 2) {
        ++ticks;
        sudden += (now - v).cwiseAbs().maxCoeff() > 0.015;
      }
      v = now;
      q = fake.observations["jaco"].q;
      if (!fake.held.empty()) return;
      const double angle = 2 * M_PI * std::round(fake.truth.time / fake.options.period) / turn;
      const Vector3d side(std::cos(angle), std::sin(angle), 0);
      fake.truth.X_WO["block"] = X_WO * Pose(math::ExpSO3(3e-4 * side), 2e-5 * side);
    });
    ASSERT_EQ(fake.executive->status().state, ExecutiveStatus::State::kFinished) << fake.Story();
    EXPECT_FALSE(fake.Happened(EventKind::kStalled)) << fake.Story();
    EXPECT_LT(sudden, 0.1 * ticks) << turn << " of " << ticks << ": only where verbs begin";
  }
}

TEST(VelocityExecutiveTest, AGraspThatFailsIsTriedAgain) {
  Fake fake;
  fake.Start(kCarry);
  bool moved = false;
  fake.Run(160, [&] {
    // The block is removed from between the fingers as they close.
    if (!moved && fake.executive->step() == 2 && fake.observations["jaco"].gripper_opening < 0.15) {
      fake.truth.X_WO["block"].p.x() -= 0.08;
      moved = true;
    }
  });
  EXPECT_TRUE(fake.Happened(EventKind::kGraspMissed, "'block'")) << fake.Story();
  EXPECT_TRUE(fake.Happened(EventKind::kRetry));
  EXPECT_EQ(fake.executive->status().state, ExecutiveStatus::State::kFinished) << fake.Story();
}

/// A pillar upon the region on the right: nothing gets there.
void BlockRight(Fake& fake) {
  scene::Object pillar;
  pillar.name = "pillar";
  pillar.shape = geometry::Primitive(geometry::Box{{0.2, 0.2, 0.8}});
  pillar.X_ParentObject = Pose(Vector3d(0.3, -0.35, 0.4));
  fake.scene.objects.push_back(pillar);
  fake.options.constraints[0].to.emplace_back("pillar");
  fake.options.max_retries = 0;
}

TEST(VelocityExecutiveTest, AnArmThatIsHeldUpSaysByWhat) {
  Fake fake;
  BlockRight(fake);
  fake.Start({"move(right)"});
  fake.Run(120);
  EXPECT_EQ(fake.executive->status().state, ExecutiveStatus::State::kFailed) << fake.Story();
  EXPECT_TRUE(fake.Happened(EventKind::kStalled, "near pillar")) << fake.Story();
  EXPECT_THAT(fake.executive->status().reason, HasSubstr("move(right): no progress"));
}

TEST(VelocityExecutiveTest, AWallIsPassedByADetour) {
  Fake fake;
  // A screen across the straight line from the left to the right: sliding along it leads nowhere.
  scene::Object screen;
  screen.name = "screen";
  screen.shape = geometry::Primitive(geometry::Box{{0.5, 0.02, 0.3}});
  screen.X_ParentObject = Pose(Vector3d(0.4, 0.02, 0.15));
  fake.scene.objects.push_back(screen);
  fake.options.constraints[0].to.emplace_back("screen");
  fake.Start({"move(left)", "move(right)"});
  double nearest = 1;
  fake.Run(160, [&] {
    const control::ConstrainedVelocity& controller = fake.executive->controller();
    for (int i = 0; i < controller.num_rows(); ++i) {
      if (controller.row(i).a >= 0) nearest = std::min(nearest, controller.row(i).value);
    }
  });
  EXPECT_EQ(fake.executive->status().state, ExecutiveStatus::State::kFinished) << fake.Story();
  EXPECT_TRUE(fake.Happened(EventKind::kStalled, "near screen")) << fake.Story();
  EXPECT_TRUE(fake.Happened(EventKind::kDetour)) << fake.Story();
  EXPECT_GT(nearest, -1e-3);  // on the detour as well
}

TEST(VelocityExecutiveTest, ABlockedActionIsReplacedByOthers) {
  Fake fake;
  BlockRight(fake);
  std::vector<std::string> done_before;
  std::string blocked_action;
  fake.options.alternative = [&](const std::vector<std::string>& done, const std::string& blocked,
                                 std::string&) -> std::optional<std::vector<std::string>> {
    done_before = done;
    blocked_action = blocked;
    return std::vector<std::string>{"hold(block,square)", "place(block,square)", "move(hub)"};
  };
  fake.Start(kCarry);
  fake.Run(200);
  ASSERT_EQ(fake.executive->status().state, ExecutiveStatus::State::kFinished) << fake.Story();
  EXPECT_EQ(blocked_action, "hold(block,right)");
  EXPECT_EQ(done_before, std::vector<std::string>(kCarry.begin(), kCarry.begin() + 3));
  EXPECT_TRUE(fake.Happened(EventKind::kReplanned, "without hold(block,right): hold(block,square)"));
  EXPECT_EQ(fake.executive->replans(), 1);
  EXPECT_EQ(fake.executive->plan().actions.size(), 6u);
  EXPECT_EQ(fake.executive->plan().steps.size(), fake.executive->records().size());
  EXPECT_LT((fake.truth.X_WO["block"].p - Vector3d(0.45, 0, 0.05)).norm(), 0.05);
}

TEST(VelocityExecutiveTest, WithoutOtherActionsTheRunFailsWithAReason) {
  Fake fake;
  BlockRight(fake);
  fake.options.alternative = [](const auto&, const std::string&,
                                std::string& reason) -> std::optional<std::vector<std::string>> {
    reason = "no other actions lead to the goal";
    return std::nullopt;
  };
  fake.Start({"move(right)"});
  fake.Run(120);
  EXPECT_EQ(fake.executive->status().state, ExecutiveStatus::State::kFailed) << fake.Story();
  EXPECT_THAT(fake.executive->status().reason,
              ::testing::AllOf(HasSubstr("move(right): no progress"), HasSubstr("near pillar"),
                               HasSubstr("no detour: "), HasSubstr("no other actions lead to the goal")));
}

TEST(VelocityExecutiveTest, TheHandOpensAsFarAsThereIsRoom) {
  // A plank beside the region on the right, where an open finger would be.
  for (const bool plank_there : {false, true}) {
    Fake fake;
    if (plank_there) {
      for (const double side : {-1.0, 1.0}) {
        scene::Object plank;
        plank.name = side < 0 ? "plank_1" : "plank_2";
        plank.shape = geometry::Primitive(geometry::Box{{0.3, 0.02, 0.1}});
        plank.X_ParentObject = Pose(Vector3d(0.3, -0.35 + side * 0.105, 0.05));
        fake.scene.objects.push_back(plank);
        fake.options.constraints[0].to.push_back(plank.name);
      }
    }
    fake.Start(kCarry);
    double nearest = 1, widest = 0;
    fake.Run(200, [&] {
      const control::ConstrainedVelocity& controller = fake.executive->controller();
      for (int i = 0; i < controller.num_rows(); ++i) {
        if (controller.row(i).a >= 0) nearest = std::min(nearest, controller.row(i).value);
      }
      if (fake.executive->step() == 5 && fake.truth.X_WO["block"].p.z() < 0.06 &&
          fake.kinematics.X_BH().p.z() < 0.08)
        widest = std::max(widest, fake.observations["jaco"].gripper_opening);
    });
    ASSERT_EQ(fake.executive->status().state, ExecutiveStatus::State::kFinished) << fake.Story();
    EXPECT_GT(nearest, -fake.options.controller.buffer - 1e-3) << plank_there;
    if (plank_there)
      EXPECT_LT(widest, 0.15) << fake.Story();
    else
      EXPECT_GT(widest, 0.17) << fake.Story();
  }
}

TEST(VelocityExecutiveTest, WhatStandsBesideAnObjectIsNoHindranceForANarrowerHand) {
  Fake fake;
  // The fingers close along y: open, they do not fit beside these.
  for (const double side : {-1.0, 1.0}) {
    scene::Object post;
    post.name = side < 0 ? "post_1" : "post_2";
    post.shape = geometry::Primitive(geometry::Box{{0.05, 0.05, 0.12}});
    post.X_ParentObject = Pose(Vector3d(0.355, 0.29 + side * 0.12, 0.06));
    fake.scene.objects.push_back(post);
    fake.options.constraints[0].to.push_back(post.name);
  }
  fake.Start({"move(left)", "grasp(block,left)", "hold(block,hub)"});
  fake.Run(120);
  EXPECT_EQ(fake.executive->status().state, ExecutiveStatus::State::kFinished) << fake.Story();
  EXPECT_TRUE(fake.Happened(EventKind::kStalled, "hand near post")) << fake.Story();
  EXPECT_TRUE(fake.Happened(EventKind::kRetry)) << fake.Story();
}

TEST(VelocityExecutiveTest, WhatStartsInAForbiddenZoneIsLeftAndSaid) {
  Fake fake;
  control::ConstraintSpec outside;
  outside.kind = "outside";
  outside.frame = "hand";
  outside.cylinder = 0.36;  // the hand starts 0.31 m from the base's axis
  outside.around = "jaco/base";
  fake.options.constraints.push_back(outside);
  fake.Start({"move(square)"});
  Vector3d before = Vector3d::Zero();
  double fastest = 0;
  fake.Run(60, [&] {
    fake.kinematics.Set(fake.observations["jaco"].q);
    const Vector3d p = fake.kinematics.X_BH().p;
    const double radius = p.head<2>().norm();
    if (before.norm() > 0 && radius < 0.36)
      fastest = std::max(fastest, (radius - before.head<2>().norm()) / fake.options.period);
    before = p;
  });
  EXPECT_EQ(fake.executive->status().state, ExecutiveStatus::State::kFinished) << fake.Story();
  EXPECT_TRUE(fake.Happened(EventKind::kSafety, "the arm leaves it at no more than 0.05 per second"))
      << fake.Story();
  EXPECT_GT(before.head<2>().norm(), 0.36);
}

// cone_ends_outside_region: where the cone is flat it was wide where the reach ended. A low hub makes it
// flat.
TEST(VelocityExecutiveTest, TheConeHoldsWhereTheReachEnds) {
  for (const double height : {0.2, 0.24}) {
    Fake fake;
    fake.scene.regions.back().X_ParentRegion.p.z() = height;
    fake.Start(kCarry);
    double widest = 0;
    fake.Run(160, [&] {
      if (fake.executive->step() != 4) return;
      for (const control::FieldConstraint& field : fake.executive->verb_fields())
        widest = field.name == "cone to right" ? 1 : widest;
    });
    ASSERT_EQ(fake.executive->status().state, ExecutiveStatus::State::kFinished) << fake.Story();
    EXPECT_EQ(widest, 1) << "the cone is among what the verb asks for";
    EXPECT_FALSE(fake.Happened(EventKind::kPlaceMissed)) << fake.Story();
    const Vector3d p = fake.truth.X_WO["block"].p;
    EXPECT_LT((p.head<2>() - Eigen::Vector2d(0.3, -0.35)).norm(), 0.06 - 0.036) << height;
  }
}

// cup_released_beside_tray: an object at the right height beside its region was released there.
TEST(VelocityExecutiveTest, NothingIsLetGoBesideItsRegion) {
  Fake fake;
  fake.options.max_retries = 0;
  // The table slides out of reach as soon as the block is brought to the right.
  fake.Start(
      {"move(left)", "grasp(block,left)", "hold(block,hub)", "hold(block,right)", "place(block,right)"});
  fake.Run(200, [&] {
    if (fake.executive->step() == 4 && fake.truth.X_WO["table"].p.y() > -0.9)
      fake.truth.X_WO["table"].p.y() -= 0.1 * fake.options.period;
  });
  EXPECT_EQ(fake.executive->status().state, ExecutiveStatus::State::kFailed) << fake.Story();
  EXPECT_THAT(fake.executive->status().reason, HasSubstr("hold(block,right): no progress"));
  EXPECT_EQ(fake.executive->held(), "block");
  EXPECT_FALSE(fake.Happened(EventKind::kReleased)) << fake.Story();
}

// What was put down and stands beside its region is grasped again.
TEST(VelocityExecutiveTest, WhatMissedItsRegionIsTakenUpAgain) {
  Fake fake;
  fake.Start(kCarry);
  bool moved = false;
  fake.Run(300, [&] {
    if (moved || !fake.Happened(EventKind::kReleased)) return;
    moved = true;
    fake.truth.X_WO["block"].p.x() -= 0.06;
  });
  EXPECT_TRUE(fake.Happened(EventKind::kPlaceMissed, "'block' is not in 'right': its footprint reaches"))
      << fake.Story();
  ASSERT_EQ(fake.executive->status().state, ExecutiveStatus::State::kFinished) << fake.Story();
  EXPECT_LT((fake.truth.X_WO["block"].p - Vector3d(0.3, -0.35, 0.05)).head<2>().norm(), 0.06 - 0.036);
}

// A place that is missed too often was passed over, and later actions began from what was not so.
TEST(VelocityExecutiveTest, WhatMissesItsRegionTooOftenFails) {
  Fake fake;
  fake.options.max_retries = 1;
  fake.Start(kCarry);
  size_t seen = 0;
  fake.Run(300, [&] {
    const std::vector<Event>& events = fake.executive->events();
    for (; seen < events.size(); ++seen) {
      if (events[seen].kind == EventKind::kReleased) fake.truth.X_WO["block"].p.x() -= 0.06;
    }
  });
  EXPECT_EQ(fake.executive->status().state, ExecutiveStatus::State::kFailed) << fake.Story();
  EXPECT_THAT(
      fake.executive->status().reason,
      ::testing::AllOf(HasSubstr("place(block,right): 'block' is not in 'right': its footprint reaches"),
                       HasSubstr("although it was grasped again 1 times")));
}

// A tin that rolled off was "9429394 mm away", and was gone after until the end.
TEST(VelocityExecutiveTest, WhatFellFarBeyondReachIsGivenUpAndSaid) {
  for (const bool falls : {true, false}) {
    Fake fake;
    fake.Start({"move(left)", "grasp(block,left)"});
    fake.Run(100, [&] {
      if (fake.executive->step() == 2)
        fake.truth.X_WO["block"].p = falls ? Vector3d(0.3, 0.3, -9429) : Vector3d(0, 3, 0);
    });
    EXPECT_EQ(fake.executive->status().state, ExecutiveStatus::State::kFailed) << fake.Story();
    EXPECT_THAT(fake.executive->status().reason,
                ::testing::AllOf(HasSubstr(falls ? "'block' is 94" : "'block' is 3.0 m from"),
                                 HasSubstr(" m from the shoulder of 'jaco', which reaches "),
                                 ::testing::Not(HasSubstr("again"))));
    EXPECT_EQ(fake.executive->retries(), 0) << fake.Story();
  }
}

// thin_mat_blocks_placing: only the mat was exempt, not the table beneath it. A block that stands on a mat is
// grasped from there as well.
TEST(VelocityExecutiveTest, WhatLiesBeneathAMatIsNoHindrance) {
  for (const bool from : {false, true}) {
    Fake fake;
    scene::Object mat;
    mat.name = "mat";
    mat.shape = geometry::Primitive(geometry::Box{{0.16, 0.16, 0.004}});
    mat.X_ParentObject = Pose(Vector3d(from ? 0.35 : 0.3, from ? 0.3 : -0.35, 0.002));
    fake.scene.objects.push_back(mat);
    scene::Region& region = fake.scene.regions[from ? 0 : 1];
    region.parent = "mat";
    region.X_ParentRegion = Pose(Vector3d(0, 0, 0.002));
    fake.Start(kCarry);
    fake.Run(160);
    ASSERT_EQ(fake.executive->status().state, ExecutiveStatus::State::kFinished) << fake.Story();
    EXPECT_FALSE(fake.Happened(EventKind::kStalled)) << from << fake.Story();
    EXPECT_FALSE(fake.Happened(EventKind::kSafety)) << from << fake.Story();
  }
}

// region_in_the_world_is_never_placed_into: only the object that a region's frame is attached to counted as
// its carrier. What carries it is what lies beneath it, whatever the frame is attached to: the world, the
// robot, or something else.
TEST(VelocityExecutiveTest, WhatLiesBeneathARegionCarriesIt) {
  for (const std::string parent : {"world", "jaco", "lamp"}) {
    for (const bool mat : {false, true}) {
      Fake fake;
      scene::Object lamp;
      lamp.name = "lamp";
      lamp.shape = geometry::Primitive(geometry::Box{{0.05, 0.05, 0.4}});
      lamp.X_ParentObject = Pose(Vector3d(-0.5, 0.5, 0.2));
      fake.scene.objects.push_back(lamp);
      lamp.name = "mat";
      lamp.shape = geometry::Primitive(geometry::Box{{0.16, 0.16, 0.004}});
      lamp.X_ParentObject = Pose(Vector3d(0.3, -0.35, 0.002));
      if (mat) fake.scene.objects.push_back(lamp);
      for (scene::Region& region : fake.scene.regions) {
        if (region.hub) continue;
        const double lift = mat && region.name == "right" ? 0.004 : 0.0;
        const Pose X_WR = fake.scene.InitialPose(region.name) * Pose(Vector3d(0, 0, lift));
        region.X_ParentRegion = fake.scene.InitialPose(parent).Inverse() * X_WR;
        region.parent = parent;
      }
      fake.Start(kCarry);
      fake.Run(160);
      EXPECT_EQ(fake.executive->status().state, ExecutiveStatus::State::kFinished) << parent << fake.Story();
      EXPECT_FALSE(fake.Happened(EventKind::kStalled)) << parent << fake.Story();
    }
  }
}

#ifdef TETHER_COUNTS_ALLOCATIONS
TEST(VelocityExecutiveTest, OnlyTheStartOfAVerbTakesFromTheHeap) {
  Fake fake;
  fake.Start(kCarry);
  size_t verbs = 0;
  for (const planning::PlanStep& step : fake.executive->plan().steps) verbs += step.execute.size();
  size_t ticks = 0, allocating = 0;
  while (fake.executive->running() && fake.truth.time < 120) {
    const size_t events = fake.executive->events().size();
    // The fake allocates as well: the executive is asked once more for the same tick's commands.
    fake.Tick();
    const long before = heap_allocations;
    fake.executive->Step(fake.truth, fake.observations);
    const bool counts = fake.executive->events().size() == events;
    ++ticks;
    allocating += counts && heap_allocations != before ? 1 : 0;
  }
  EXPECT_EQ(fake.executive->status().state, ExecutiveStatus::State::kFinished) << fake.Story();
  EXPECT_LE(allocating, verbs);
  EXPECT_GT(ticks, 20 * verbs);
}
#endif

TEST(VelocityExecutiveTest, WhatCantBeDoneIsSaidBefore) {
  const auto error_of = [](const std::vector<std::string>& actions,
                           const std::function<void(Fake&)>& change = {}) {
    Fake fake;
    if (change) change(fake);
    try {
      fake.Start(actions);
    } catch (const InputError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_EQ(error_of(kCarry), "");
  EXPECT_THAT(error_of({"mve(left)"}), HasSubstr("did you mean 'move'?"));
  EXPECT_THAT(error_of({"move(block)"}), HasSubstr("the target region 'block'"));
  EXPECT_THAT(error_of(kCarry, [](Fake& fake) { fake.scene.regions[1].X_ParentRegion.p.y() = -1.2; }),
              ::testing::AllOf(HasSubstr("region 'right' is out of reach"), HasSubstr("up to 71 cm")));
  EXPECT_THAT(error_of(kCarry, [](Fake& fake) { fake.options.controller.gain = 0; }), HasSubstr("'gain'"));
}

TEST(VelocityExecutiveTest, AnEstimateWithoutNumbersIsNotFollowed) {
  Fake fake;
  fake.Start(kCarry);
  fake.Run(1.0);
  fake.truth.X_WO["block"].p.x() = std::numeric_limits<double>::quiet_NaN();
  fake.Tick();
  EXPECT_TRUE(fake.Happened(EventKind::kEstimateInvalid, "'block'"));
  fake.observations["jaco"].q[2] = std::numeric_limits<double>::quiet_NaN();
  // The arm stops on a ramp within its limits, blindly.
  double speed = std::numeric_limits<double>::infinity();
  const auto step = [&]() -> const robot::Command& {
    fake.truth.time += fake.options.period;
    fake.observations["jaco"].time = fake.truth.time;
    return fake.executive->Step(fake.truth, fake.observations).at("jaco");
  };
  // It is borne for 20 ms.
  for (int i = 0; i < 5; ++i) ASSERT_TRUE(step().velocity.allFinite());
  for (int i = 0; i < 300 && speed > 0; ++i) {
    const robot::Command& command = step();
    ASSERT_TRUE(command.velocity.allFinite());
    ASSERT_LT(command.velocity.norm(), speed + 1e-12);
    speed = command.velocity.norm();
  }
  EXPECT_NEAR(speed, 0, 1e-9);
  EXPECT_TRUE(fake.Happened(EventKind::kFault, "the arm is stopped"));
}

}  // namespace
}  // namespace tether::execution
