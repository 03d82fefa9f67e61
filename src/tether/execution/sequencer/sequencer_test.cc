#include "tether/execution/sequencer/sequencer.h"

#include <deque>
#include <map>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "testing/execution/test_plans.h"
#include "tether/common/random.h"
#include "tether/execution/sequencer/resolved_plan.h"

namespace tether::execution {
namespace {

using math::Pose;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

/// Motions end as the test says, at once if it says nothing; the hand stays where it is put.
class ScriptedServo final : public Servo {
 public:
  ScriptedServo(Situation& situation, std::deque<Progress>* reaches, Pose* X_WH)
      : s_(situation), reaches_(reaches), X_WH_(X_WH) {}

  void Prepare(robot::Commands* commands) const override { (*commands)[s_.robot]; }
  void Sense() override { s_.X_WH = *X_WH_; }
  void Begin() override {}
  void BeginStep() override {}
  void BeginVerb() override {}
  Progress Reach(const planning::ReachVerb& /*reach*/) override {
    if (reaches_->empty()) return Progress::Done();
    const Progress next = reaches_->front();
    reaches_->pop_front();
    return next;
  }
  Progress Shift(const planning::ShiftVerb& /*shift*/) override { return Progress::Done(); }
  void Rest(bool /*first*/) override {}
  double WidestOpening() override { return 0.08; }
  void HeldChanged() override {}
  void Stop() override {}
  void Command(const robot::Observations& /*observations*/, robot::Commands* /*commands*/) override {}

 private:
  Situation& s_;
  std::deque<Progress>* reaches_;
  Pose* X_WH_;
};

/// Picks a cube up and puts it on another one; fingers follow their command at once.
class SequencerTest : public ::testing::Test {
 protected:
  SequencerTest() {
    const geometry::Shape cube = geometry::Primitive(geometry::Box{{0.05, 0.05, 0.05}});
    scene_ = TableScene();
    scene_.objects.push_back(MakeObject("box", cube, Pose(Eigen::Vector3d(0.5, 0.15, 0.025))));
    scene_.objects.push_back(MakeObject("other", cube, Pose(Eigen::Vector3d(0.5, -0.15, 0.025))));
    for (const auto& object : scene_.objects) estimate_.X_WO[object.name] = scene_.InitialPose(object.name);
    X_WH_ = estimate_.X_WO["box"] * TopGrasp({0, 0, 0});
    robot::Observation& seen = observations_["panda"];
    seen.q = models_["panda"]->home();
    seen.v = seen.tau_external = Eigen::VectorXd::Zero(7);
    seen.gripper_opening = 0.08;
  }

  void Start() {
    const planning::Plan plan = PlanBuilder()
                                    .Pick("box", TopGrasp({0, 0, 0}))
                                    .Place("box", "other", Pose(Eigen::Vector3d(0, 0, 0.05)))
                                    .Build();
    const Sequencer::Resolver resolve = [this](planning::Plan next) {
      return Resolve(scene_, std::move(next));
    };
    sequencer_ = std::make_unique<Sequencer>(
        std::make_unique<Situation>(scene_, Resolve(scene_, plan), models_),
        [this](Situation& situation) {
          return std::make_unique<ScriptedServo>(situation, &reaches_, &X_WH_);
        },
        resolve, options_);
  }

  void Run(double seconds) {
    for (const double end = estimate_.time + seconds; sequencer_->running() && estimate_.time < end;) {
      robot::Observation& seen = observations_["panda"];
      estimate_.time = seen.time += options_.period;
      const robot::GripperCommand& gripper = sequencer_->Step(estimate_, observations_).at("panda").gripper;
      const bool closes = gripper.mode == robot::GripperCommand::Mode::kForce;
      if (estimate_.time >= stuck_until_) seen.gripper_opening = closes ? closed_width_ : gripper.opening;
    }
  }

  /// The kinds of what happened but for the beginnings and ends of steps, and what is gripped harder.
  std::vector<std::string> Story() const {
    std::vector<std::string> kinds;
    for (const Event& event : sequencer_->events()) {
      if (event.kind != EventKind::kStepStarted && event.kind != EventKind::kStepFinished &&
          event.kind != EventKind::kSafety)
        kinds.emplace_back(ToString(event.kind));
    }
    return kinds;
  }

