#pragma once

#include <memory>
#include <string>
#include <vector>

#include "tether/constraints/pose_function.h"
#include "tether/nlp/program.h"
#include "tether/planning/frame_tree.h"

namespace tether::planning {

/// A pose function over frames of the kinematic tree, as a residual over the steps' variables. Links that all
/// chains share at their beginning are dropped (pose functions don't change when everything moves together),
/// so that the residual depends on no more variables than it must.
std::shared_ptr<const nlp::Residual> MakeChainResidual(std::string name, int step,
                                                       constraints::PoseFunctionPtr function,
                                                       std::vector<Chain> chains);

}  // namespace tether::planning
