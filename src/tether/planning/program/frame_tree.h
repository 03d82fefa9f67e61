#pragma once

#include <vector>

#include "tether/common/id.h"
#include "tether/math/pose.h"
#include "tether/nlp/program.h"
#include "tether/scene/frames.h"
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
/// and the variable of the step is the pose between the two. Paper A, eqs. (5), (18), (19). Frames are those
/// of scene::Frames.
class FrameTree {
 public:
  /// The tree at the start: the scene's frames, and the hand at `X_WHand`, attached to the object that it
  /// holds, or to the world.
  FrameTree(const scene::Frames& frames, const scene::Scene& scene, const math::Pose& X_WHand,
            FrameId holds = {});

  int num_steps() const { return states_.next_id() - 1; }

  /// Sets the initial poses to those of `scene`, which has the same frames with the same parents, and of the
  /// hand. Steps and chains stay as they are; the parameters change.
  void MoveTo(const scene::Scene& scene, const math::Pose& X_WHand);

  /// Adds the next step. False, and nothing changes, if `target` is attached to `control`, directly or not.
  bool AddStep(FrameId control, FrameId target);

  /// Parent of a frame after a step; −1 is the start. Not valid for the world.
  FrameId ParentAt(FrameId frame, int step) const { return StateAfter(step)[frame].parent; }
  /// The last step up to `step` that moved the frame in its parent, or −1. Paper A, eq. (19).
  int LastMoved(FrameId frame, int step) const { return StateAfter(step)[frame].variable; }
  /// True if `frame` is `ancestor` or attached to it, directly or not, after a step.
  bool HangsOn(FrameId frame, FrameId ancestor, int step) const;
  /// Links from the world to the frame after a step; neighbouring given links are merged.
  Chain ChainTo(FrameId frame, int step) const;
  /// The poses of given links: of each frame in each one that it hung on at the start, directly or not.
  const std::vector<math::Pose>& parameters() const { return parameters_; }

  /// Pose in the world after a step, for given values of the steps' variables (those beyond `step` are not
  /// read).
  math::Pose PoseAt(FrameId frame, int step, const std::vector<math::Pose>& variables) const;

  using Poses = IndexedVector<FrameId, math::Pose>;
  /// Writes the poses of all frames in the world after a step.
  void PosesAt(int step, const std::vector<math::Pose>& variables, Poses& X_W) const;

 private:
  struct Node {
    FrameId parent;     // not valid: the world
    int variable = -1;  // −1: as it was at the start
  };
  using State = IndexedVector<FrameId, Node>;

  const State& StateAfter(int step) const { return states_[step + 1]; }
  /// Calls `visit` with the links from the frame to the world after a step.
  template <typename Visit>
  void ForEachLink(FrameId frame, int step, Visit visit) const;

  Poses X_start_;  // of each frame in its parent
  /// Of each frame: the index of its first parameter. They are its poses in its parent, in that one's, and so
  /// on.
  IndexedVector<FrameId, int> first_parameter_;
  IndexedVector<int, State> states_;  // states_[t + 1] is the tree after step t
  std::vector<math::Pose> parameters_;
};

}  // namespace tether::planning
