#include "tether/execution/monitor/monitor.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "testing/execution/test_plans.h"
#include "tether/ltl/formula/parser.h"
#include "tether/symbolic/pddl/pddl.h"

namespace tether::execution {
namespace {

using Eigen::Vector3d;
using math::Pose;
using testing::HasSubstr;

constexpr const char* kDomain = R"(
(define (domain blocks)
  (:requirements :strips :typing :equality :negative-preconditions :universal-preconditions)
  (:types support - object block - support)
  (:predicates (inhand ?x - block) (on ?x - block ?y - support) (painted ?x - block))
  (:action pick
    :parameters (?x - block)
    :precondition (forall (?y - block) (and (not (inhand ?y)) (not (on ?y ?x))))
    :effect (and (inhand ?x) (forall (?y - support) (not (on ?x ?y)))))
  (:action place
    :parameters (?x - block ?y - support)
    :precondition (and (inhand ?x) (not (= ?x ?y)))
    :effect (and (on ?x ?y) (not (inhand ?x)) (painted ?x))))
)";
constexpr const char* kProblem = R"(
(define (problem stack) (:domain blocks)
  (:objects table - support a b c - block)
  (:init (on a table) (on b table) (on c table))
  (:goal (and (on a b) (painted a))))
)";

class MonitorTest : public testing::Test {
 protected:
  MonitorTest() {
    const geometry::Shape cube = geometry::Primitive(geometry::Box{{0.05, 0.05, 0.05}});
    scene_.objects.push_back(MakeObject("a", cube, Pose(Vector3d(0.4, 0, 0.025))));
    scene_.objects.push_back(MakeObject("b", cube, Pose(Vector3d(0.5, 0.2, 0.025))));
    scene_.objects.push_back(MakeObject("c", cube, Pose(Vector3d(0.6, -0.2, 0.025))));
    for (const scene::Object& object : scene_.objects)
      objects_.push_back({scene_.InitialPose(object.name), math::Vector6d::Zero()});
    task_ =
        symbolic::Task::Ground(symbolic::ParseProblem(kProblem, "p", symbolic::ParseDomain(kDomain, "d")));
    monitor_ = std::make_unique<Monitor>(scene_, task_, std::vector<std::string>{"pick(a)", "place(a,b)"});
  }

  void Move(const std::string& object, const Vector3d& p,
            const Eigen::Matrix3d& R = Eigen::Matrix3d::Identity()) {
    objects_[scene_.FindObjectId(object)].X = Pose(R, p);
  }
  void Watch(double seconds, int running, const std::string& held = "") {
    const ObjectId hand = held.empty() ? ObjectId() : scene_.FindObjectId(held);
    for (const double end = time_ + seconds; time_ < end; time_ += 0.01)
      monitor_->Observe(time_, objects_, hand, running);
  }
  std::vector<std::string> Facts(const std::string& held = "") const {
    const ObjectId hand = held.empty() ? ObjectId() : scene_.FindObjectId(held);
    std::vector<std::string> names;
    for (const symbolic::Fact& fact : monitor_->Facts(time_, objects_, hand))
      names.push_back(task_->AtomName({fact.predicate, fact.arguments}));
    return names;
  }

  scene::Scene scene_ = TableScene();
  IndexedVector<ObjectId, control::MovingPose> objects_;
  std::shared_ptr<const symbolic::Task> task_;
  std::unique_ptr<Monitor> monitor_;
  double time_ = 0;
};

TEST_F(MonitorTest, APlanThatGoesAsItShouldIsLeftAlone) {
  Watch(0.5, 0);
  Move("a", {0.4, 0, 0.2});
  Watch(0.5, 0, "a");  // lifted: among the effects of pick(a)
  monitor_->Finish(0);
  Watch(0.5, 1, "a");
  Move("a", {0.5, 0.2, 0.075});
  Watch(0.5, 1);
  monitor_->Finish(1);
  Watch(0.5, -1);
  EXPECT_FALSE(monitor_->changed());
  EXPECT_TRUE(monitor_->Look(2).reaches);
  EXPECT_THAT(Facts(), testing::UnorderedElementsAre("on(a,b)", "on(b,table)", "on(c,table)", "painted(a)"));
}

TEST_F(MonitorTest, SomethingPutOnWhatIsToBeGraspedIsNamed) {
  Watch(0.5, 0);
  Move("c", {0.4, 0, 0.075});
  Watch(0.1, 0);
  EXPECT_FALSE(monitor_->changed()) << "not for long enough yet";
  Watch(0.2, 0);
  ASSERT_TRUE(monitor_->changed());
  const PlanOutlook outlook = monitor_->Look(0);
  EXPECT_FALSE(outlook.reaches);
  EXPECT_THAT(outlook.reason, HasSubstr("on(c,a) holds"));
  EXPECT_THAT(outlook.reason, HasSubstr("pick(a) is not possible"));
  EXPECT_THAT(Facts(), testing::UnorderedElementsAre("on(a,table)", "on(b,table)", "on(c,a)"));
}

