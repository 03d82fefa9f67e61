#pragma once

#include <functional>
#include <future>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tether/execution/monitor/fault_watch.h"
#include "tether/execution/monitor/monitor.h"
#include "tether/execution/monitor/observation_guard.h"
#include "tether/execution/observer/frame_tracker.h"
#include "tether/execution/sequencer/plan_runner.h"
#include "tether/execution/sequencer/sequencer_options.h"
#include "tether/execution/servo/progress.h"
#include "tether/execution/servo/servo.h"
#include "tether/execution/servo/situation.h"

namespace tether::execution {

/// Executes a plan verb by verb, relative to where the objects are at each tick (Paper A, eq. (30a)),
/// whatever moves the arm: it senses, takes steps and verbs one after another, closes and opens the gripper
/// and judges what it holds, watches the grasp, and resumes at the step that can mend what went wrong; after
/// `max_retries` of an action it asks for other actions, or fails. The arm's motions are the servo's.
///
/// Step() allocates only where events are recorded; it neither blocks nor throws. Deterministic.
class Sequencer : public PlanRunner {
 public:
  /// Completes and looks up a plan's steps. Throws InputError with everything that can't be executed.
  using Resolver = std::function<ResolvedPlan(planning::Plan)>;

  using ServoMaker = std::function<std::unique_ptr<Servo>(Situation&)>;

  Sequencer(std::unique_ptr<Situation> situation, const ServoMaker& make_servo, Resolver resolve,
            const SequencerOptions& options);
  ~Sequencer() override;

  /// One tick. `observations` must hold every robot of the scene; an object that the estimate lacks, or has
  /// at a pose that is not finite, keeps its last pose. After the end the arm holds its pose.
  const robot::Commands& Step(const scene::WorldEstimate& estimate,
                              const robot::Observations& observations) override;

  const planning::Plan& plan() const override { return s_.plan; }
  const ExecutiveStatus& status() const override { return s_.status; }
  int step() const override { return s_.step; }
  const std::string& held() const override;
  const std::vector<Event>& events() const override { return s_.events; }
  const std::vector<StepRecord>& records() const override { return s_.records.values(); }
  int retries() const override { return retry_count_; }
  int replans() const override { return replans_; }
  void Pause(bool pause) override;
  bool ChangeGoal(const Goal& goal) override;
  const std::vector<PlanningRecord>& plannings() const override { return plannings_; }
  const TouchList& allowed() const override { return servo_->allowed(); }
  const std::vector<control::FieldConstraint>& verb_fields() const override { return servo_->verb_fields(); }

 protected:
  const Servo& servo() const { return *servo_; }

 private:
  // sequencer.cc: steps and verbs.
  void Begin();
  void Advance();
  Progress RunVerb();
  void EnterStep(int index);
  void BeginVerb();
  void FinishStep();
  void Finish(const std::string& text);
  void Abort(const Progress& progress);
  void WaitToRetry();
  void Retry(const Progress& progress);
  void Recover(bool open);
  void GiveUp(const std::string& reason);
  bool TryAlternative(std::string* why);
  /// The plan goes on with what `next` has from `action` on.
  bool Adopt(planning::Plan next, int action, std::string* why);
  void LetGoOfWhatWasJustGrasped();
  void OpenHand();
  /// The run fails in the present action, or for a reason of its own.
  void Fail(const std::string& reason);
  void EndFailed(const std::string& reason);

  // sequencer_loop.cc: the plan is made anew where what is observed no longer allows it.
  void Watch();
  bool ContinueLoop();
  bool AskForPlan(const std::string& reason, std::string* why);
  PlanRequest MakeRequest();
  void Request(PlanRequest request, int action, const std::string& reason);
  void AskAgain();
  std::string WhyAtOnce() const;
  /// Which object of the action lies on another side than when the plan was made; kNone: none.
  ObjectId LiesOtherwise(int action) const;
  void NoteSides();
  bool IsUnsettled();
  /// There was no plan, and one is asked for again.
  struct Again {
    double due = 0;  ///< s
    std::string reason;
    int action = 0, goals = 0;  ///< As Pending has them.
    PlanRequest in_vain;        ///< What no plan was found for …
    std::string why_not;        ///< … and why.
  };
  void FailToPlan(Again again);
  void AdoptAnswer();
  bool AllowsAction(int action);
  void Verify();

  // sequencer_sensing.cc
  void Sense(const scene::WorldEstimate& estimate, const robot::Observation& seen);
  void Track(ObjectId object, const math::Pose* measured, bool news);
  bool IsFresh() const;
  void FollowHeld(const scene::WorldEstimate& estimate, bool news);
  /// The arm is stopped while something is not measured.
  void WatchFaults();
  /// What is wrong in this tick, and for how long that is borne, s.
  enum class Wrong { kNothing, kArm, kPoses, kPoseClock, kTarget };
  std::pair<Wrong, double> FindWrong();
  std::string DescribeWrong() const;
  /// Torques can't hold an arm that is not measured for long: once it stands, its own servo is to.
  void LetServoHold(robot::Command* command) const;
  /// An object of the present step whose pose has not been finite for long; kNone: there is none.
  ObjectId LostTarget() const;

