#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "tether/math/pose.h"
#include "tether/nlp/program.h"
#include "tether/scene/scene.h"

namespace tether::planning {

/// One link of a kinematic chain: the pose that a step's variable holds, or one that is given.
struct ChainLink {
  int variable = -1;   ///< Index of the step whose variable it is; −1: it is given.
  int parameter = -1;  ///< Index in FrameTree::parameters(); −1: it is a variable.
  bool operator==(const ChainLink&) const = default;
};
using Chain = std::vector<ChainLink>;

/// The kinematic tree as it changes along a skeleton: step t attaches its control frame to its target frame,
/// and the variable of the step is the pose between the two. Paper A, eqs. (5), (18), (19).
class FrameTree {
 public:
  /// The tree at the start: the scene's frames, and the hand at `X_WHand`, attached to the object that it
  /// holds, or to the world.
  FrameTree(const scene::Scene& scene, const math::Pose& X_WHand, const std::string& holds = {});

  bool Has(const std::string& frame) const { return index_.contains(frame); }
  int num_steps() const { return static_cast<int>(states_.size()) - 1; }

  /// Sets the initial poses to those of `scene`, which has the same frames with the same parents, and of the
  /// hand. Steps and chains stay as they are; the parameters change.
  void MoveTo(const scene::Scene& scene, const math::Pose& X_WHand);

  /// Adds the next step. False, and nothing changes, if `target` is attached to `control`, directly or not.
  bool AddStep(const std::string& control, const std::string& target);

  /// Parent of a frame after a step; −1 is the start. Empty for the world.
  std::string ParentAt(const std::string& frame, int step) const;
  /// The last step up to `step` that moved the frame in its parent, or −1. Paper A, eq. (19).
  int LastMoved(const std::string& frame, int step) const;
  /// True if `frame` is `ancestor` or attached to it, directly or not, after a step.
  bool HangsOn(const std::string& frame, const std::string& ancestor, int step) const;
  /// Links from the world to the frame after a step; neighbouring given links are merged. Cached, so not to
  /// be called from several threads at once.
  const Chain& ChainTo(const std::string& frame, int step) const;
  /// The poses of the given links of all chains that ChainTo() returned so far.
  const std::vector<math::Pose>& parameters() const { return parameters_; }

  /// Pose in the world after a step, for given values of the steps' variables (those beyond `step` are not
  /// read).
  math::Pose PoseAt(const std::string& frame, int step, const std::vector<math::Pose>& variables) const;

  /// A frame's index, for the functions below.
  int IndexOf(const std::string& frame) const { return index_.at(frame); }
  /// Writes the poses of all frames in the world after a step, by their indices.
  void PosesAt(int step, const std::vector<math::Pose>& variables, std::vector<math::Pose>& X_W) const;

 private:
  struct Node {
    int parent = -1;    // index; −1 is the world
    int variable = -1;  // −1: as it was at the start
  };
  /// Pose of a frame in one that it hung on at the start, directly or not.
  math::Pose PoseAtStart(int frame, int ancestor) const;
  int ParameterOf(int frame, int ancestor) const;

  std::map<std::string, int> index_;
  std::vector<std::string> names_;
  std::vector<math::Pose> X_start_;        // of each frame in its parent
  std::vector<std::vector<Node>> states_;  // states_[t + 1] is the tree after step t
  // What was asked for so far:
  mutable std::vector<std::vector<Chain>> chains_;  // of states_, by frames; empty: not yet
  mutable std::vector<math::Pose> parameters_;
  mutable std::vector<std::pair<int, int>> parameter_frames_;  // (frame, ancestor)
};

}  // namespace tether::planning
