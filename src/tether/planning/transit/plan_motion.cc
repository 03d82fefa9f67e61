#include "tether/planning/transit/plan_motion.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>
#include <variant>

#include "tether/common/limits.h"
#include "tether/constraints/core/context.h"
#include "tether/geometry/polygon/support.h"
#include "tether/motion/path_checker.h"
#include "tether/motion/start_check.h"
#include "tether/motion/trajectory.h"
#include "tether/motion/transit_search.h"
#include "tether/planning/program/frame_tree.h"
#include "tether/robot/gravity.h"
#include "tether/robot/posture.h"

namespace tether::planning {
namespace {

using Eigen::Vector3d;
using Eigen::VectorXd;
using math::Pose;

// Paths keep this from everything where there is room, m.
constexpr double kClearance = 0.01;
constexpr int64_t kMaxChecks = 800'000;
// Beyond the time limit of the search, motions of what it has found may take this share of it, and this, s.
constexpr double kGrace = 0.1, kLeastGrace = 0.1;
// Samples of straight motions, m.
constexpr double kSpacing = 0.03;
// The hand's acceleration with something in it and without, m/s²; it opens or closes within this, s.
constexpr double kHeldAcceleration = 3, kFreeAcceleration = 6, kGripTime = 0.4;

class MotionPlanner {
 public:
  MotionPlanner(const Problem& problem, Plan* plan)
      : problem_(problem),
        plan_(*plan),
        model_(*problem.robot.model),
        frames_(problem.scene),
        tree_(frames_, problem.scene, problem.robot.X_WHand, frames_.Find(problem.robot.holds)),
        X_BW_(problem.robot.X_WBase.Inverse()),
        solver_(problem.robot.model),
        state_(problem.robot.model, problem.robot.X_WBase.R.transpose() * Vector3d(0, 0, -robot::kGravity)) {
    robot::NarrowLimits(model_, 0, posture_problem_.lower, posture_problem_.upper);
    posture_problem_.clearance = 0;
  }

  MotionOutcome Run() {
    VectorXd q = problem_.robot.q.size() > 0 ? problem_.robot.q : model_.home();
    for (size_t t = 0; t < plan_.steps.size(); ++t) {
      PlanStep& step = plan_.steps[t];
      step.motion.reset();
      if (step.target_is_region || step.q.size() != model_.dof() ||
          !tree_.AddStep(frames_.Find(step.control), frames_.Find(step.target)))
        break;
      poses_.push_back(step.X_TC);
      PollLimitsNow();
      if (!PlanStepMotion(static_cast<int>(t), q)) return outcome_;
      q = AfterStep(static_cast<int>(t));
    }
    return outcome_;
  }

 private:
  Pose PoseOf(FrameId frame, int step) const { return tree_.PoseAt(frame, step, poses_); }

  /// A displacement that a verb of step `t` asks for, in the world.
  Vector3d InWorld(const Vector3d& by, In in, int t) const {
    const PlanStep& step = plan_.steps[static_cast<size_t>(t)];
    switch (in) {
      case In::kControl:
        return PoseOf(frames_.Find(step.control), t).R * by;
      case In::kTarget:
        return PoseOf(frames_.Find(step.target), t).R * by;
      case In::kHand:
        return PoseOf(frames_.hand(), t).R * by;
      case In::kWorld:
        break;
    }
    return by;
  }

  /// The hand at a reach of step `t`, in the base frame.
  Pose HandAt(const ReachVerb& reach, int t) const {
    Pose X_WH = PoseOf(frames_.hand(), t);
    X_WH.p += InWorld(reach.offset, reach.in, t);
    return X_BW_ * X_WH;
  }

