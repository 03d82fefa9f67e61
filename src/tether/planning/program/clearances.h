#pragma once

#include <string>
#include <vector>

#include "tether/geometry/distance/bounds.h"
#include "tether/planning/program/frame_tree.h"
#include "tether/planning/program/step_context.h"
#include "tether/planning/skeleton/skeleton_binding.h"

namespace tether::planning {

/// A pair that touches on purpose at a step. With `part_a` ≥ 0 only that part of `a`.
struct Exemption {
  int step;
  std::string a, b;
  int part_a;
};

/// Of SceneFacts::solids(), those that move at a step: the control frame, everything that hangs on it, and
/// the hand.
std::vector<bool> MovedSolids(const SceneFacts& facts, const FrameTree& tree, const std::string& control,
                              int step);

/// Two convex parts that have to keep apart at a step: `a` is of what moves, `b` of the rest.
struct ClearancePair {
  int step;
  int solid_a, solid_b;  ///< In SceneFacts::solids().
  int part_a, part_b;
  double clearance;  ///< m
  bool taken;        ///< A program has a row for it.
};

/// All pairs of parts that have to keep apart in a skeleton, of which a program needs only those that come
/// near each other: the others are looked at again when it is solved.
class Clearances {
 public:
  /// With `tight`, carried objects keep only the hand's clearance.
  Clearances(const SceneFacts& facts, const std::vector<BoundStep>& steps, const FrameTree& tree,
             const std::vector<Exemption>& exemptions, bool tight);

  /// Takes the pairs that come within `radius` of their clearance at these poses, by their bounding boxes,
  /// and were not taken before. `poses` are the steps' variables.
  std::vector<ClearancePair> TakeNear(const FrameTree& tree, const std::vector<math::Pose>& poses,
                                      double radius);
  /// Some pair that was not taken is nearer than its clearance, by more than `tolerance`.
  bool AnyViolated(const FrameTree& tree, const std::vector<math::Pose>& poses, double tolerance);

 private:
  struct Solid {
    const geometry::Shape* shape;
    int frame;  // in the tree
    std::vector<geometry::Aabb> boxes;
  };
  /// Calls `visit` with every pair that is not taken, the solids' boxes and X_W_ being those of its step.
  template <typename Visit>
  void ForEachOpen(const FrameTree& tree, const std::vector<math::Pose>& poses, Visit visit);

  std::vector<ClearancePair> pairs_;  // by steps
  std::vector<Solid> solids_;
  std::vector<math::Pose> X_W_;
};

}  // namespace tether::planning
