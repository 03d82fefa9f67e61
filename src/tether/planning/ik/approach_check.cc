#include "tether/planning/ik/approach_check.h"

#include <algorithm>
#include <cmath>
#include <variant>

#include "tether/common/limits.h"
#include "tether/common/text.h"
#include "tether/geometry/distance/bounds.h"
#include "tether/geometry/distance/distance.h"

namespace tether::planning {
namespace {

using Eigen::Vector3d;
using math::Pose;

// Samples are about this far apart, m.
constexpr double kSpacing = 0.03;
constexpr int kIterations = 25;
// Between key poses links may come nearer to things than at them, and what is moved may touch, m.
constexpr double kApproachClearance = 0.002;
constexpr double kTouch = 0.001;
// The hand follows the straight motion to within this, m and rad.
constexpr double kOffLine = 1e-3;
constexpr double kTurnedOffLine = 5e-3;
// Where a joint turns further than this between samples, rad, they are set closer together …
constexpr double kSteady = 0.3;
// … down to this part of their distance: what still turns so far has left its branch.
constexpr double kFinest = 0.1;

/// A straight motion of the hand away from its key pose, and what is attached to the hand meanwhile.
struct Stretch {
  Pose X_WFar;      ///< The hand at its other end.
  bool before;      ///< It leads to the key pose.
  bool carries;     ///< What the hand holds moves with it.
  ApproachEnd end;  ///< The same end, as seen from the key pose.
};

class ApproachChecker {
 public:
  ApproachChecker(const SceneFacts& facts, const std::vector<BoundStep>& steps, const FrameTree& tree,
                  const std::vector<Pose>& poses, int step, IkSearch& search)
      : facts_(facts),
        bound_(steps[ToIndex(step)]),
        schema_(bound_.schema),
        tree_(tree),
        poses_(poses),
        step_(step),
        search_(search),
        X_WHand_(tree.PoseAt(facts.hand(), step, poses)) {}

  /// Why approach or retreat is not free; empty if both are, perhaps with another posture in place of the IK
  /// solution's.
  std::string Run(robot::Posture& posture, std::optional<ApproachEnd>& blocked_end) {
    search_.SetStep(tree_, poses_, step_);
    holder_ = tree_.ParentAt(facts_.hand(), step_);
    const robot::PostureProblem whole = search_.problem();
    // What is picked, placed or pushed moves too.
    robot::PostureProblem& problem = search_.problem();
    problem.clearance = kApproachClearance;
    problem.obstacles.clear();
    for (size_t k = 0; k < whole.obstacles.size(); ++k) {
      if (Moves(search_.NameOf(static_cast<int>(k)).solid)) continue;
      problem.obstacles.push_back(whole.obstacles[k]);
      kept_.push_back(static_cast<int>(k));
    }
    const std::vector<Stretch> stretches = Stretches();
    const Stretch* blocked = nullptr;
    const std::string found = FollowAll(stretches, posture, &blocked);
    std::string other_found = found;
    if (blocked != nullptr) {
      // A branch that is free at the far end may lead from there to the key pose.
      robot::Posture other = posture;
      SolveAt(blocked->X_WFar, whole.rest, other);
      if (Follows(other) && other.distance >= 0 && Follow(*blocked, 1, 0, other).empty()) {
        robot::PostureProblem there = whole;
        there.rest = other.q;
        PollLimitsNow();
        search_.solver().Solve(there, other);
        if (other.reaches() && other.distance >= kLeastLinkClearance)
          other_found = FollowAll(stretches, other);
        if (other_found.empty()) posture = other;
      }
    }
    problem = whole;
    if (other_found.empty()) return "";
    blocked_end = blocked->end;
    return found;
  }

 private:
  /// The control frame is the hand or held by it; else a tool pushes it.
  bool Carries() const { return bound_.control == facts_.hand() || bound_.control == holder_; }

