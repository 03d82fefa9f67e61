#include "tether/evaluation/judge.h"

#include <cmath>

#include <gtest/gtest.h>

#include "testing/scenario/test_scenarios.h"
#include "tether/ltl/formula/parser.h"
#include "tether/planning/modes/region_domain.h"
#include "tether/scenario/problem.h"
#include "tether/scene/resting_contact.h"

namespace tether::evaluation {
namespace {

class JudgeTest : public ::testing::Test {
 protected:
  void SetUp() override {
    scenario_ = scenario::Shipped("workspace_reach");
    task_ = scenario::MakeTask(scenario_);
    truth_.X_WO = scene::InitialPoses(scenario_.scene);
    truth_.X_WHand["panda"] = math::Pose(Eigen::Vector3d(0.4, 0, 0.3));
    truth_.contact_force = [this](const std::string& robot, const std::string& object) {
      return robot == "panda" && object == pressed_ ? 30.0 : 0.0;
    };
  }

  Judgement Judge(const std::vector<std::string>& actions, int done) const {
    return JudgeGoal(scenario_.scene, truth_, *task_, actions, done);
  }

  void PutBoxOnShelf(const Eigen::Vector3d& offset) {
    truth_.X_WO["box"] = math::Pose(Eigen::Vector3d(0.35, -0.35, 0.125) + offset);
  }