  // sequencer_grasp.cc
  Progress Grip(const planning::GripperVerb& verb);
  void BeginGrip(const planning::GripperVerb& verb);
  Progress JudgeGrasp();
  Progress WaitForGripper();
  void NoteGripperMoves();
  /// What fingers must close with so that an object of this mass (kg) does not slip, N at each pad.
  double HoldingForce(ObjectId object, double mass) const;
  void WatchGrip(double slip);
  Progress Wait(const planning::WaitVerb& verb);
  void Release();
  void WatchGrasp();
  bool MissedItsRegion();

  const std::unique_ptr<Situation> situation_;
  Situation& s_;
  const std::unique_ptr<Servo> servo_;
  const Resolver resolve_;
  const SequencerOptions options_;
  robot::Commands commands_;
  robot::Command::Mode mode_;  ///< Of the arm's commands, as the servo has them.

  IndexedVector<ObjectId, FrameTracker> trackers_;
  IndexedVector<ObjectId, bool> invalid_;    ///< Its last pose was not finite.
  IndexedVector<ObjectId, double> seen_at_;  ///< When it was measured last, s.
  IndexedVector<ObjectId, double> valid_;    ///< When its pose was last finite, or lacking, s.
  double estimate_time_ = -std::numeric_limits<double>::infinity();
  ObservationGuard guard_;
  OwnClock estimate_clock_;
  bool estimate_jumped_ = false;  ///< In this tick.
  double news_time_ = 0;          ///< When poses last came, s.
  FaultWatch faults_;
  Wrong wrong_ = Wrong::kNothing;  ///< What was wrong last.
  ObjectId lost_target_;           ///< With kTarget.
  double unanswered_ = -1;         ///< Since when the gripper does not answer, s; −1: it does.
  struct TimedPose {
    double time = -1;
    math::Pose X_WH;
  };
  std::vector<TimedPose> hands_;  ///< Where the hand was in the last ticks, as a ring.
  size_t next_hand_ = 0;
  ObjectId followed_;         ///< The held object that X_HO_ is of …
  math::Pose X_HO_;           ///< … which is how it lies in the hand, as far as measurements say …
  double followed_time_ = 0;  ///< … of up to this time, s.
  bool sensed_ = false;
  bool started_ = false;

  bool entered_ = false;  ///< The present verb, of those that the sequencer executes itself.
  double verb_start_ = 0;
  double first_opening_ = 0;  ///< As the present verb began, m.
  double last_opening_ = 0;
  double quiet_since_ = 0;
  double held_width_ = 0;   ///< Between the fingers as it was grasped, m.
  double slipped_ = 0;      ///< So far, since it was grasped: the fingers have closed harder for it, m.
  double told_force_ = 0;   ///< N
  double lost_since_ = -1;  ///< The grasp looks lost since then, s; −1: it does not.
  ObjectId held_before_;    ///< What the hand held when the present action began.
  int retry_count_ = 0;
  double last_retry_ = -std::numeric_limits<double>::infinity();
  std::optional<Progress> waiting_;  ///< A failure whose retry is not due yet.
  int replans_ = 0;

  /// A plan that was asked for.
  struct Pending {
    std::future<PlanAnswer> answer;
    int action = 0;  ///< It takes the place of the plan's actions from this one on.
    double due = 0;  ///< s
    std::string reason;
    int goals = 0;  ///< The goal was changed so many times before.
    PlanRequest request;
  };
  std::unique_ptr<Monitor> monitor_;  ///< None: the plan is executed as it is.
  std::optional<Pending> pending_;
  std::optional<Again> ask_again_;
  std::optional<Goal> new_goal_;  ///< That no plan has been adopted for yet.
  int goals_ = 0;                 ///< Times that the goal was changed.
  bool paused_ = false;
  std::vector<PlanningRecord> plannings_;
  /// The world's vertical in each object's frame when the plan was made.
  IndexedVector<ObjectId, Eigen::Vector3d> up_O_;
  double unsettled_since_ = -1;  ///< What changed the state has been moving since then, s; −1: nothing has.
  int fruitless_ = 0;            ///< Times in a row that no plan was found.
  std::map<std::string, int> failures_;  ///< Of actions, since the last that succeeded.
  double verify_at_ = -1;  ///< When the goal is looked at after the last action, s; −1: it isn't.
};

}  // namespace tether::execution