  /// Adds a displacement of the hand. A displacement in the frame of a held object turns with the hand; in
  /// any other it does not.
  void Add(const Vector3d& by, In in, constraints::Offset& offset) const {
    const Eigen::Matrix3d R_BaseW = facts_.problem().robot.X_WBase.R.transpose();
    switch (in) {
      case In::kHand:
        offset.by_H += by;
        break;
      case In::kControl:
        if (Carries()) {
          offset.by_H += X_WHand_.R.transpose() * tree_.PoseAt(bound_.control, step_, poses_).R * by;
        } else {
          offset.by_B += R_BaseW * tree_.PoseAt(bound_.control, step_, poses_).R * by;
        }
        break;
      case In::kTarget:
        offset.by_B += R_BaseW * tree_.PoseAt(bound_.target, step_, poses_).R * by;
        break;
      case In::kWorld:
        offset.by_B += R_BaseW * by;
        break;
    }
  }

  Vector3d InWorld(const constraints::Offset& offset) const {
    return X_WHand_.R * offset.by_H + facts_.problem().robot.X_WBase.R * offset.by_B;
  }
  double Length(const constraints::Offset& offset) const { return InWorld(offset).norm(); }

  Stretch Displaced(const constraints::Offset& offset, bool before, bool carries) const {
    return {{X_WHand_.R, X_WHand_.p + InWorld(offset)}, before, carries, {offset, Length(offset), false}};
  }

  std::vector<Stretch> Stretches() const {
    std::vector<Stretch> all;
    const std::vector<Verb>& verbs = schema_.execute;
    bool holding = bound_.control != facts_.hand();
    constraints::Offset offset, shifted;
    bool reached = false;
    for (const Verb& verb : verbs) {
      if (const auto* reach = std::get_if<ReachVerb>(&verb)) {
        if (reach->offset.norm() > 1e-9) {
          offset = {};
          Add(reach->offset, reach->in, offset);
        } else if (!reached) {
          reached = true;
          if (Length(offset) > 1e-9) all.push_back(Displaced(offset, true, holding));
        }
      } else if (const auto* gripper = std::get_if<GripperVerb>(&verb)) {
        holding = !gripper->close_on.empty();
      } else if (const auto* shift = std::get_if<ShiftVerb>(&verb); shift != nullptr && reached) {
        Add(shift->by, shift->in, shifted);
        all.push_back(Displaced(shifted, false, holding));
      }
    }
    if (!Carries() && step_ > 0) {
      const Pose X_WBefore = tree_.PoseAt(facts_.hand(), step_ - 1, poses_);
      all.push_back({X_WBefore, true, false, {{}, (X_WBefore.p - X_WHand_.p).norm(), true}});
    }
    return all;
  }

  /// Follows a stretch from the share `from` of its length to `to`, 0 being the key pose, beginning at
  /// `posture`, which becomes the last posture reached. Empty if `to` is reached; else why not.
  std::string Follow(const Stretch& stretch, double from, double to, robot::Posture& posture) {
    const Pose X_HandFar = math::Between(X_WHand_, stretch.X_WFar);
    const math::Vector6d whole = math::LogSE3(X_HandFar);
    const double spacing = 1 / std::max(1.0, std::ceil(X_HandFar.p.norm() / kSpacing));
    const double sign = to < from ? -1 : 1;
    double s = from, ds = spacing;
    // Steps below the resolution of the parameter make no progress.
    while (std::abs(to - s) > 1e-9 && ds > 1e-12) {
      PollLimits();
      ds = std::min(ds, std::abs(to - s));
      const Pose X_WH = X_WHand_ * math::ExpSE3(whole * (s + sign * ds));
      robot::Posture there = posture;
      SolveAt(X_WH, posture.q, there);
      const bool follows = Follows(there);
      // Near a singularity the joints turn fast, yet steadily: sampled more densely.
      const bool swings = (there.q - posture.q).cwiseAbs().maxCoeff() > kSteady;
      if ((!follows || swings) && ds > kFinest * spacing) {
        ds /= 2;
        continue;
      }
      if (!follows || there.distance < 0) return search_.Explain(there);
      if (swings) return "the arm would have to swing round";
      const std::string moved = CheckMoved(stretch, X_WH);
      if (!moved.empty()) return moved;
      posture = there;
      s += sign * ds;
      ds = std::min(2 * ds, spacing);
    }
    return "";
  }

  std::string FollowAll(const std::vector<Stretch>& stretches, const robot::Posture& from,
                        const Stretch** blocked = nullptr) {
    for (const Stretch& stretch : stretches) {
      robot::Posture posture = from;
      const std::string problem = Follow(stretch, 0, 1, posture);
      if (problem.empty()) continue;
      if (blocked != nullptr) *blocked = &stretch;
      return (stretch.before ? "on the way there, " : "on the way back, ") + problem;
    }
    return "";
  }