  /// What stands and what is held as step `t` begins.
  motion::Snapshot SnapshotBefore(int t) const {
    const std::string& held = plan_.steps[static_cast<size_t>(t)].held;
    motion::Snapshot snapshot;
    snapshot.model = problem_.robot.model;
    snapshot.clearance = kClearance;
    snapshot.opening = model_.gripper().max_opening;
    const Pose X_WH = PoseOf(frames_.hand(), t - 1);
    const FrameId holds = frames_.Find(held);
    for (const ObjectId id : frames_.objects()) {
      const scene::Object& object = problem_.scene.object(id);
      const FrameId frame = scene::Frames::Of(id);
      const Pose X_WO = PoseOf(frame, t - 1);
      const bool moves = holds.valid() && tree_.HangsOn(frame, holds, t - 1);
      if (!moves) {
        snapshot.obstacles.push_back({object.name, object.shape, X_BW_ * X_WO});
        continue;
      }
      snapshot.held.push_back({object.name, object.shape, math::Between(X_WH, X_WO)});
      if (object.name != held) continue;
      // As wide as what it holds.
      const Vector3d across = X_WO.R.transpose() * X_WH.R.col(1);
      const double width = geometry::Support(object.shape, across) + geometry::Support(object.shape, -across);
      snapshot.opening = std::min(snapshot.opening, width);
    }
    for (const ActingRobot& other : problem_.others)
      motion::AddArm(other.name, *other.model, other.q, X_BW_ * other.X_WBase, &snapshot.obstacles);
    return snapshot;
  }

  /// The reach that the step begins with, and what follows it; none: it does not begin with a free motion.
  bool FindGoal(int t, motion::TransitGoal* goal) const {
    const PlanStep& step = plan_.steps[static_cast<size_t>(t)];
    if (step.mode == StepMode::kPush) return false;
    bool any = false;
    for (const Verb& verb : step.execute) {
      if (std::holds_alternative<ShiftVerb>(verb) && !any) return false;
      const auto* reach = std::get_if<ReachVerb>(&verb);
      if (reach == nullptr) continue;
      if (!any && reach->until_contact) return false;
      if (any) {
        goal->then.push_back(HandAt(*reach, t));
      } else {
        goal->X_BH = HandAt(*reach, t);
      }
      any = true;
    }
    goal->near = step.q;
    return any;
  }

  bool PlanStepMotion(int t, const VectorXd& start) {
    PlanStep& step = plan_.steps[static_cast<size_t>(t)];
    motion::TransitProblem transit_problem;
    motion::TransitGoal goal;
    if (!FindGoal(t, &goal)) return true;
    transit_problem.snapshot = SnapshotBefore(t);
    transit_problem.start = start;
    transit_problem.goals = {goal};
    transit_problem.seed = problem_.search.seed + static_cast<uint64_t>(t);
    transit_problem.max_checks = kMaxChecks;
    motion::Transit transit = motion::FindTransit(transit_problem);
    if (transit.status == motion::PathStatus::kNoFreeGoal) {
      // Something that the step intends is touched at the goal itself.
      motion::EndAbove(transit_problem.goals.front(), problem_.robot.X_WBase.R.row(2));
      const motion::Transit raised = motion::FindTransit(transit_problem);
      if (raised.found()) transit = raised;
    }
    if (!transit.found()) {
      outcome_ = {false, t, "on the way there, " + transit.reason, FindBlockers(transit_problem)};
      return false;
    }
    if (!transit.near) step.q = transit.end;
    StepMotion motion;
    motion.duration = Time(step, transit) + StraightTime(step, t);
    motion.clearance = motion::LeastClearance(transit_problem.snapshot, transit.path, kMostClearance);
    motion.path = std::move(transit.path);
    step.motion = std::move(motion);
    return true;
  }

  /// The movable objects that the motion leads through which there is without them; none if there is none.
  std::vector<std::string> FindBlockers(motion::TransitProblem blocked) const {
    std::vector<motion::Obstacle> movable;
    std::erase_if(blocked.snapshot.obstacles, [&](const motion::Obstacle& obstacle) {
      const scene::Object* object = problem_.scene.FindObject(obstacle.name);
      const bool moves = object != nullptr && object->movable();
      if (moves) movable.push_back(obstacle);
      return moves;
    });
    if (movable.empty()) return {};
    const motion::Transit transit = motion::FindTransit(blocked);
    if (!transit.found()) return {};
    std::vector<std::string> blockers;
    for (const motion::Obstacle& obstacle : movable) {
      motion::Snapshot alone = blocked.snapshot;
      alone.obstacles = {obstacle};
      alone.clearance = transit.clearance;
      motion::PathChecker checker(motion::CollisionScene::Compile(alone));
      bool free = checker.IsFree(transit.path.back());
      for (size_t i = 0; free && i + 1 < transit.path.size(); ++i)
        free = checker.IsFree(transit.path[i], transit.path[i + 1]);
      if (!free) blockers.push_back(obstacle.name);
    }
    return blockers;
  }