  scenario::Scenario scenario_;
  std::shared_ptr<const symbolic::Task> task_;
  Truth truth_;
  std::string pressed_;
};

TEST_F(JudgeTest, RestingIsContactFromAboveUnderTheCentreOfMass) {
  EXPECT_TRUE(IsOn(scenario_.scene, truth_, "box", "table"));
  EXPECT_TRUE(IsOn(scenario_.scene, truth_, "hook", "table"));
  EXPECT_FALSE(IsOn(scenario_.scene, truth_, "table", "box"));
  EXPECT_FALSE(IsOn(scenario_.scene, truth_, "box", "shelf"));
  EXPECT_FALSE(IsOn(scenario_.scene, truth_, "box", "nothing"));
  PutBoxOnShelf({0, 0, 0.0005});
  EXPECT_TRUE(IsOn(scenario_.scene, truth_, "box", "shelf"));
  EXPECT_FALSE(IsOn(scenario_.scene, truth_, "box", "table"));
  PutBoxOnShelf({0, 0, 0.006});
  EXPECT_FALSE(IsOn(scenario_.scene, truth_, "box", "shelf")) << "hovers";
  PutBoxOnShelf({0.152, 0, 0});
  EXPECT_FALSE(IsOn(scenario_.scene, truth_, "box", "shelf")) << "its centre of mass is over the edge";
  truth_.X_WO["box"] = math::Pose(Eigen::Vector3d(0.525, -0.35, 0.025));
  EXPECT_FALSE(IsOn(scenario_.scene, truth_, "box", "shelf")) << "leans on its side";
}

TEST_F(JudgeTest, WhatLeansOrMovesIsNotOn) {
  PutBoxOnShelf({0, 0, 0});
  EXPECT_TRUE(IsOn(scenario_.scene, truth_, "box", "shelf"));
  for (const double tilt : {0.3, 0.6}) {
    // On an edge, with the centre of mass above the shelf, as if something held it up.
    const double foot = 0.025 * (std::cos(tilt) + std::sin(tilt));
    truth_.X_WO["box"] = math::Pose(math::RotationFromRpy({tilt, 0, 0}), {0.35, -0.35, 0.1 + foot});
    EXPECT_FALSE(IsOn(scenario_.scene, truth_, "box", "shelf")) << tilt;
  }
  PutBoxOnShelf({0, 0, 0});
  truth_.X_WO["box"].R = math::RotationFromRpy({M_PI / 2, 0, 1.0});
  EXPECT_TRUE(IsOn(scenario_.scene, truth_, "box", "shelf")) << "on another face";
  truth_.X_WO_before = truth_.X_WO;
  EXPECT_TRUE(IsOn(scenario_.scene, truth_, "box", "shelf")) << "it stands still";
  truth_.X_WO_before["box"].p.x() -= 0.05 * kRestWindow;
  EXPECT_FALSE(IsOn(scenario_.scene, truth_, "box", "shelf")) << "it slides";
  truth_.X_WO_before["shelf"].p.x() -= 0.05 * kRestWindow;
  EXPECT_TRUE(IsOn(scenario_.scene, truth_, "box", "shelf")) << "it goes along";
  // Round things rest on their sides.
  const geometry::Shape can = geometry::Primitive(geometry::Cylinder{0.03, 0.1});
  EXPECT_EQ(scene::FindLean(can, -Eigen::Vector3d::UnitZ()), 0);
  EXPECT_EQ(scene::FindLean(can, Eigen::Vector3d(1, 2, 0).normalized()), 0);
  EXPECT_GT(scene::FindLean(can, Eigen::Vector3d(1, 0, -1).normalized()), 0.15);
  EXPECT_EQ(
      scene::FindLean(geometry::Primitive(geometry::Sphere{0.03}), Eigen::Vector3d(1, 2, 3).normalized()), 0);
}

TEST_F(JudgeTest, GraspedMeansPressedByTheHandAroundIt) {
  EXPECT_FALSE(IsInHand(scenario_.scene, truth_, "box"));
  pressed_ = "box";
  EXPECT_FALSE(IsInHand(scenario_.scene, truth_, "box")) << "pushed, but not between the fingers";
  truth_.X_WHand["panda"] = truth_.X_WO["box"];
  EXPECT_TRUE(IsInHand(scenario_.scene, truth_, "box"));
  EXPECT_FALSE(IsOn(scenario_.scene, truth_, "box", "table")) << "what is held does not rest";
  pressed_ = "hook";
  EXPECT_FALSE(IsInHand(scenario_.scene, truth_, "box"));
}

TEST_F(JudgeTest, TheGoalIsJudgedFromGeometryWhateverThePlanSays) {
  const std::vector<std::string> plan = {"pick(hook)", "push(hook,box,table)", "place(hook,table)",
                                         "pick(box)", "place(box,shelf)"};
  EXPECT_FALSE(Judge(plan, 5).goal_reached) << "all actions done, but the box is where it was";
  PutBoxOnShelf({0, 0, 0});
  const Judgement judgement = Judge({}, 0);
  EXPECT_TRUE(judgement.goal_reached);
  ASSERT_EQ(judgement.facts.size(), 3u);
  EXPECT_EQ(judgement.facts[2].atom, "on(box,shelf)");
  EXPECT_TRUE(judgement.facts[2].geometric);
  pressed_ = "hook";
  truth_.X_WHand["panda"] = truth_.X_WO["hook"] * math::Pose(Eigen::Vector3d(-0.1, 0.05, 0));
  EXPECT_FALSE(Judge(plan, 5).goal_reached) << "the hook is still in the hand";
}

TEST_F(JudgeTest, OtherPredicatesKeepTheirSymbolicValue) {
  scenario_.problem = symbolic::WithGoal(*scenario_.problem,
                                         "(and (inworkspace box) (forall (?m - movable) (on ?m table)))", {});
  task_ = scenario::MakeTask(scenario_);
  const std::vector<std::string> plan = {"pick(hook)", "push(hook,box,table)"};
  EXPECT_FALSE(Judge(plan, 0).goal_reached);
  EXPECT_FALSE(Judge(plan, 1).goal_reached);
  const Judgement judgement = Judge(plan, 2);
  EXPECT_TRUE(judgement.goal_reached);
  EXPECT_FALSE(judgement.facts[0].geometric);
}

TEST_F(JudgeTest, DisjunctiveGoalsLookAtEveryAtom) {
  const scenario::Scenario hanoi = scenario::Shipped("hanoi");
  const auto task = scenario::MakeTask(hanoi);
  Truth truth;
  truth.X_WO = scene::InitialPoses(hanoi.scene);
  EXPECT_FALSE(JudgeGoal(hanoi.scene, truth, *task, {}, 0).goal_reached);
  EXPECT_EQ(JudgeGoal(hanoi.scene, truth, *task, {}, 0).facts.size(), 4u);
  for (const char* box : {"box_1", "box_2", "box_3"}) truth.X_WO[box].p.y() += 0.2;
  EXPECT_TRUE(JudgeGoal(hanoi.scene, truth, *task, {}, 0).goal_reached);
}

/// A cup that is carried from one place to another.
class TemporalJudgeTest : public ::testing::Test {
 protected:
  void SetUp() override {
    scene::Object cup;
    cup.name = "cup";
    cup.shape = geometry::Shape(geometry::Box{Eigen::Vector3d(0.04, 0.04, 0.1)});
    cup.mass = 0.1;
    cup.X_ParentObject.p = {0, 0, 0.05};
    scene_.objects.push_back(cup);
    for (const auto& [name, x] : {std::pair("a", 0.0), std::pair("b", 0.5), std::pair("c", 1.0)}) {
      scene::Region region;
      region.name = name;
      region.form = scene::Disc{0.06};
      region.X_ParentRegion.p.x() = x;
      region.capacity = 1;
      scene_.regions.push_back(region);
    }
    scene_.regions.emplace_back().name = "hub";
    scene_.regions.back().form = scene::Disc{0.1};
    scene_.regions.back().hub = true;
    scene_.groups["ends"] = {"a", "c"};
    Diagnostics none;
    task_ = symbolic::Task::Ground(planning::MakeRegionProblem(scene_, {}, {}, none));
    truth_.contact_force = [this](const std::string&, const std::string&) { return held_ ? 20.0 : 0.0; };
  }

