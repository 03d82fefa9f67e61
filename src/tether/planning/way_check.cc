#include "tether/planning/way_check.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <variant>

#include "tether/geometry/bounds.h"
#include "tether/geometry/distance.h"

namespace tether::planning {
namespace {

using constraints::kHand;
using Eigen::Vector3d;
using math::Pose;

// Samples are about this far apart, m.
constexpr double kSpacing = 0.03;
constexpr int kIterations = 25;
// On the way links may come nearer to things than at key poses, and what is moved may touch, m.
constexpr double kWayClearance = 0.002;
constexpr double kTouch = 0.001;
// The hand follows the way to within this, m and rad.
constexpr double kOffWay = 1e-3;
constexpr double kTurnedOffWay = 5e-3;
// A joint that turns so far between samples has left its branch, rad.
constexpr double kJump = 0.6;

/// A straight motion of the hand away from its key pose, and what hangs on it meanwhile.
struct Stretch {
  Pose X_WFar;   ///< The hand at its other end.
  bool before;   ///< It leads to the key pose.
  bool carries;  ///< What the hand holds moves with it.
};

class WayChecker {
 public:
  WayChecker(const SceneFacts& facts, const std::vector<BoundStep>& steps, const FrameTree& tree,
             const std::vector<Pose>& poses, const std::vector<Witness>& witnesses, int step,
             WitnessSearch& search)
      : facts_(facts),
        schema_(steps[static_cast<size_t>(step)].schema),
        tree_(tree),
        poses_(poses),
        witness_(witnesses[static_cast<size_t>(step)]),
        step_(step),
        search_(search),
        X_WHand_(tree.PoseAt(kHand, step, poses)) {}

  std::string Run() {
    search_.SetStep(tree_, poses_, step_);
    holder_ = tree_.ParentAt(kHand, step_);
    for (const Stretch& stretch : Stretches()) {
      const std::string problem = Follow(stretch);
      if (!problem.empty()) return (stretch.before ? "on the way there, " : "on the way back, ") + problem;
    }
    return "";
  }

 private:
  /// The control frame is the hand or what it holds: else a tool moves it.
  bool Carries() const { return schema_.control == kHand || schema_.control == holder_; }

  Vector3d InWorld(const Vector3d& by, In in) const {
    switch (in) {
      case In::kControl:
        return tree_.PoseAt(schema_.control, step_, poses_).R * by;
      case In::kTarget:
        return tree_.PoseAt(schema_.target, step_, poses_).R * by;
      case In::kHand:
        return X_WHand_.R * by;
      case In::kWorld:
        break;
    }
    return by;
  }

  std::vector<Stretch> Stretches() const {
    std::vector<Stretch> all;
    const std::vector<Verb>& verbs = schema_.execute;
    bool holding = schema_.control != kHand;
    Vector3d offset = Vector3d::Zero(), shifted = Vector3d::Zero();
    bool reached = false;
    for (const Verb& verb : verbs) {
      if (const auto* reach = std::get_if<ReachVerb>(&verb)) {
        const Vector3d by = InWorld(reach->offset, reach->in);
        if (by.norm() > 1e-9) {
          offset = by;
        } else if (!reached) {
          reached = true;
          if (offset.norm() > 1e-9) all.push_back({{X_WHand_.R, X_WHand_.p + offset}, true, holding});
        }
      } else if (const auto* gripper = std::get_if<GripperVerb>(&verb)) {
        holding = !gripper->close_on.empty();
      } else if (const auto* shift = std::get_if<ShiftVerb>(&verb); shift != nullptr && reached) {
        shifted += InWorld(shift->by, shift->in);
        all.push_back({{X_WHand_.R, X_WHand_.p + shifted}, false, holding});
      }
    }
    if (!Carries() && step_ > 0) all.push_back({tree_.PoseAt(kHand, step_ - 1, poses_), true, false});
    return all;
  }