  std::map<std::string, std::shared_ptr<const robot::Model>> models_ = {
      {"panda", robot::Model::Load("panda")}};
  scene::Scene scene_;
  SequencerOptions options_;
  scene::WorldEstimate estimate_;
  robot::Observations observations_;
  std::deque<Progress> reaches_;
  double stuck_until_ = 0;  ///< The gripper does not answer until then, s.
  Pose X_WH_;
  double closed_width_ = 0.05;
  std::unique_ptr<Sequencer> sequencer_;
};

TEST_F(SequencerTest, TakesStepsOneAfterAnother) {
  Start();
  Run(10);
  EXPECT_EQ(sequencer_->status().state, ExecutiveStatus::State::kFinished);
  EXPECT_THAT(Story(), ElementsAre("action_started", "grasped", "action_started", "released", "finished"));
  EXPECT_EQ(sequencer_->step(), 2);
  EXPECT_EQ(sequencer_->held(), "");
  for (const StepRecord& record : sequencer_->records()) EXPECT_EQ(record.attempts, 1);
}

TEST_F(SequencerTest, TriesAgainAsOftenAsAllowed) {
  options_.max_retries = 2;
  for (int i = 0; i < 3; ++i)
    reaches_.push_back(Progress::Retry(EventKind::kStalled, "it stalled", 0, false));
  Start();
  Run(10);
  EXPECT_THAT(Story(), ElementsAre("action_started", "stalled", "retry", "action_started", "stalled", "retry",
                                   "action_started", "stalled", "failed"));
  EXPECT_EQ(sequencer_->status().reason, "pick(box): it stalled");
  EXPECT_EQ(sequencer_->retries(), 2);
  // find overspeed_out_of_reach: both retries were spent within 1.7 s, the last one 42 ms after it had begun.
  double last = -1e9;
  for (const Event& event : sequencer_->events()) {
    if (event.kind != EventKind::kRetry && event.kind != EventKind::kFailed) continue;
    EXPECT_GE(event.time - last, options_.retry_spacing - 1e-9) << event.text;
    last = event.time;
  }
}

TEST_F(SequencerTest, WhatSlipsAwayIsGraspedAgain) {
  Start();
  while (sequencer_->held().empty() || sequencer_->step() == 0) {
    if (sequencer_->step() == 0 && !sequencer_->held().empty()) reaches_.assign(2000, Progress::Running());
    Run(0.0005);
  }
  // What jumps may be noise: how it lies in the hand is weighed over 0.3 s.
  estimate_.X_WO["box"].p.x() += 0.05;
  Run(0.04);
  EXPECT_EQ(sequencer_->held(), "box") << "not at once";
  Run(0.4);
  EXPECT_EQ(sequencer_->held(), "");
  EXPECT_EQ(sequencer_->step(), 0) << "where it was grasped";
  X_WH_ = estimate_.X_WO["box"] * TopGrasp({0, 0, 0});
  reaches_.clear();
  Run(10);
  EXPECT_EQ(sequencer_->status().state, ExecutiveStatus::State::kFinished);
  EXPECT_THAT(Story(), ElementsAre("action_started", "grasped", "action_started", "grasp_lost", "retry",
                                   "action_started", "grasped", "action_started", "released", "finished"));
}

TEST_F(SequencerTest, FingersThatCloseOnNothingHaveMissed) {
  closed_width_ = 0;
  options_.max_retries = 0;
  Start();
  Run(10);
  EXPECT_THAT(Story(), ElementsAre("action_started", "grasp_missed", "failed"));
  EXPECT_EQ(sequencer_->status().reason, "pick(box): the gripper closed on nothing instead of 'box'");
}

// Giving up asks for other actions, and failing does not; what is done stays done.
TEST_F(SequencerTest, OtherActionsTakeThePlaceOfWhatIsGivenUp) {
  std::vector<std::string> asked;
  options_.alternative = [&](const std::vector<std::string>& done, const std::string& blocked,
                             std::string& reason) -> std::optional<std::vector<std::string>> {
    asked = done;
    asked.push_back("instead of " + blocked);
    reason = "there are none";
    return std::nullopt;
  };
  reaches_ = {Progress::Done(), Progress::Done(), Progress::GiveUp(EventKind::kStalled, "out of reach")};
  Start();
  Run(10);
  EXPECT_THAT(asked, ElementsAre("pick(box)", "instead of place(box,other)"));
  EXPECT_EQ(sequencer_->status().reason, "place(box,other): out of reach; there are none");

  asked.clear();
  reaches_ = {Progress::Failed(EventKind::kFailed, "it broke")};
  Start();
  Run(10);
  EXPECT_THAT(asked, ElementsAre());
  EXPECT_THAT(sequencer_->status().reason, HasSubstr("it broke"));
}

TEST_F(SequencerTest, MeasurementsThatAreNotFiniteStopTheArmAndFailTheRunIfTheyLast) {
  for (const double seconds : {1.5, 3.0}) {
    Start();
    Run(0.01);
    observations_["panda"].q[2] = std::nan("");
    Run(seconds);
    const std::vector<Event>& events = sequencer_->events();
    const auto happened = [&](EventKind kind, const std::string& text) {
      return std::any_of(events.begin(), events.end(), [&](const Event& event) {
        return event.kind == kind && event.text.find(text) != std::string::npos;
      });
    };
    EXPECT_TRUE(happened(EventKind::kFault, "what is measured of 'panda' is not finite; the arm is stopped"));
    observations_["panda"].q[2] = 0;
    Run(10);
    if (seconds > 2) {
      EXPECT_EQ(sequencer_->status().reason,
                "pick(box): what is measured of 'panda' is not finite, for more than 2.0 s");
    } else {
      EXPECT_EQ(sequencer_->status().state, ExecutiveStatus::State::kFinished);
      EXPECT_TRUE(happened(EventKind::kRecovered, "all is measured again after 1."));
    }
  }
}

TEST_F(SequencerTest, AGripperThatDoesNotAnswerIsWaitedForAndFailsTheRunIfItLasts) {
  for (const double seconds : {1.0, 5.0}) {
    stuck_until_ = estimate_.time + seconds;
    Start();
    Run(20);
    if (seconds > 2) {
      EXPECT_THAT(
          sequencer_->status().reason,
          HasSubstr("the gripper of 'panda' does not answer: its fingers stay 80.0 mm apart, for more "
                    "than 2.0 s"));
    } else {
      EXPECT_EQ(sequencer_->status().state, ExecutiveStatus::State::kFinished) << sequencer_->status().reason;
      const std::vector<std::string> story = Story();
      EXPECT_NE(std::find(story.begin(), story.end(), "fault"), story.end());
      EXPECT_NE(std::find(story.begin(), story.end(), "recovered"), story.end());
      EXPECT_EQ(sequencer_->retries(), 0);
    }
  }
}

// Whatever motions come to: the run ends, once, within its retries, and says what became of it.
TEST_F(SequencerTest, WhateverHappensTheRunEndsWithinItsRetries) {
  int finished = 0, failed = 0;
  for (uint64_t seed = 1; seed <= 60; ++seed) {
    Random random(seed);
    options_.max_retries = random.Index(4);
    reaches_.clear();
    for (int i = 0; i < 40; ++i) {
      const double chance = random.Uniform(0, 1);
      reaches_.push_back(chance < 0.7    ? Progress::Done()
                         : chance < 0.8  ? Progress::Running()
                         : chance < 0.95 ? Progress::Retry(EventKind::kStalled, "it stalled", 0, true)
                         : chance < 0.98 ? Progress::GiveUp(EventKind::kStalled, "out of reach")
                                         : Progress::Failed(EventKind::kFailed, "it broke"));
    }
    Start();
    Run(100);
    ASSERT_FALSE(sequencer_->running()) << seed;
    int retries = 0, ends = 0;
    double time = 0;
    for (const Event& event : sequencer_->events()) {
      EXPECT_GE(event.time, time);
      EXPECT_EQ(ends, 0) << "nothing comes after the end";
      time = event.time;
      retries += event.kind == EventKind::kRetry;
      ends += event.kind == EventKind::kFinished || event.kind == EventKind::kFailed;
    }
    EXPECT_EQ(ends, 1);
    EXPECT_EQ(retries, sequencer_->retries());
    EXPECT_LE(retries, 2 * options_.max_retries) << "of two actions";
    if (sequencer_->status().state == ExecutiveStatus::State::kFinished) {
      ++finished;
      EXPECT_EQ(sequencer_->held(), "");
      for (const StepRecord& record : sequencer_->records()) EXPECT_GE(record.attempts, 1);
    } else {
      ++failed;
      EXPECT_THAT(sequencer_->status().reason, ::testing::AnyOf(::testing::StartsWith("pick(box): "),
                                                                ::testing::StartsWith("place(box,other): ")));
      EXPECT_LT(sequencer_->step(), 2);
    }
  }
  EXPECT_GT(finished, 10);
  EXPECT_GT(failed, 10);
}

}  // namespace
}  // namespace tether::execution
