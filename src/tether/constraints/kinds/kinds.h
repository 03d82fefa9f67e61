#pragma once

#include "tether/constraints/core/kind.h"

namespace tether::constraints {

// Each is defined in the file that holds its code; Registry() gathers them.
Kind GraspableKind();   // grasping.cc
Kind InsideKind();      // inside.cc
Kind RestsOnKind();     // placing.cc
Kind SupportedKind();   // placing.cc
Kind TouchKind();       // pushing.cc
Kind PushNormalKind();  // pushing.cc
Kind SlideKind();       // pushing.cc

}  // namespace tether::constraints
