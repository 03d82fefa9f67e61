#pragma once

#include <vector>

#include "tether/geometry/distance/bounds.h"
#include "tether/planning/program/frame_tree.h"
#include "tether/planning/program/step_context.h"
#include "tether/planning/skeleton/skeleton_binding.h"

namespace tether::planning {

/// A pair whose contact a step intends. With `part_a` ≥ 0 only that part of `a`.
struct Exemption {
  int step;
  FrameId a, b;
  int part_a;
};

/// Which of SceneFacts::solids() move at a step: the control frame, everything attached to it, and the hand.
std::vector<bool> MovedSolids(const SceneFacts& facts, const FrameTree& tree, FrameId control, int step);

/// Two convex parts with a clearance at a step: `a` moves, `b` does not.
struct ClearancePair {
  int step;
  FrameId a, b;
  int part_a, part_b;
  double clearance;  ///< m
  bool taken;        ///< A program has a row for it.
};

/// All pairs of parts with a clearance in a skeleton. A program needs rows only for those that come near each
/// other; the others are checked when it is solved.
class Clearances {
 public:
  /// With `tight`, carried objects keep only the hand's clearance.
  Clearances(const SceneFacts& facts, const std::vector<BoundStep>& steps, const FrameTree& tree,
             const std::vector<Exemption>& exemptions, bool tight);

  /// The pairs that come within `radius` (m) of their clearance at these poses, by their bounding boxes, and
  /// were not returned before; marks them as taken. `poses` are the steps' variables.
  std::vector<ClearancePair> TakeNear(const FrameTree& tree, const std::vector<math::Pose>& poses,
                                      double radius);
  /// Some pair that is not taken is nearer than its clearance, by more than `tolerance`, m.
  bool AnyViolated(const FrameTree& tree, const std::vector<math::Pose>& poses, double tolerance);

 private:
  struct Solid {
    const geometry::Shape* shape = nullptr;  // null: not solid
    std::vector<geometry::Aabb> boxes;
  };
  /// Calls `visit` with every pair that is not taken, the solids' boxes and X_W_ being those of its step.
  template <typename Visit>
  void ForEachOpen(const FrameTree& tree, const std::vector<math::Pose>& poses, Visit visit);

  std::vector<ClearancePair> pairs_;  // by steps
  IndexedVector<FrameId, Solid> solids_;
  FrameTree::Poses X_W_;
};

}  // namespace tether::planning
