#include <map>
#include <set>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "testing/execution/test_plans.h"
#include "tether/common/random.h"
#include "tether/execution/contact/after_contact.h"
#include "tether/execution/contact/carriers.h"
#include "tether/execution/contact/supports.h"
#include "tether/execution/contact/touch.h"

namespace tether::execution {
namespace {

using math::Pose;
using ::testing::ElementsAre;
using ::testing::IsEmpty;

const ObjectId kTable(0), kBox(1), kOther(2);

TEST(TouchListTest, HoldsEachPairOnceInAnyOrder) {
  Random random(7);
  TouchList list;
  std::set<std::pair<int, int>> slow;
  for (int i = 0; i < 200; ++i) {
    const ObjectId a(random.Index(6) - 1), b(random.Index(6) - 1);
    list.Allow(a, b);
    if (a != b) slow.insert(std::minmax(a.value(), b.value()));
    for (int x = -1; x < 5; ++x) {
      for (int y = -1; y < 5; ++y) {
        EXPECT_EQ(list.Allows(ObjectId(x), ObjectId(y)), slow.contains(std::minmax(x, y)));
      }
    }
  }
  EXPECT_EQ(list.pairs().size(), slow.size());
  for (const auto& [first, second] : list.pairs()) EXPECT_NE(second, kTouchingHand);
}

/// Two cubes on a table, the first picked up and put on the other.
class ContactTest : public ::testing::Test {
 protected:
  ContactTest() {
    const geometry::Shape cube = geometry::Primitive(geometry::Box{{0.05, 0.05, 0.05}});
    scene_ = TableScene();
    scene_.objects.push_back(MakeObject("box", cube, Pose(Eigen::Vector3d(0.5, 0.15, 0.025))));
    scene_.objects.push_back(MakeObject("other", cube, Pose(Eigen::Vector3d(0.5, 0.0995, 0.025))));
    scene_.objects[1].parent = "table";
    scene_.objects[1].X_ParentObject.p.z() += 0.25;
    scene_.objects[1].X_ParentObject.p.x() -= 0.5;
    const planning::Plan plan = PlanBuilder()
                                    .Pick("box", TopGrasp({0, 0, 0}))
                                    .Place("box", "other", Pose(Eigen::Vector3d(0, 0, 0.05)))
                                    .Build();
    situation_ = std::make_unique<Situation>(scene_, Resolve(scene_, plan), models_);
    s().X_WH = s().X_WO(kBox) * TopGrasp({0, 0, 0});
  }
  Situation& s() { return *situation_; }
  void Lift(double height) {
    s().objects[kBox].X.p.z() += height;
    s().X_WH.p.z() += height;
  }
  void Move(ObjectId object, const Eigen::Vector3d& v) { s().objects[object].V.head<3>() = v; }

