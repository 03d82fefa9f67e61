#pragma once

#include <string>
#include <vector>

#include "tether/motion/collision_scene.h"

namespace tether::bench {

/// A named joint's position, rad (or m, of a finger).
struct JointPosition {
  std::string name;
  double position = 0;
};

/// A motion problem as MotionBenchMaker (Chamzas et al. 2022) writes it: a planning scene and a request of
/// MoveIt, in YAML. The world is the robot's base frame.
struct MotionProblem {
  std::string name;  ///< "folder/0001"
  std::vector<motion::Obstacle> obstacles;
  std::vector<JointPosition> start;
  std::vector<std::vector<JointPosition>> goals;
  /// What the scene holds that we have no shape for: "cone (object 'hat')", "attached object 'cup'". The
  /// problem is not the one that was meant without it.
  std::vector<std::string> unknown;
};

/// The files of one problem; either may be missing.
struct MotionProblemFiles {
  std::string name, scene, request;
};

/// The pairs sceneNAME.yaml and requestNAME.yaml in a folder and those below it, by name. Throws InputError
/// if there are none.
std::vector<MotionProblemFiles> FindMotionProblems(const std::string& folder);

/// Throws InputError with all mistakes of both files.
MotionProblem ReadMotionProblem(const MotionProblemFiles& files);

}  // namespace tether::bench
