#include "tether/planning/ik/ik_search.h"

#include <algorithm>
#include <cmath>

#include "tether/common/limits.h"
#include "tether/common/random.h"
#include "tether/common/text.h"
#include "tether/robot/kinematics.h"

namespace tether::planning {
namespace {

using constraints::kHand;
using math::Pose;

// Other starts, where the configuration before does not lead to a solution.
constexpr int kElsewhere = 10;
// A solution with a joint this near to a limit is a poor one: others are looked for, from so many starts,
// rad.
constexpr double kPoor = 0.1;
constexpr int kBetterStarts = 6;

}  // namespace

double BeyondReach(const robot::Model& model, const Pose& X_BH) {
  const robot::OuterReach& reach = model.outer_reach();
  return (X_BH * reach.p_HW - reach.centre).norm() - reach.radius;
}

IkSearch::IkSearch(const SceneFacts& facts, const FrameTree& tree)
    : facts_(facts), X_BaseW_(facts.problem().robot.X_WBase.Inverse()), solver_(facts.problem().robot.model) {
  const ActingRobot& robot = facts.problem().robot;
  robot::NarrowLimits(*robot.model, kLimitMargin, problem_.lower, problem_.upper);
  problem_.rest = robot.model->home();
  problem_.clearance = kLinkClearance;
  start_ = robot.q.size() > 0 ? robot.q : robot.model->home();
  // The first joint turns the whole arm: a scene turned about the base together with the hand gives the same
  // solutions.
  problem_.rest[0] = start_[0];
  // What touches the arm at the start is meant to touch it.
  SetStep(tree, {}, -1);
  touching_.assign(names_.size(), {});
  robot::PostureProblem alone = problem_;
  for (size_t k = 0; k < names_.size(); ++k) {
    alone.obstacles = {problem_.obstacles[k]};
    robot::Posture posture;
    posture.q = start_;
    for (;;) {
      solver_.Assess(alone, posture);
      if (posture.obstacle < 0 || posture.distance >= 0) break;
      alone.obstacles[0].ignored.push_back(posture.solid);
    }
    touching_[k] = alone.obstacles[0].ignored;
  }
}

void IkSearch::SetStep(const FrameTree& tree, const std::vector<Pose>& poses, int step) {
  tree.PosesAt(step, poses, X_W_);
  problem_.obstacles.clear();
  names_.clear();
  const std::vector<std::string>& solids = facts_.solids();
  for (size_t solid = 0; solid < solids.size(); ++solid) {
    if (solids[solid] == kHand) continue;
    const geometry::Shape& shape = *facts_.ShapeOf(solids[solid]);
    const int frame = tree.IndexOf(solids[solid]);
    bool still = true;
    for (std::string name = solids[solid]; !name.empty() && still; name = tree.ParentAt(name, step))
      still = tree.LastMoved(name, step) < 0;
    const Pose X_BO = X_BaseW_ * X_W_[static_cast<size_t>(frame)];
    for (size_t part = 0; part < shape.parts.size(); ++part) {
      if (!touching_.empty() && still) {
        problem_.obstacles.emplace_back(shape.parts[part], X_BO, still);
        problem_.obstacles.back().ignored = touching_[names_.size()];
      } else {
        problem_.obstacles.emplace_back(shape.parts[part], X_BO, still);
      }
      names_.push_back({static_cast<int>(solid), static_cast<int>(part)});
    }
  }
  problem_.X_BH = X_BaseW_ * X_W_[static_cast<size_t>(tree.IndexOf(kHand))];
}

std::vector<IkSolution> IkSearch::Find(const FrameTree& tree, const std::vector<Pose>& poses) {
  std::vector<IkSolution> ik_solutions;
  Eigen::VectorXd from = start_;
  for (int t = 0; t < tree.num_steps(); ++t) {
    SetStep(tree, poses, t);
    ik_solutions.push_back(FindOne(from, suggested_.contains(t) ? &suggested_.at(t) : nullptr));
    if (ik_solutions.back().found) from = ik_solutions.back().q;
  }
  return ik_solutions;
}

IkSolution IkSearch::FindOne(const Eigen::VectorXd& from, const Eigen::VectorXd* other) {
  const robot::Model& model = *facts_.problem().robot.model;
  IkSolution ik_solution;
  robot::Posture& best = ik_solution.posture;
  bool any = false;
  const auto better = [&](const robot::Posture& a) {
    if (!any) return true;
    if (a.reaches() != best.reaches()) return a.reaches();
    return a.reaches() ? a.distance > best.distance
                       : a.position_error + a.rotation_error < best.position_error + best.rotation_error;
  };
  const auto attempt = [&](const Eigen::VectorXd& q) {
    robot::Posture posture;
    posture.q = q;
    PollLimitsNow();
    solver_.Solve(problem_, posture);
    if (better(posture)) best = posture;
    any = true;
    // Less clearance rather than another branch.
    return best.reaches() && best.distance >= kLeastLinkClearance;
  };
  ik_solution.found = (other != nullptr && attempt(*other)) || attempt(from);
  if (!ik_solution.found && BeyondReach(model, problem_.X_BH) <= 0) {
    Random random(1);
    for (int i = 0; i < kElsewhere && !ik_solution.found; ++i) {
      Eigen::VectorXd q = i == 0 ? problem_.rest : problem_.lower;
      if (i > 0) {
        for (int joint = 0; joint < q.size(); ++joint)
          q[joint] = random.Uniform(problem_.lower[joint], problem_.upper[joint]);
      }
      ik_solution.found = attempt(q);
    }
  }
  if (ik_solution.found) PreferRoom(from, best);
  ik_solution.q = best.q;
  if (!ik_solution.found) ik_solution.problem = Explain(best);
  return ik_solution;
}

// An arm that comes from the other side may end up folded, a joint at its limit: what follows is then hardly
// reached. With joint 1 turned towards the hand it has room.
void IkSearch::PreferRoom(const Eigen::VectorXd& from, robot::Posture& best) {
  const auto room = [&](const Eigen::VectorXd& q) {
    return std::min((q - problem_.lower).minCoeff(), (problem_.upper - q).minCoeff());
  };
  const auto travel = [&](const Eigen::VectorXd& q) { return (q - from).cwiseAbs().maxCoeff(); };
  if (room(best.q) >= kPoor) return;
  const robot::Model& model = *facts_.problem().robot.model;
  const Eigen::VectorXd rest = problem_.rest;
  Eigen::VectorXd home = model.home();
  const Pose X_BHome = robot::LinkPoses(model.chain(), home).X_BH();
  const double turn =
      std::atan2(problem_.X_BH.p.y(), problem_.X_BH.p.x()) - std::atan2(X_BHome.p.y(), X_BHome.p.x());
  home[0] = std::clamp(home[0] + std::remainder(turn, 2 * M_PI), problem_.lower[0], problem_.upper[0]);
  Random random(2);
  std::optional<robot::Posture> other;
  for (int i = 0; i < kBetterStarts; ++i) {
    robot::Posture posture;
    posture.q = home;
    // The hand may have to be turned either way.
    const Eigen::Index last = home.size() - 1;
    if (i == 1) posture.q[last] = problem_.lower[last] + 4 * kPoor;
    if (i == 2) posture.q[last] = problem_.upper[last] - 4 * kPoor;
    for (int joint = 1; joint < home.size() && i > 2; ++joint)
      posture.q[joint] = random.Uniform(problem_.lower[joint], problem_.upper[joint]);
    problem_.rest = posture.q;
    PollLimitsNow();
    solver_.Solve(problem_, posture);
    if (!posture.reaches() || posture.distance < kLeastLinkClearance || room(posture.q) < kPoor) continue;
    if (!other || travel(posture.q) < travel(other->q)) other = posture;
  }
  problem_.rest = rest;
  if (other) best = *other;
}

std::string IkSearch::Explain(const robot::Posture& posture) const {
  const ActingRobot& robot = facts_.problem().robot;
  const auto text = [](const char* format, auto... arguments) {
    char buffer[200];
    FormatInto(buffer, sizeof buffer, format, arguments...);
    return std::string(buffer);
  };
  const double beyond = BeyondReach(*robot.model, problem_.X_BH);
  if (beyond > 0) return text("%.1f cm beyond reach", 100 * beyond);
  if (!posture.reaches()) {
    if (posture.position_error > 1e-3)
      return text("%.1f cm beyond reach with the hand turned so", 100 * posture.position_error);
    return text("the hand can't be turned so there: %.0f degrees are missing",
                posture.rotation_error * 180 / M_PI);
  }
  const auto link = [&](int solid) {
    const robot::ArmSolids& solids = robot.model->solids();
    return solid == solids.hand() ? std::string("hand") : solids.links[static_cast<size_t>(solid)].name;
  };
  const std::string other = posture.obstacle >= 0
                                ? facts_.solids()[static_cast<size_t>(NameOf(posture.obstacle).solid)]
                                : link(posture.other_solid);
  const std::string which = robot.name + "'s " + link(posture.solid);
  if (posture.distance < 0)
    return text("%s would be %.1f cm inside %s", which.c_str(), -100 * posture.distance, other.c_str());
  return text("%s would come within %.0f mm of %s", which.c_str(), 1000 * posture.distance, other.c_str());
}

}  // namespace tether::planning