  std::map<std::string, std::shared_ptr<const robot::Model>> models_{{"panda", robot::Model::Load("panda")}};
  scene::Scene scene_;
  std::unique_ptr<Situation> situation_;
};

TEST_F(ContactTest, BodiesOfTheHandAreAllThatMoveWithIt) {
  std::vector<control::Solid> solids;
  for (const scene::Object& object : scene_.objects) solids.push_back({object.name, object.shape, false});
  const control::ArmBodies bodies(models_["panda"], solids);
  TouchList list;
  list.Allow(kBox, kTouchingHand);
  list.Allow(kBox, kOther);
  std::vector<std::pair<int, int>> pairs = {{1, 2}}, slow;
  FindBodies(list, bodies, &pairs);
  for (int body = 0; body <= bodies.hand(); ++body) {
    if (bodies.link(body) == models_["panda"]->dof()) slow.emplace_back(body, bodies.object(1));
  }
  slow.emplace_back(bodies.object(1), bodies.object(2));
  EXPECT_EQ(pairs, slow);
}

TEST_F(ContactTest, SupportsAreWhatIsTouchedUntilItIsClear) {
  Supports supports(s(), {.touching = 0.004, .clear = 0.01});
  supports.Find();
  EXPECT_THAT(supports.list(), IsEmpty()) << "nothing is held";
  s().held = kBox;
  supports.Find();
  EXPECT_THAT(supports.list(), ElementsAre(kTable, kOther)) << "its neighbour is half a millimetre away";
  Lift(0.009);
  EXPECT_FALSE(supports.Watch());
  Lift(0.002);
  EXPECT_TRUE(supports.Watch());
  EXPECT_THAT(supports.list(), ElementsAre(kOther));
  Lift(-0.011);
  EXPECT_FALSE(supports.Watch()) << "what was left is not touched again";
  EXPECT_THAT(supports.list(), ElementsAre(kOther));
  s().held = kNone;
  supports.Find();
  EXPECT_THAT(supports.list(), IsEmpty());
}

TEST_F(ContactTest, WhatCarriesAnObjectIsWhatItWasPutOnLast) {
  EXPECT_EQ(CarrierOf(s(), kBox), kTable);
  EXPECT_EQ(CarrierOf(s(), kOther), kNone) << "it stands in the world";
  s().step = 1;
  EXPECT_EQ(CarrierOf(s(), kBox), kOther);
  EXPECT_TRUE(IsCarriedBy(s(), kOther, kBox));
  EXPECT_FALSE(IsCarriedBy(s(), kBox, kOther));
  s().step = 2;
  EXPECT_EQ(CarrierOf(s(), kBox), kOther) << "after the end as well";
}

TEST_F(ContactTest, MotionGoesAlongWithWhatMovesUntilItIsClear) {
  Supports supports(s(), {});
  AfterContact after(s(), supports);
  s().held = kBox;
  supports.Find();
  after.Start();
  EXPECT_FALSE(after.NextFrame(kNone)) << "nothing moves";
  Move(kTable, {0.006, 0, 0});
  const auto along = after.NextFrame(kNone);
  ASSERT_TRUE(along);
  EXPECT_EQ(along->object, kTable);
  Move(kTable, {0, 0, 0});
  EXPECT_FALSE(after.NextFrame(kTable)) << "it is still touched";
  Lift(0.2);
  const auto clear = after.NextFrame(kTable);
  ASSERT_TRUE(clear);
  EXPECT_EQ(clear->object, kNone);
  Lift(-0.2);
  Move(kTable, {0.006, 0, 0});
  EXPECT_FALSE(after.NextFrame(kNone)) << "once clear, it stays so until the next motion";
  after.Start();
  EXPECT_TRUE(after.NextFrame(kNone));
}

TEST_F(ContactTest, WhereThePlanDoesNotSayItTheHeldObjectGoesAlongWithWhatItTouched) {
  s().stands_on[kBox] = kNone;
  Supports supports(s(), {});
  AfterContact after(s(), supports);
  s().held = kBox;
  EXPECT_EQ(after.Now().frame.object, kNone);
  supports.Find();
  EXPECT_EQ(after.Now().frame.object, kTable);
}

TEST_F(ContactTest, ARecoveryGoesOnWithWhatWasTouchedAsItBegan) {
  Supports supports(s(), {});
  AfterContact after(s(), supports);
  s().held = kBox;
  supports.Find();
  after.Remember();
  s().held = kNone;
  s().recovering = true;
  EXPECT_EQ(after.Now().held, kBox);
  EXPECT_EQ(after.Now().frame.object, kTable);
}

TEST_F(ContactTest, WhatIsHeldAboveACarrierCannotKeepAwayFromWhatThatLiesOn) {
  s().held = kBox;
  s().objects[kOther].X.p = {0.5, -0.3, 0.025};
  std::vector<ObjectId> found;
  AddBeneath(s(), kOther, &found);
  EXPECT_THAT(found, IsEmpty()) << "it is not above that";
  s().objects[kBox].X.p = {0.5, -0.3, 0.2};
  AddBeneath(s(), kOther, &found);
  AddBeneath(s(), kOther, &found);
  EXPECT_THAT(found, ElementsAre(kTable)) << "each once";
}

}  // namespace
}  // namespace tether::execution
