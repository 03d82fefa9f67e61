#include "tether/planning/modes/packing.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "tether/common/limits.h"
#include "tether/geometry/distance/bounds.h"
#include "tether/geometry/distance/distance.h"

namespace tether::planning {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using math::Pose;

// The grid's spacing, m; on large supports, the number of places along each side.
constexpr double kGrid = 0.01;
constexpr double kAlongSide = 40;
// An object is tested this far above its support; its support is looked for this far below its foot, m.
constexpr double kLift = 0.002;
// The ball that looks for the support under an object's foot, m.
constexpr double kProbe = 0.004;
// The first attempts fill from each corner, along one side or the other first.
constexpr int kCorners = 8;
// Where the grasp is raised: by this share of the object's height.
constexpr double kRaised = 0.3;

Pose Raised(const Pose& X_WO, double height) { return Pose(X_WO.R, X_WO.p + height * Vector3d::UnitZ()); }

/// Turned about the vertical so that x of the object is along an axis of the support, as near to `X_WO` as
/// the quarter allows.
Pose Aligned(const Pose& X_WO, const Pose& X_WS, int quarter) {
  const Vector3d x_S = X_WS.R.transpose() * X_WO.R.col(0);
  const Vector3d y_S = X_WS.R.transpose() * X_WO.R.col(1);
  // Of the object's axes the one that is more level.
  const Vector3d& level = x_S.head<2>().norm() > y_S.head<2>().norm() ? x_S : y_S;
  const double angle = std::atan2(level.y(), level.x());
  const double off = std::remainder(angle, std::numbers::pi / 2);
  const Vector3d up_W = X_WS.R.col(2);
  return Pose(math::ExpSO3(up_W * (quarter * std::numbers::pi / 2 - off)) * X_WO.R, X_WO.p);
}

}  // namespace

Packing::Packing(const SceneFacts& facts, const std::vector<BoundStep>& steps, const KeyPoseProgram& guess)
    : facts_(facts), guess_(guess), groups_(FindGroups(steps, facts.hand())) {}

std::vector<Packing::Group> Packing::FindGroups(const std::vector<BoundStep>& steps, FrameId hand) {
  std::vector<Group> all;
  for (int t = 0; t < static_cast<int>(steps.size()); ++t) {
    const BoundStep& step = steps[ToIndex(t)];
    const bool put_down = std::any_of(step.constraints.begin(), step.constraints.end(), [&](const auto& c) {
      return c.kind->name == "rests_on" && c.parameters.Frame("object") == step.control &&
             c.parameters.Frame("on") == step.target;
    });
    if (!put_down) continue;
    int pick = -1;
    for (int s = 0; s < t; ++s) {
      const BoundStep& before = steps[ToIndex(s)];
      if (before.control == hand && before.target == step.control) pick = s;
    }
    auto group =
        std::find_if(all.begin(), all.end(), [&](const Group& g) { return g.support == step.target; });
    if (group == all.end()) group = all.insert(all.end(), {step.target, {}});
    group->placings.push_back({t, pick, step.control});
  }
  std::erase_if(all, [](const Group& group) { return group.placings.size() < kFewest; });
  return all;
}

std::optional<Packing::Arrangement> Packing::Arrange(int attempt, const Random& random) const {
  const double roomy = facts_.problem().program.object_clearance;
  const double least = facts_.problem().program.hand_clearance;
  for (const double clearance : {roomy, 0.5 * (roomy + least), least}) {
    for (const bool aligned : {false, true}) {
      for (const double raised : {0.0, kRaised}) {
        Arrangement found{{}, clearance < roomy};
        std::map<FrameId, Pose> X_W;
        const Fit fit{attempt, clearance, raised, aligned};
        if (std::all_of(groups_.begin(), groups_.end(), [&](const Group& group) {
              Random own = random;
              return ArrangeGroup(group, fit, own, found.placed, X_W);
            }))
          return found;
      }
    }
  }
  return std::nullopt;
}

bool Packing::ArrangeGroup(const Group& group, const Fit& fit, Random& random, std::map<int, Pose>& poses,
                           std::map<FrameId, Pose>& X_W) const {
  const geometry::Shape& support = *facts_.ShapeOf(group.support);
  for (const Placing& placing : group.placings) {
    PollLimitsNow();
    const Pose X_WS = PoseOf(group.support, placing.step, X_W);
    const Pose X_WGuess = guess_.tree.PoseAt(placing.object, placing.step, guess_.guess.poses);
    const geometry::Aabb box = geometry::BoundingBox(*facts_.ShapeOf(placing.object), X_WGuess);
    const double raise = placing.pick < 0 ? 0 : fit.raised * (box.upper.z() - box.lower.z());
    const Pose X_OHand = math::Between(
        X_WGuess, Raised(guess_.tree.PoseAt(facts_.hand(), placing.step, guess_.guess.poses), raise));
    const Vector2d wanted = (X_WS.Inverse() * X_WGuess.p).head<2>();
    bool placed = false;
    for (const Vector2d& p_S : Places(support, wanted, fit.attempt, random)) {
      for (int turn = fit.aligned ? 0 : -1; turn < (fit.aligned ? 4 : 0) && !placed; ++turn) {
        // The smallest turns first.
        Pose X_WO = turn < 0 ? X_WGuess : Aligned(X_WGuess, X_WS, turn < 3 ? (turn == 2 ? -1 : turn) : 2);
        const double height = (X_WS.Inverse() * X_WO.p).z();
        X_WO.p = X_WS * Vector3d(p_S.x(), p_S.y(), height);
        if (!StandsClear(placing, group.support, X_WO, fit.clearance, X_W) ||
            !HandIsClear(placing, X_WO * X_OHand, X_W))
          continue;
        placed = true;
        poses[placing.step] = math::Between(X_WS, X_WO);
        if (raise > 0) poses[placing.pick] = X_OHand;
        X_W[placing.object] = X_WO;
      }
      if (placed) break;
    }
    if (!placed) return false;
  }
  return true;
}

