#pragma once

#include <tuple>
#include <utility>
#include <vector>

#include "tether/common/id.h"
#include "tether/constraints/core/memo.h"
#include "tether/constraints/grasps/contact.h"
#include "tether/constraints/grasps/grasp.h"
#include "tether/constraints/grasps/upper_face.h"
#include "tether/constraints/kinds/placement.h"

namespace tether::constraints {

/// What follows from shapes and parameters alone, known of a problem so far: the same for all its programs.
struct KnownOfScene {
  Memo<FrameId, std::vector<UpperFace>> upper_faces;
  Memo<std::pair<FrameId, FrameId>, bool> bridges;                  ///< Of an object, on another.
  Memo<std::tuple<FrameId, FrameId, int>, Placement> placements;    ///< Of an object, on another, on a face.
  Memo<std::tuple<FrameId, FrameId, int, double>, Demand> demands;  ///< … on a part, with a margin.
};

/// What also depends on poses before a step, known of a program so far.
struct KnownOfProgram {
  Memo<std::pair<FrameId, int>, std::vector<Grasp>> grasps;                ///< Of an object, at a step.
  Memo<std::tuple<FrameId, FrameId, int>, std::vector<Contact>> contacts;  ///< Of a tool, with an object.
};

}  // namespace tether::constraints