  bool Judge(const std::string& formula, const std::vector<std::pair<double, bool>>& course,
             ltl::Semantics semantics = ltl::Semantics::kCosafe) {
    TemporalJudge judge(scene_, *task_, {ltl::ParseFormula(formula), semantics, {}});
    for (const auto& [x, held] : course) {
      held_ = held;
      truth_.X_WO["cup"] = math::Pose(Eigen::Vector3d(x, 0, 0.05));
      truth_.X_WHand["arm"] = held ? truth_.X_WO["cup"] : math::Pose(Eigen::Vector3d(0, 0, 5));
      judge.Observe(truth_, {});
    }
    return judge.Judge(truth_).goal_reached;
  }

  /// The cup stands at x, in nobody's hand.
  void Stand(double x) {
    held_ = false;
    truth_.X_WO["cup"] = math::Pose(Eigen::Vector3d(x, 0, 0.05));
    truth_.X_WHand["arm"] = math::Pose(Eigen::Vector3d(0, 0, 5));
  }

  scene::Scene scene_;
  std::shared_ptr<const symbolic::Task> task_;
  Truth truth_;
  bool held_ = false;
};

TEST_F(TemporalJudgeTest, TheCourseCountsNotOnlyItsEnd) {
  const std::vector<std::pair<double, bool>> there_and_back = {
      {0, false}, {0, true}, {0.5, true}, {0.5, false}, {0.5, true}, {0, true}, {0, false}};
  EXPECT_TRUE(Judge("F(in(cup,b) & X F in(cup,a))", there_and_back));
  EXPECT_TRUE(Judge("F(in(cup,b) & X F in(cup,ends))", there_and_back));
  EXPECT_FALSE(Judge("F(in(cup,b) & X F in(cup,c))", there_and_back));
  EXPECT_FALSE(Judge("F in(cup,b)", {{0, false}, {0.5, true}})) << "held, not placed";
  EXPECT_FALSE(Judge("F in(cup,b)", {{0, false}, {0.6, false}})) << "beside it";
  EXPECT_TRUE(Judge("G !in(cup,c)", there_and_back, ltl::Semantics::kLtlf));
  EXPECT_FALSE(Judge("G !in(cup,b)", there_and_back, ltl::Semantics::kLtlf));
  EXPECT_TRUE(Judge("F inhand(cup)", there_and_back));
}

// ltl_G_violated_between_letters: invariants were blind while an action ran.
TEST_F(TemporalJudgeTest, WhatHasNoNextIsJudgedInBetweenToo) {
  const auto judge_it = [&](const std::string& formula, const std::string& running) {
    TemporalJudge judge(scene_, *task_, {ltl::ParseFormula(formula), ltl::Semantics::kLtlf, {}});
    Stand(0);
    judge.Observe(truth_, {});
    Stand(1);
    judge.Sample(truth_, running);
    Stand(0);
    judge.Sample(truth_, running);
    judge.Observe(truth_, {});
    return judge.Judge(truth_).goal_reached;
  };
  EXPECT_FALSE(judge_it("G !in(cup,c)", "move(b)"));
  EXPECT_FALSE(judge_it("in(cup,a) U in(cup,b) | G in(cup,a)", ""));
  EXPECT_TRUE(judge_it("F in(cup,c)", "move(b)"));
  EXPECT_FALSE(judge_it("F(in(cup,c) & X[!] F in(cup,a)) & G !in(cup,b)", "move(b)"))
      << "what has an X is judged where actions end";
  // What an action changes is as it was until it ends.
  EXPECT_TRUE(judge_it("G !in(cup,c)", "place(cup,c)"));
  EXPECT_FALSE(judge_it("G !in(cup,c)", "place(cup,b)"));
}

// ltl_F_latched_cup_not_in_tray: what was true once, should still be and is not was left out of the report.
TEST_F(TemporalJudgeTest, WhatHeldAndNoLongerDoesIsNamed) {
  TemporalJudge judge(scene_, *task_, {ltl::ParseFormula("F in(cup,a)"), ltl::Semantics::kCosafe, {}});
  Stand(0);
  judge.Observe(truth_, {});
  EXPECT_FALSE(judge.Judge(truth_).facts[0].lapsed);
  Stand(0.2);
  const Judgement judgement = judge.Judge(truth_);
  EXPECT_TRUE(judgement.goal_reached) << "it came about";
  ASSERT_EQ(judgement.facts.size(), 1u);
  EXPECT_EQ(judgement.facts[0].atom, "in(cup,a)");
  EXPECT_FALSE(judgement.facts[0].holds);
  EXPECT_TRUE(judgement.facts[0].lapsed);
  EXPECT_FALSE(judge.NeedsSamples());
}

}  // namespace
}  // namespace tether::evaluation
