#include "tether/planning/program/clearances.h"

#include <algorithm>

#include "tether/common/limits.h"
#include "tether/geometry/distance/distance.h"

namespace tether::planning {
namespace {

/// `exemptions` are those of one step that name one of the two.
bool IsExempt(const std::vector<Exemption>& exemptions, FrameId a, int part_a, FrameId b, int part_b) {
  for (const Exemption& e : exemptions) {
    if (e.a == a && e.b == b && (e.part_a < 0 || e.part_a == part_a)) return true;
    if (e.a == b && e.b == a && (e.part_a < 0 || e.part_a == part_b)) return true;
  }
  return false;
}

}  // namespace

std::vector<bool> MovedSolids(const SceneFacts& facts, const FrameTree& tree, FrameId control, int step) {
  std::vector<bool> moved;
  for (const FrameId solid : facts.solids())
    moved.push_back(solid == facts.hand() || tree.HangsOn(solid, control, step));
  return moved;
}

Clearances::Clearances(const SceneFacts& facts, const std::vector<BoundStep>& steps, const FrameTree& tree,
                       const std::vector<Exemption>& exemptions, bool tight) {
  const std::vector<FrameId>& solids = facts.solids();
  solids_.resize(facts.frames().size());
  for (const FrameId solid : solids) solids_[solid].shape = facts.ShapeOf(solid);
  const ProgramOptions& options = facts.problem().program;
  for (int t = 0; t < static_cast<int>(steps.size()); ++t) {
    const std::vector<bool> moved = MovedSolids(facts, tree, steps[ToIndex(t)].control, t);
    for (size_t a = 0; a < solids.size(); ++a) {
      PollLimits();
      if (!moved[a]) continue;
      std::vector<Exemption> exempt;
      for (const Exemption& exemption : exemptions) {
        if (exemption.step == t && (exemption.a == solids[a] || exemption.b == solids[a]))
          exempt.push_back(exemption);
      }
      const bool near = tight || solids[a] == facts.hand();
      for (size_t b = 0; b < solids.size(); ++b) {
        if (moved[b]) continue;
        const bool hand = near || solids[b] == facts.hand();
        const double clearance = hand ? options.hand_clearance : options.object_clearance;
        for (int i = 0; i < static_cast<int>(solids_[solids[a]].shape->parts.size()); ++i) {
          for (int j = 0; j < static_cast<int>(solids_[solids[b]].shape->parts.size()); ++j) {
            if (IsExempt(exempt, solids[a], i, solids[b], j)) continue;
            pairs_.push_back({t, solids[a], solids[b], i, j, clearance, false});
          }
        }
      }
    }
  }
}

template <typename Visit>
void Clearances::ForEachOpen(const FrameTree& tree, const std::vector<math::Pose>& poses, Visit visit) {
  int step = -1;
  for (ClearancePair& pair : pairs_) {
    if (pair.taken) continue;
    if (pair.step != step) {
      step = pair.step;
      tree.PosesAt(step, poses, X_W_);
      for (const FrameId frame : solids_.ids()) {
        Solid& solid = solids_[frame];
        if (solid.shape == nullptr) continue;
        solid.boxes.clear();
        const math::Pose& X_WS = X_W_[frame];
        for (const geometry::Part& part : solid.shape->parts)
          solid.boxes.push_back(geometry::BoundingBox(part.primitive, X_WS * part.X_SP));
      }
    }
    visit(pair, solids_[pair.a], solids_[pair.b]);
  }
}

std::vector<ClearancePair> Clearances::TakeNear(const FrameTree& tree, const std::vector<math::Pose>& poses,
                                                double radius) {
  std::vector<ClearancePair> near;
  ForEachOpen(tree, poses, [&](ClearancePair& pair, const Solid& a, const Solid& b) {
    const double distance = a.boxes[ToIndex(pair.part_a)].DistanceTo(b.boxes[ToIndex(pair.part_b)]);
    if (distance > pair.clearance + radius) return;
    pair.taken = true;
    near.push_back(pair);
  });
  return near;
}

bool Clearances::AnyViolated(const FrameTree& tree, const std::vector<math::Pose>& poses, double tolerance) {
  bool any = false;
  ForEachOpen(tree, poses, [&](ClearancePair& pair, const Solid& a, const Solid& b) {
    const size_t i = ToIndex(pair.part_a), j = ToIndex(pair.part_b);
    if (any || a.boxes[i].DistanceTo(b.boxes[j]) >= pair.clearance) return;
    const geometry::Part& part_a = a.shape->parts[i];
    const geometry::Part& part_b = b.shape->parts[j];
    const double distance = geometry::SignedDistance(part_a.primitive, X_W_[pair.a] * part_a.X_SP,
                                                     part_b.primitive, X_W_[pair.b] * part_b.X_SP)
                                .distance;
    any = distance < pair.clearance - tolerance;
  });
  return any;
}

}  // namespace tether::planning