  bool Follows(const robot::Posture& posture) const {
    return posture.position_error <= kOffLine && posture.rotation_error <= kTurnedOffLine;
  }

  /// Solves for the hand at a point of the stretch; the elbow stays near `rest`. What moves with the hand is
  /// no obstacle.
  void SolveAt(const Pose& X_WH, const Eigen::VectorXd& rest, robot::Posture& posture) {
    robot::PostureProblem& problem = search_.problem();
    problem.X_BH = math::Between(facts_.problem().robot.X_WBase, X_WH);
    problem.rest = rest;
    PollLimitsNow();
    search_.solver().Solve(problem, posture, kIterations);
    if (posture.obstacle >= 0) posture.obstacle = kept_[ToIndex(posture.obstacle)];
  }

  bool Moves(FrameId solid) const {
    const ObjectId object = facts_.frames().ObjectOf(solid);
    if (!object.valid() || !facts_.problem().scene.object(object).movable()) return false;
    return tree_.HangsOn(solid, holder_, step_) ||
           (bound_.control != facts_.hand() && tree_.HangsOn(solid, bound_.control, step_));
  }

  /// A solid at the key pose.
  struct Solid {
    FrameId frame;
    const geometry::Shape* shape;
    Pose X_W;
    geometry::Aabb box;
    bool is_hand;
    FrameId parent;  // before the step, of what moves
  };

  /// Those that move along the stretch, and the rest.
  void FindSolids() {
    if (!resting_.empty() || !moving_.empty()) return;
    FrameTree::Poses all;
    tree_.PosesAt(step_, poses_, all);
    for (const FrameId solid : facts_.solids()) {
      const geometry::Shape& shape = *facts_.ShapeOf(solid);
      const Pose& X_W = all[solid];
      const bool is_hand = solid == facts_.hand();
      const bool moves = is_hand || Moves(solid);
      (moves ? moving_ : resting_)
          .push_back({solid, &shape, X_W, geometry::BoundingBox(shape, X_W), is_hand,
                      moves && !is_hand ? tree_.ParentAt(solid, step_ - 1) : FrameId()});
    }
  }

  /// The hand, and what it carries, against the rest.
  std::string CheckMoved(const Stretch& stretch, const Pose& X_WH) {
    FindSolids();
    for (const Solid& a : moving_) {
      if (!a.is_hand && !stretch.carries) continue;
      const Pose X_WA = X_WH * math::Between(X_WHand_, a.X_W);
      const geometry::Aabb box = geometry::BoundingBox(*a.shape, X_WA);
      for (const Solid& b : resting_) {
        if (box.DistanceTo(b.box) > 0) continue;
        // What it stands on before or after may be touched.
        if (!a.is_hand && (b.frame == bound_.target || b.frame == a.parent)) continue;
        if (geometry::DistanceLowerBound(*a.shape, X_WA, *b.shape, b.X_W) > -kTouch) continue;
        const double distance = geometry::SignedDistance(*a.shape, X_WA, *b.shape, b.X_W).distance;
        if (distance >= -kTouch) continue;
        char text[160];
        FormatInto(text, sizeof text, "%s would be %.1f cm inside %s", facts_.Name(a.frame).c_str(),
                   -100 * distance, facts_.Name(b.frame).c_str());
        return text;
      }
    }
    return "";
  }

  const SceneFacts& facts_;
  const BoundStep& bound_;
  const StepSchema& schema_;
  const FrameTree& tree_;
  const std::vector<Pose>& poses_;
  int step_;
  IkSearch& search_;
  Pose X_WHand_;
  FrameId holder_;
  std::vector<int> kept_;  // Indices of the obstacles of the stretch.
  std::vector<Solid> moving_, resting_;
};

}  // namespace

std::string CheckApproaches(const SceneFacts& facts, const std::vector<BoundStep>& steps,
                            const FrameTree& tree, const std::vector<Pose>& poses, int step, IkSearch& search,
                            IkSolution& ik_solution) {
  const std::string problem =
      ApproachChecker(facts, steps, tree, poses, step, search).Run(ik_solution.posture, ik_solution.blocked);
  ik_solution.q = ik_solution.posture.q;
  return problem;
}

}  // namespace tether::planning