  double Time(const PlanStep& step, const motion::Transit& transit) {
    motion::Trajectory trajectory = motion::TimePath(transit.path, motion::LimitsOf(model_));
    motion::LoadLimits load;
    load.hand_acceleration = step.held.empty() ? kFreeAcceleration : kHeldAcceleration;
    if (const scene::Object* held = problem_.scene.FindObject(step.held))
      load.payload = held->mass.value_or(0);
    motion::StretchForLoad(load, state_, &trajectory);
    return trajectory.duration();
  }

  /// What the rest of the step takes at the verbs' speeds, s.
  double StraightTime(const PlanStep& step, int t) const {
    double time = 0;
    const Pose* from = nullptr;
    Pose at;
    for (const Verb& verb : step.execute) {
      if (const auto* reach = std::get_if<ReachVerb>(&verb)) {
        const Pose to = HandAt(*reach, t);
        if (from != nullptr) time += (to.p - from->p).norm() / reach->speed;
        at = to;
        from = &at;
      } else if (const auto* shift = std::get_if<ShiftVerb>(&verb)) {
        time += shift->by.norm() / shift->speed;
      } else if (const auto* wait = std::get_if<WaitVerb>(&verb)) {
        time += wait->seconds;
      } else {
        time += kGripTime;
      }
    }
    return time;
  }

  /// The arm at the end of step `t`: from its key pose along the shifts that follow.
  VectorXd AfterStep(int t) {
    const PlanStep& step = plan_.steps[static_cast<size_t>(t)];
    VectorXd q = step.q;
    Pose X_BH = X_BW_ * PoseOf(frames_.hand(), t);
    for (const Verb& verb : step.execute) {
      const auto* shift = std::get_if<ShiftVerb>(&verb);
      if (shift == nullptr) continue;
      const Vector3d by = X_BW_.R * InWorld(shift->by, shift->in, t);
      const int samples = std::max(1, static_cast<int>(std::ceil(by.norm() / kSpacing)));
      for (int i = 0; i < samples; ++i) {
        X_BH.p += by / samples;
        robot::Posture posture;
        posture_problem_.X_BH = X_BH;
        posture_problem_.rest = posture.q = q;
        solver_.Solve(posture_problem_, posture, 25);
        q = posture.q;
      }
    }
    return q;
  }

  const Problem& problem_;
  Plan& plan_;
  const robot::Model& model_;
  const scene::Frames frames_;
  FrameTree tree_;
  const Pose X_BW_;
  robot::PostureSolver solver_;
  robot::PostureProblem posture_problem_;
  robot::State state_;
  std::vector<Pose> poses_;
  MotionOutcome outcome_;
};

}  // namespace

MotionOutcome PlanMotions(const Problem& problem, const Limits& limits, Plan* plan) {
  if (problem.robot.model == nullptr) return {};
  tether::Limits own = limits;
  if (own.deadline) {
    using Clock = std::chrono::steady_clock;
    const double grace = std::max(kLeastGrace, kGrace * problem.search.time_limit_s);
    own.deadline = std::max(*own.deadline, Clock::now() + std::chrono::duration_cast<Clock::duration>(
                                                              std::chrono::duration<double>(grace)));
  }
  const LimitsScope scope(own);
  try {
    return MotionPlanner(problem, plan).Run();
  } catch (const LimitReached& reached) {
    MotionOutcome outcome;
    outcome.found = false;
    outcome.reached = reached.limit();
    return outcome;
  }
}

}  // namespace tether::planning