std::vector<Vector2d> Packing::Places(const geometry::Shape& support, const Vector2d& wanted, int attempt,
                                      Random& random) {
  const geometry::Aabb box = geometry::BoundingBox(support, Pose());
  const Vector2d low = box.lower.head<2>(), size = (box.upper - box.lower).head<2>();
  const double grid = std::max(kGrid, size.maxCoeff() / kAlongSide);
  const int nx = static_cast<int>(size.x() / grid), ny = static_cast<int>(size.y() / grid);
  std::vector<Vector2d> places;
  for (int i = 0; i <= nx; ++i) {
    for (int j = 0; j <= ny; ++j)
      places.emplace_back(low.x() + 0.5 * (size.x() - nx * grid) + i * grid,
                          low.y() + 0.5 * (size.y() - ny * grid) + j * grid);
  }
  std::vector<double> rank;
  for (const Vector2d& p : places) {
    if (attempt == 0) {
      rank.push_back((p - wanted).norm());
    } else if (attempt <= kCorners) {
      const int corner = attempt - 1;
      const double x = corner % 2 == 0 ? p.x() : -p.x(), y = corner / 2 % 2 == 0 ? p.y() : -p.y();
      rank.push_back(corner < 4 ? 1e3 * x + y : x + 1e3 * y);
    } else {
      rank.push_back(random.Uniform(0, 1));
    }
  }
  std::vector<size_t> order(places.size());
  for (size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::stable_sort(order.begin(), order.end(), [&](size_t a, size_t b) { return rank[a] < rank[b]; });
  std::vector<Vector2d> sorted;
  for (const size_t i : order) sorted.push_back(places[i]);
  return sorted;
}

Pose Packing::PoseOf(FrameId solid, int step, const std::map<FrameId, Pose>& X_W) const {
  const auto placed = X_W.find(solid);
  return placed != X_W.end() ? placed->second : guess_.tree.PoseAt(solid, step, guess_.guess.poses);
}

bool Packing::StandsClear(const Placing& placing, FrameId support, const Pose& X_WO, double clearance,
                          const std::map<FrameId, Pose>& X_W) const {
  const geometry::Shape& shape = *facts_.ShapeOf(placing.object);
  const Pose lifted = Raised(X_WO, kLift);
  for (const FrameId solid : facts_.solids()) {
    if (solid == placing.object || solid == facts_.hand()) continue;
    const geometry::Shape& other = *facts_.ShapeOf(solid);
    const Pose X_WOther = PoseOf(solid, placing.step, X_W);
    const double least = solid == support ? 0.5 * kLift : clearance;
    if (geometry::DistanceLowerBound(shape, lifted, other, X_WOther) >= least) continue;
    if (geometry::SignedDistance(shape, lifted, other, X_WOther).distance < least) return false;
  }
  // There is something under its foot, and under the foot's corners.
  const geometry::Shape& carrier = *facts_.ShapeOf(support);
  const Pose X_WS = PoseOf(support, placing.step, X_W);
  const geometry::Aabb box = geometry::BoundingBox(shape, math::Between(X_WS, X_WO));
  const geometry::Shape probe(geometry::Sphere{kProbe});
  const Vector3d middle = 0.5 * (box.lower + box.upper), half = 0.5 * (box.upper - box.lower);
  for (const double x : {-0.9, 0.0, 0.9}) {
    for (const double y : {-0.9, 0.0, 0.9}) {
      const Vector3d p(middle.x() + x * half.x(), middle.y() + y * half.y(), box.lower.z());
      if (geometry::SignedDistance(probe, Pose(X_WS * p), carrier, X_WS).distance > 0) return false;
    }
  }
  return true;
}

bool Packing::HandIsClear(const Placing& placing, const Pose& X_WHand,
                          const std::map<FrameId, Pose>& X_W) const {
  const geometry::Shape* hand = facts_.ShapeOf(facts_.hand());
  if (hand == nullptr || hand->parts.empty()) return true;
  const double least = facts_.problem().program.hand_clearance;
  for (const FrameId solid : facts_.solids()) {
    if (solid == placing.object || solid == facts_.hand()) continue;
    const geometry::Shape& other = *facts_.ShapeOf(solid);
    const Pose X_WOther = PoseOf(solid, placing.step, X_W);
    if (geometry::DistanceLowerBound(*hand, X_WHand, other, X_WOther) >= least) continue;
    if (geometry::SignedDistance(*hand, X_WHand, other, X_WOther).distance < least) return false;
  }
  return true;
}

}  // namespace tether::planning
