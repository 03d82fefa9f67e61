#pragma once

#include <optional>
#include <string>
#include <vector>

#include "tether/common/random.h"
#include "tether/geometry/shape.h"
#include "tether/scenario/generators/generate.h"

namespace tether::scenario {

/// Shared by the generators; not for users of the room.

/// An object of a draft scene. Everything stands level: its pose is a position and a yaw.
struct DraftObject {
  std::string name;
  geometry::Shape shape;
  Eigen::Vector3d p_W = Eigen::Vector3d::Zero();  ///< Of its frame's origin, m.
  double yaw = 0;                                 ///< rad
  double mass = 0;                                ///< kg; 0: fixed.
  int colour = 0;                                 ///< Index into a palette.
  std::string remark;                             ///< A comment beside its name.

  /// The pose of its frame in the world.
  math::Pose X_WO() const;
};

/// A draft scene, and the other contents of its file.
struct SceneDraft {
  std::string title;
  std::string command;  ///< The command line that makes it again.
  std::string about;    ///< One or two comment lines for the head of the file, without "# ".
  uint64_t seed = 0;
  std::vector<DraftObject> objects;
  Eigen::Vector3d workspace_size{0.9, 1.2, 1.0};  ///< Of the region `workspace`, m …
  Eigen::Vector3d workspace_p_W{0.65, 0, 0};      ///< … and its centre.
  double hand_radius = 0;  ///< The hand stays within this distance of the base's axis, m; 0: no such limit.
  std::string actions = "manipulation";  ///< The library.
  int max_actions = 0;
  int max_plans = 0;            ///< 0: all.
  int min_candidates = 0;       ///< 0: the default. Else the first plan ends planning as well.
  double perturb_position = 0;  ///< m
  double perturb_rotation = 0;  ///< rad

  /// Whether `object` keeps `gap` (m) from all objects so far, but for those named in `except`: its supports.
  bool IsClear(const DraftObject& object, double gap, const std::vector<std::string>& except) const;
  /// The scenario file.
  std::string Write() const;
};

/// `value` on a grid of `step`: drawn numbers have few digits, so that those written are those checked.
double OnGrid(double value, double step);

/// Uniform on the grid of 1 mm between `lower` and `upper` (m).
double DrawLength(Random& random, double lower, double upper);

/// A box with sides between `lower` and `upper` (m), on a level surface at z = 0, of wood's density.
DraftObject DrawBox(Random& random, const std::string& name, double lower, double upper);

/// The mass of wood of this volume (m³), on a grid of 5 g.
double WoodenMass(double volume);

/// "(on a b)"
std::string Fact(const std::string& predicate, const std::string& a, const std::string& b);

/// Names "block_1" … "block_n".
std::vector<std::string> Numbered(const std::string& stem, int count);

/// The names with a space between each two.
std::string Joined(const std::vector<std::string>& names);

/// The generators by kind.
GeneratedScenario GenerateHanoi(int blocks, uint64_t seed);
GeneratedScenario GenerateReach(uint64_t seed);
GeneratedScenario GenerateStack(int blocks, uint64_t seed);
GeneratedScenario GenerateSort(int objects, int regions, uint64_t seed);
GeneratedScenario GenerateBin(int objects, uint64_t seed);
GeneratedScenario GenerateClutter(int objects, uint64_t seed);
GeneratedScenario GenerateCrowd(int objects, uint64_t seed);
GeneratedScenario GenerateAround(int blocks, uint64_t seed);
GeneratedScenario GeneratePosts(int objects, uint64_t seed);
GeneratedScenario GenerateShelf(int objects, int compartments, uint64_t seed);

}  // namespace tether::scenario
