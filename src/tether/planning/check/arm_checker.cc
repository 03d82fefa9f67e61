#include "tether/planning/check/arm_checker.h"

#include <algorithm>

#include "tether/geometry/distance/bounds.h"
#include "tether/geometry/distance/distance.h"

namespace tether::planning {
namespace {

using math::Pose;
using nlp::Unit;

/// Minus their distance, m; 0 where bounds show them apart.
double Overlap(const geometry::Shape& a, const Pose& X_WA, const geometry::Shape& b, const Pose& X_WB) {
  if (geometry::DistanceLowerBound(a, X_WA, b, X_WB) > 0) return 0;
  return -geometry::SignedDistance(a, X_WA, b, X_WB).distance;
}

}  // namespace

ArmChecker::ArmChecker(const SceneFacts& facts)
    : facts_(facts),
      model_(*facts.problem().robot.model),
      state_(facts.problem().robot.model),
      kinematics_(facts.problem().robot.model),
      at_start_(facts.problem().robot.model),
      hand_(model_.HandShape(model_.gripper().max_opening)) {
  if (const Eigen::VectorXd& q = facts.problem().robot.q; q.size() > 0) at_start_.Set(q);
}

void ArmChecker::Check(const FrameTree& tree, const std::vector<Pose>& poses, int step, const Pose& X_WHand,
                       const Eigen::VectorXd& q, constraints::Findings& findings) {
  const ActingRobot& robot = facts_.problem().robot;
  if (q.size() != model_.dof()) return findings.Report("joints of " + robot.name, Unit::kRadian, 1e9);
  for (int i = 0; i < model_.dof(); ++i) {
    const double outside = std::max(model_.lower()[i] - q[i], q[i] - model_.upper()[i]);
    findings.Report("limit of " + model_.joint_names()[ToIndex(i)], Unit::kRadian, outside);
  }
  state_.Set(q, Eigen::VectorXd::Zero(q.size()));
  const Pose off = math::Between(robot.X_WBase * state_.X_BH(), X_WHand);
  findings.Report("hand of " + robot.name + " at its joints", Unit::kMetre, off.p.norm());
  findings.Report("hand of " + robot.name + " at its joints", Unit::kRadian,
                  math::AngleBetween(off.R, Eigen::Matrix3d::Identity()));
  kinematics_.Set(q);
  CheckLinks(tree, poses, step, findings);
}

void ArmChecker::CheckLinks(const FrameTree& tree, const std::vector<Pose>& poses, int step,
                            constraints::Findings& findings) {
  const ActingRobot& robot = facts_.problem().robot;
  const robot::ArmSolids& solids = model_.solids();
  geometry::Aabb arm;
  for (int k = 0; k < solids.hand(); ++k) {
    const geometry::Shape& link = solids.links[ToIndex(k)].shape;
    arm.Include(geometry::BoundingBox(link, robot.X_WBase * kinematics_.X_BSolid(k)));
  }
  for (const FrameId solid : facts_.solids()) {
    if (solid == facts_.hand()) continue;
    const geometry::Shape& shape = *facts_.ShapeOf(solid);
    const Pose X_WO = tree.PoseAt(solid, step, poses);
    if (arm.DistanceTo(geometry::BoundingBox(shape, X_WO)) > 0) continue;
    const Pose X_WStart = tree.PoseAt(solid, -1, poses);
    const bool still = (X_WO.p - X_WStart.p).norm() < 1e-9 && math::AngleBetween(X_WO.R, X_WStart.R) < 1e-6;
    for (int k = 0; k < solids.hand(); ++k) {
      const robot::LinkSolid& link = solids.links[ToIndex(k)];
      // What touches the arm at the start is meant to touch it.
      if (still &&
          (link.link == 0 || Overlap(link.shape, robot.X_WBase * at_start_.X_BSolid(k), shape, X_WO) > 0))
        continue;
      const double overlap = Overlap(link.shape, robot.X_WBase * kinematics_.X_BSolid(k), shape, X_WO);
      findings.Report("clearance(" + robot.name + "'s " + link.name + ", " + facts_.Name(solid) + ")",
                      Unit::kMetre, overlap);
    }
  }
  const auto shape = [&](int solid) -> const geometry::Shape& {
    return solid == solids.hand() ? hand_ : solids.links[ToIndex(solid)].shape;
  };
  const auto name = [&](int solid) {
    return robot.name + "'s " + (solid == solids.hand() ? "hand" : solids.links[ToIndex(solid)].name);
  };
  for (const auto& [a, b] : solids.pairs) {
    findings.Report("clearance(" + name(a) + ", " + name(b) + ")", Unit::kMetre,
                    Overlap(shape(a), kinematics_.X_BSolid(a), shape(b), kinematics_.X_BSolid(b)));
  }
}

}  // namespace tether::planning
