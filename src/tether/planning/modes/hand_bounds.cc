#include "tether/planning/modes/hand_bounds.h"

#include "tether/common/text.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace tether::planning {
namespace {

using constraints::Alignment;
using constraints::Column;
using Eigen::Vector3d;

// Out of reach by less than this proves nothing: constraints are kept to tolerances, m.
constexpr double kProof = 0.003;

/// The set in which the step's control frame is, in its target frame, as far as its constraints tell.
std::optional<Ball> Locate(const StepContext& context, const BoundStep& step) {
  std::optional<Column> all;
  for (const BoundConstraint& constraint : step.constraints) {
    if (!constraint.kind->locate) continue;
    const std::optional<Column> column = constraint.kind->locate(context, constraint.parameters);
    if (!column) continue;
    if (!all) {
      all = column;
    } else if (std::abs(all->axis.dot(column->axis)) > 1 - 1e-9) {
      // Two about the same axis: the narrower and the shorter.
      const double height = all->axis.dot(all->centre);
      if (column->radius < all->radius) {
        const double half_height = all->half_height;
        all->centre = column->centre + all->axis * (height - all->axis.dot(column->centre));
        all->radius = column->radius;
        all->half_height = half_height;
      }
      if (column->half_height < all->half_height) {
        all->centre += all->axis * (all->axis.dot(column->centre) - all->axis.dot(all->centre));
        all->half_height = column->half_height;
      }
    }
  }
  if (!all || !std::isfinite(all->radius) || !std::isfinite(all->half_height)) return std::nullopt;
  return Ball{all->centre, std::hypot(all->radius, all->half_height)};
}

/// The ball in which the hand is in the world after a step; none if that is not known.
std::optional<Ball> HandAt(const FrameTree& tree, int step, const std::vector<std::optional<Ball>>& located) {
  math::Pose X_WF;  // known as long as the links are constant
  Ball ball;
  bool turned = false;
  for (const ChainLink& link : tree.ChainTo(constraints::kHand, step)) {
    Ball next;
    if (link.variable < 0) {
      next.centre = tree.parameters()[static_cast<size_t>(link.parameter)].p;
    } else {
      const std::optional<Ball>& found = located[static_cast<size_t>(link.variable)];
      if (!found) return std::nullopt;
      next = *found;
    }
    if (turned) {
      ball.radius += next.centre.norm() + next.radius;
    } else if (link.variable >= 0) {
      ball = {X_WF * next.centre, next.radius};
      turned = true;
    } else {
      X_WF = X_WF * tree.parameters()[static_cast<size_t>(link.parameter)];
    }
  }
  return turned ? ball : Ball{X_WF.p, 0};
}

/// The direction, in the target frame, that the direction `d` of the control frame must have.
std::optional<Vector3d> Carry(const std::vector<Alignment>& alignments, const Vector3d& d) {
  for (const Alignment& alignment : alignments) {
    if (alignment.of_control.dot(d) > 1 - 1e-9) return alignment.of_target;
  }
  return std::nullopt;
}

/// The hand's z axis in the world after a step; none if that is not known.
std::optional<Vector3d> ApproachAt(const FrameTree& tree, int step,
                                   const std::vector<std::vector<Alignment>>& alignments) {
  const Chain& chain = tree.ChainTo(constraints::kHand, step);
  Vector3d d = Vector3d::UnitZ();
  for (size_t i = chain.size(); i-- > 0;) {
    if (chain[i].variable < 0) {
      d = tree.parameters()[static_cast<size_t>(chain[i].parameter)].R * d;
      continue;
    }
    const std::optional<Vector3d> in_target = Carry(alignments[static_cast<size_t>(chain[i].variable)], d);
    if (!in_target) return std::nullopt;
    d = *in_target;
  }
  return d;
}

/// The movable objects that a step's target is attached to, it among them, if the step moves the hand itself
/// and no earlier one moves any of them.
std::vector<std::string> UnmovedBelow(const Problem& problem, const std::vector<BoundStep>& steps, int step) {
  const StepSchema& schema = steps[static_cast<size_t>(step)].schema;
  std::vector<std::string> all;
  if (schema.control != constraints::kHand) return all;
  for (const scene::Object* object = problem.scene.FindObject(schema.target); object != nullptr;
       object = problem.scene.FindObject(object->parent)) {
    if (object->movable()) all.push_back(object->name);
  }
  for (int t = 0; t < step; ++t) {
    if (std::find(all.begin(), all.end(), steps[static_cast<size_t>(t)].schema.control) != all.end())
      return {};
  }
  return all;
}

}  // namespace

std::optional<std::vector<HandBound>> BoundHand(const SceneFacts& facts,
                                                const std::vector<BoundStep>& steps) {
  const Problem& problem = facts.problem();
  FrameTree tree(problem.scene, problem.robot.X_WHand, problem.robot.holds);
  const auto choose = [](const std::string&, const std::vector<constraints::Option>&) { return 0; };
  const constraints::Memo memo;
  const std::vector<math::Pose> poses(steps.size());  // Not read: bounds don't depend on poses.
  std::vector<std::optional<Ball>> located;
  std::vector<std::vector<Alignment>> alignments;
  std::vector<HandBound> bounds;
  for (int t = 0; t < static_cast<int>(steps.size()); ++t) {
    const BoundStep& step = steps[static_cast<size_t>(t)];
    if (!tree.AddStep(step.schema.control, step.schema.target)) return std::nullopt;
    const StepContext context(facts, memo, tree, poses, t, step, choose);
    located.push_back(Locate(context, step));
    alignments.emplace_back();
    for (const BoundConstraint& constraint : step.constraints) {
      if (!constraint.kind->align) continue;
      if (const auto alignment = constraint.kind->align(context, constraint.parameters))
        alignments.back().push_back(*alignment);
    }
    bounds.push_back({HandAt(tree, t, located), ApproachAt(tree, t, alignments)});
  }
  return bounds;
}

std::optional<ReachRefutation> RefuteByReach(const SceneFacts& facts, const std::vector<BoundStep>& steps) {
  const ActingRobot& robot = facts.problem().robot;
  if (robot.model == nullptr) return std::nullopt;
  const std::optional<std::vector<HandBound>> bounds = BoundHand(facts, steps);
  if (!bounds) return std::nullopt;
  const robot::OuterReach& reach = robot.model->outer_reach();
  const Vector3d p_WCentre = robot.X_WBase * reach.centre;
  for (size_t t = 0; t < steps.size(); ++t) {
    const HandBound& bound = (*bounds)[t];
    if (!bound.place) continue;
    // The last joint's point in the hand: known along the approach; across it, only its distance is known.
    Vector3d p_W = bound.place->centre;
    double slack = bound.place->radius;
    if (bound.approach) {
      p_W += *bound.approach * reach.p_HW.z();
      slack += reach.p_HW.head<2>().norm();
    } else {
      slack += reach.p_HW.norm();
    }
    const double beyond = (p_W - p_WCentre).norm() - slack - reach.radius;
    if (beyond <= kProof) continue;
    char text[64];
    FormatInto(text, sizeof text, ": %.1f cm beyond reach", 100 * beyond);
    return ReachRefutation{steps[t].action_index, steps[t].action + text,
                           UnmovedBelow(facts.problem(), steps, static_cast<int>(t))};
  }
  return std::nullopt;
}

}  // namespace tether::planning
