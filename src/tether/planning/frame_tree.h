#pragma once

#include <map>
#include <string>
#include <vector>

#include "tether/math/pose.h"
#include "tether/nlp/program.h"
#include "tether/scene/scene.h"

namespace tether::planning {

/// One link of a kinematic chain: a constant transform, or the pose that a step's variable holds.
struct ChainLink {
  int variable = -1;  ///< Index of the step whose variable it is; −1: constant.
  math::Pose X;       ///< The transform of a constant link.
};
using Chain = std::vector<ChainLink>;

/// The kinematic tree as it changes along a skeleton: step t hangs the frame that it controls onto its
/// target, and the variable of the step is the pose between the two. Paper A, eqs. (5), (18), (19).
class FrameTree {
 public:
  /// The tree at the start: the scene's frames, and the hand at `X_WHand`.
  FrameTree(const scene::Scene& scene, const math::Pose& X_WHand);

  bool Has(const std::string& frame) const { return index_.contains(frame); }
  int num_steps() const { return static_cast<int>(states_.size()) - 1; }

  /// Adds the next step. False, and nothing changes, if `target` itself hangs on `control`.
  bool AddStep(const std::string& control, const std::string& target);

  /// Parent of a frame after a step; −1 is the start. Empty for the world.
  std::string ParentAt(const std::string& frame, int step) const;
  /// The last step up to `step` that moved the frame in its parent, or −1. Paper A, eq. (19).
  int LastMoved(const std::string& frame, int step) const;
  /// `ancestor` is the frame itself or hangs below it nowhere: true if `frame` hangs on `ancestor`, directly
  /// or not.
  bool HangsOn(const std::string& frame, const std::string& ancestor, int step) const;
  /// Links from the world to the frame after a step; neighbouring constants are merged. Kept for the next
  /// time, so not to be called from several threads at once.
  const Chain& ChainTo(const std::string& frame, int step) const;

  /// Pose in the world after a step, for given values of the steps' variables (those beyond `step` are not
  /// read).
  math::Pose PoseAt(const std::string& frame, int step, const std::vector<math::Pose>& variables) const;

  /// A frame's index, for the functions below.
  int IndexOf(const std::string& frame) const { return index_.at(frame); }
  /// Writes the poses of all frames in the world after a step, by their indices.
  void PosesAt(int step, const std::vector<math::Pose>& variables, std::vector<math::Pose>& X_W) const;

 private:
  struct Node {
    int parent = -1;  // index; −1 is the world
    ChainLink link;
  };
  std::map<std::string, int> index_;
  std::vector<std::string> names_;
  std::vector<std::vector<Node>> states_;  // states_[t + 1] is the tree after step t
  mutable std::vector<std::vector<Chain>> chains_;  // of states_, by frames; empty: not asked for yet
};

}  // namespace tether::planning
