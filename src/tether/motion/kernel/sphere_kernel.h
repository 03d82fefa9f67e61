#pragma once

#include <array>
#include <cstdint>
#include <vector>

/// The pass over bounding spheres behind CollisionScene, for several configurations at once; not for use
/// outside this room. Numbers are single precision: `margin` in the tables covers their rounding.
namespace tether::motion::internal {

inline constexpr int kLanes = 8;       ///< Configurations at once.
inline constexpr int kMostLinks = 17;  ///< robot::kMostJoints and the base.

/// A ball in the frame of its part's link. The balls of a part cover it; `inner` is the radius of a ball
/// about the same centre that lies within it; far below zero: there is none.
struct KernelSphere {
  float centre[3];
  float outer, inner;  ///< m
};

/// A convex part of arm, hand or held object, with a ball that holds all of its spheres.
struct KernelPart {
  int link = 0;
  float centre[3] = {0, 0, 0};
  float radius = 0;
  float spread = 0;  ///< The furthest of its spheres' centres from `centre`, m.
  int first_sphere = 0, num_spheres = 0;
};

/// Parts that move together, with a ball that holds those of all of them.
struct KernelGroup {
  static constexpr int kMostParts = 32;
  int link = 0;
  float centre[3] = {0, 0, 0};
  float radius = 0;
  float spread = 0;  ///< The furthest of its spheres' centres from `centre`, m.
  int first_part = 0, num_parts = 0;
  int first_obstacle = 0, num_obstacles = 0;  ///< In `nearby`: those that any of them may ever touch.
};

/// A convex obstacle in the base frame: a core with a ball of radius `rounding` added.
struct KernelObstacle {
  enum class Kind { kBox, kSegment, kCylinder, kHull };
  Kind kind = Kind::kBox;
  float axes[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};  ///< Rows: its axes.
  float origin[3] = {0, 0, 0};
  float half[3] = {0, 0,
                   0};  ///< Of a box; radius, –, half the length of a cylinder; –, –, half of a segment.
  float rounding = 0;
  float margin = 0;
  int first_face = 0, num_faces = 0;  ///< Of a hull: (normal, offset) in its frame.
};

/// Two parts of the arm that must not touch.
struct KernelPair {
  int a = 0, b = 0;
  float margin = 0;
};

struct KernelTables {
  std::vector<std::array<float, 12>> joints;  ///< X_PJ: rotation by rows, then position.
  std::vector<KernelSphere> spheres;
  std::vector<KernelPart> parts;
  std::vector<KernelGroup> groups;
  std::vector<int> nearby;
  std::vector<KernelObstacle> obstacles;
  std::vector<std::array<float, 4>> faces;
  std::vector<KernelPair> pairs;
};

/// A straight piece of joint space, q(t) = begin + t · along, less the joints' references.
struct KernelSegment {
  float begin[kMostLinks] = {};
  float along[kMostLinks] = {};
};

/// What each lane looks at: the configuration at t, and those from t − half to t + half. No point of a part
/// moves further from where it is at t than `part_motion`, nor than half times its velocity at t plus
/// `part_curve`; no part of a pair further than `pair_motion` relative to the other. The clearance that is to
/// be kept is added to each of the three (m; one per part and pair of the tables).
struct KernelQuery {
  float t[kLanes] = {};
  int lanes = kLanes;  ///< The first so many count.
  float half = 0;
  const float* part_motion = nullptr;
  const float* part_curve = nullptr;
  const float* pair_motion = nullptr;
};

struct KernelAnswer {
  /// A part and an obstacle, or the pair −1 − `other`, that the spheres could not tell apart.
  struct Unsure {
    int part = 0, other = 0;
    uint32_t lanes = 0;
  };
  uint32_t blocked = 0;       ///< Not 0: the lanes whose configuration at t certainly collides, some of them.
  uint32_t unsure = 0;        ///< Lanes to be looked at exactly; complete unless `blocked`.
  std::vector<Unsure> pairs;  ///< What to look at; complete unless `blocked`.
};

/// Both give the same answers but for the order of `pairs`, and which of the lanes `blocked` names.
void CheckSpheresPlain(const KernelTables& tables, const KernelSegment& segment, const KernelQuery& query,
                       KernelAnswer& answer);
/// Only where HaveWideKernel().
void CheckSpheresWide(const KernelTables& tables, const KernelSegment& segment, const KernelQuery& query,
                      KernelAnswer& answer);
/// Whether this processor has AVX2.
bool HaveWideKernel();

}  // namespace tether::motion::internal