  std::string Follow(const Stretch& stretch) {
    const ActingRobot& robot = facts_.problem().robot;
    const Pose X_HandFar = math::Between(X_WHand_, stretch.X_WFar);
    const math::Vector6d whole = math::LogSE3(X_HandFar);
    const int count = std::max(1, static_cast<int>(std::ceil(X_HandFar.p.norm() / kSpacing)));
    robot::PostureProblem& problem = search_.problem();
    const double clearance = problem.clearance;
    problem.clearance = kWayClearance;
    // What is taken up, put down or pushed moves too: left out here.
    const std::vector<robot::PostureObstacle> all = problem.obstacles;
    std::vector<int> kept;
    problem.obstacles.clear();
    for (size_t k = 0; k < all.size(); ++k) {
      if (Moves(search_.NameOf(static_cast<int>(k)).solid)) continue;
      problem.obstacles.push_back(all[k]);
      kept.push_back(static_cast<int>(k));
    }
    std::string found;
    robot::Posture posture = witness_.posture;
    for (int i = 1; i <= count && found.empty(); ++i) {
      const Pose X_WH = X_WHand_ * math::ExpSE3(whole * i / count);
      problem.X_BH = math::Between(robot.X_WBase, X_WH);
      const Eigen::VectorXd before = posture.q;
      problem.rest = before;
      search_.solver().Solve(problem, posture, kIterations);
      if (posture.obstacle >= 0) posture.obstacle = kept[static_cast<size_t>(posture.obstacle)];
      if (posture.position_error > kOffWay || posture.rotation_error > kTurnedOffWay) {
        found = search_.Explain(posture);
      } else if (posture.distance < 0) {
        found = search_.Explain(posture);
      } else if ((posture.q - before).cwiseAbs().maxCoeff() > kJump) {
        found = "the arm would have to swing round";
      } else {
        found = CheckMoved(stretch, X_WH);
      }
    }
    problem.obstacles = all;
    problem.clearance = clearance;
    problem.rest = robot.model->home();
    return found;
  }

  bool Moves(int solid) const {
    const std::string& name = facts_.solids()[static_cast<size_t>(solid)];
    const scene::Object* object = facts_.problem().scene.FindObject(name);
    if (object == nullptr || !object->movable()) return false;
    return tree_.HangsOn(name, holder_, step_) ||
           (schema_.control != kHand && tree_.HangsOn(name, schema_.control, step_));
  }

  /// The hand, and what it carries, against the rest.
  std::string CheckMoved(const Stretch& stretch, const Pose& X_WH) const {
    const std::vector<std::string>& solids = facts_.solids();
    for (size_t i = 0; i < solids.size(); ++i) {
      const bool hand = solids[i] == kHand;
      if (!hand && (!stretch.carries || !Moves(static_cast<int>(i)))) continue;
      const Pose X_WA = X_WH * math::Between(X_WHand_, tree_.PoseAt(solids[i], step_, poses_));
      for (size_t j = 0; j < solids.size(); ++j) {
        if (solids[j] == kHand || Moves(static_cast<int>(j))) continue;
        // What it stands on before or after may be touched.
        if (!hand && (solids[j] == schema_.target || solids[j] == tree_.ParentAt(solids[i], step_ - 1)))
          continue;
        const Pose X_WB = tree_.PoseAt(solids[j], step_, poses_);
        const geometry::Shape &a = *facts_.ShapeOf(solids[i]), &b = *facts_.ShapeOf(solids[j]);
        if (geometry::DistanceLowerBound(a, X_WA, b, X_WB) > -kTouch) continue;
        const double distance = geometry::SignedDistance(a, X_WA, b, X_WB).distance;
        if (distance >= -kTouch) continue;
        char text[160];
        std::snprintf(text, sizeof text, "%s would be %.1f cm inside %s", solids[i].c_str(), -100 * distance,
                      solids[j].c_str());
        return text;
      }
    }
    return "";
  }

  const SceneFacts& facts_;
  const StepSchema& schema_;
  const FrameTree& tree_;
  const std::vector<Pose>& poses_;
  const Witness& witness_;
  int step_;
  WitnessSearch& search_;
  Pose X_WHand_;
  std::string holder_;
};

}  // namespace

std::string CheckWay(const SceneFacts& facts, const std::vector<BoundStep>& steps, const FrameTree& tree,
                     const std::vector<Pose>& poses, const std::vector<Witness>& witnesses, int step,
                     WitnessSearch& search) {
  return WayChecker(facts, steps, tree, poses, witnesses, step, search).Run();
}

}  // namespace tether::planning
