#include "tether/planning/ik/within_reach.h"

#include <cassert>
#include <cmath>
#include <memory>
#include <vector>

#include "tether/common/random.h"
#include "tether/geometry/distance/bounds.h"
#include "tether/planning/ik/ik_search.h"
#include "tether/robot/posture.h"

namespace tether::planning {
namespace {

using Eigen::Vector3d;
using math::Pose;

constexpr int kTurns = 4;   // of the hand about the vertical, over half a turn
constexpr int kPoints = 9;  // along each side of an upper side, or the length of a part
constexpr int kStarts = 6;  // of the arm, the first its home

/// Points inside a part, along its longest side.
void AddPointsAlong(const geometry::Part& part, const Pose& X_WO, std::vector<Vector3d>& points) {
  const geometry::Aabb box = geometry::BoundingBox(part.primitive, Pose());
  const Vector3d size = box.upper - box.lower;
  Eigen::Index longest = 0;
  size.maxCoeff(&longest);
  for (int i = 0; i < kPoints; ++i) {
    Vector3d p = (box.lower + box.upper) / 2;
    p[longest] = box.lower[longest] + size[longest] * (i + 0.5) / kPoints;
    points.push_back(X_WO * (part.X_SP * p));
  }
}

std::vector<Vector3d> PointsOf(const scene::Object& object, const Pose& X_WO) {
  std::vector<Vector3d> points;
  if (object.movable()) {
    for (const geometry::Part& part : object.shape.parts) AddPointsAlong(part, X_WO, points);
    return points;
  }
  const geometry::Aabb box = geometry::BoundingBox(object.shape, X_WO);
  for (int i = 0; i < kPoints; ++i) {
    for (int j = 0; j < kPoints; ++j) {
      const Vector3d share((i + 0.5) / kPoints, (j + 0.5) / kPoints, 1);
      points.push_back(box.lower + share.cwiseProduct(box.upper - box.lower));
    }
  }
  return points;
}

}  // namespace

bool WithinReach(const robot::Model& model, const Pose& X_WBase, const scene::Scene& scene,
                 const std::string& name) {
  const scene::Object* object = scene.FindObject(name);
  assert(object != nullptr);
  const Pose X_WO = scene.InitialPose(name);
  robot::PostureSolver solver(std::shared_ptr<const robot::Model>(&model, [](const robot::Model*) {}));
  robot::PostureProblem problem;
  robot::NarrowLimits(model, kLimitMargin, problem.lower, problem.upper);
  problem.rest = model.home();
  problem.clearance = 0;
  Random random(1);
  std::vector<Eigen::VectorXd> starts(kStarts, model.home());
  for (size_t i = 1; i < starts.size(); ++i) {
    for (Eigen::Index joint = 0; joint < starts[i].size(); ++joint)
      starts[i][joint] = random.Uniform(problem.lower[joint], problem.upper[joint]);
  }
  const Eigen::Matrix3d R_down = math::RotationFromRpy({M_PI, 0, 0});
  for (const Vector3d& p_WQ : PointsOf(*object, X_WO)) {
    for (int turn = 0; turn < kTurns; ++turn) {
      const Pose X_WH(math::RotationFromRpy({0, 0, M_PI * turn / kTurns}) * R_down, p_WQ);
      problem.X_BH = math::Between(X_WBase, X_WH);
      if (BeyondReach(model, problem.X_BH) > 0) continue;
      for (const Eigen::VectorXd& start : starts) {
        robot::Posture posture;
        posture.q = start;
        solver.Solve(problem, posture);
        if (posture.reaches()) return true;
      }
    }
  }
  return false;
}

}  // namespace tether::planning