TEST_F(MonitorTest, WhatTheGoalNeedsAndIsUndoneAfterTheLastActionIsSeen) {
  Watch(0.2, 0);
  monitor_->Finish(0);
  Move("a", {0.5, 0.2, 0.075});
  Watch(0.2, 1);
  monitor_->Finish(1);
  Move("a", {0.2, 0.2, 0.025});
  Watch(0.3, -1);
  const PlanOutlook outlook = monitor_->Look(2);
  EXPECT_FALSE(outlook.reaches);
  EXPECT_THAT(outlook.reason, HasSubstr("on(a,b) no longer holds"));
  EXPECT_THAT(outlook.reason, HasSubstr("the goal is not reached"));
}

// What has nothing to do with the plan changes nothing.
TEST_F(MonitorTest, OtherChangesLeaveThePlanAsItIs) {
  Watch(0.2, 0);
  Move("c", {0.7, 0.3, 0.2});  // in the air
  Watch(0.3, 0);
  EXPECT_TRUE(monitor_->changed());
  EXPECT_TRUE(monitor_->Look(0).reaches);
}

// What was dropped a moment ago is not in the hand.
TEST_F(MonitorTest, FactsAreThoseOfTheMoment) {
  Watch(0.2, 0);
  Move("a", {0.4, 0, 0.2});
  Watch(0.5, 0, "a");
  monitor_->Finish(0);
  Watch(0.5, 1, "a");
  EXPECT_THAT(Facts("a"), testing::Contains("inhand(a)"));
  EXPECT_THAT(Facts(), testing::Not(testing::Contains("inhand(a)")));
}

TEST_F(MonitorTest, LeaningIsNotOn) {
  Watch(0.2, 0);
  const Eigen::Matrix3d leaning = math::ExpSO3({0, 0.4, 0});
  Move("c", {0.6, -0.2, 0.0325}, leaning);
  Watch(0.3, 0);
  EXPECT_THAT(Facts(), testing::UnorderedElementsAre("on(a,table)", "on(b,table)"));
}

TEST_F(MonitorTest, NoiseDoesNotFlicker) {
  Watch(0.2, 0);
  for (int i = 0; i < 200; ++i) {
    Move("c", {0.6, -0.2, 0.025 + (i % 3 == 0 ? 0.009 : 0.0)});
    Watch(0.02, 0);
  }
  EXPECT_FALSE(monitor_->changed());
}

// A temporal goal counts letters that have been read: what is planned anew goes on from there.
TEST_F(MonitorTest, ATemporalGoalRemembersWhatWasDone) {
  const task::TemporalGoal goal{
      ltl::ParseFormula("F(on(a,b) & X[!] F on(a,c)) & G !on(b,c)"), ltl::Semantics::kLtlf, {}};
  const std::vector<std::string> plan = {"pick(a)", "place(a,b)", "pick(a)", "place(a,c)"};
  monitor_ = std::make_unique<Monitor>(scene_, task_, plan, goal);
  EXPECT_TRUE(monitor_->Look(0).reaches);
  monitor_->Finish(0);
  monitor_->Finish(1);
  Move("a", {0.5, 0.2, 0.075});
  EXPECT_EQ(monitor_->Goal()->read.size(), 2) << "the start and in the hand; that it is on b is now";
  Watch(0.3, -1);
  EXPECT_TRUE(monitor_->Look(2).reaches);
  EXPECT_FALSE(monitor_->Look(4).reaches) << "without the last two actions it was never on c";
  // Taken down again: on(a,b) has been, and need not be again.
  Move("a", {0.4, 0, 0.025});
  Watch(0.3, -1);
  EXPECT_TRUE(monitor_->Look(2).reaches);
  EXPECT_EQ(monitor_->Goal()->read.size(), 3);
  task::TemporalGoal left = *monitor_->Goal();
  monitor_->Adopt(task_, {"pick(a)", "place(a,c)"}, 2, left);
  EXPECT_TRUE(monitor_->Look(2).reaches);
}

TEST_F(MonitorTest, APartOfATemporalGoalThatWasBrokenStaysSo) {
  const task::TemporalGoal goal{ltl::ParseFormula("F on(a,b) & G !on(c,b)"), ltl::Semantics::kLtlf, {}};
  monitor_ =
      std::make_unique<Monitor>(scene_, task_, std::vector<std::string>{"pick(a)", "place(a,b)"}, goal);
  Watch(0.3, -1);
  Move("c", {0.5, 0.2, 0.075});
  Watch(0.3, -1);
  EXPECT_FALSE(monitor_->Look(0).reaches);
  EXPECT_THAT(monitor_->Look(0).reason, HasSubstr("on(c,b) holds"));
}

TEST_F(MonitorTest, WhatIsNotSeenIsNowhere) {
  Watch(0.3, -1);
  objects_[scene_.FindObjectId("c")].seen = false;
  Watch(0.3, -1);
  EXPECT_THAT(Facts(), testing::UnorderedElementsAre("on(a,table)", "on(b,table)"));
}

// :init is authoritative: what geometry contradicts from the start is not corrected.
TEST_F(MonitorTest, WhatIsStatedAgainstGeometryStaysAsStated) {
  Move("c", {0.4, 0, 0.075});
  Watch(1, 0);
  EXPECT_FALSE(monitor_->changed());
  EXPECT_TRUE(monitor_->Look(0).reaches);
}

}  // namespace
}  // namespace tether::execution
