#pragma once

#include <string>
#include <vector>

#include "tether/constraints/core/context.h"

namespace tether::constraints {

/// The most rows that a function of a solver should have: up to here its evaluation allocates nothing.
inline constexpr int kMostRows = 64;

/// Adds half spaces over frames (B, A), as in MakeHalfSpaces, in functions of no more than kMostRows rows
/// each.
void AddHalfSpaces(nlp::Role role, const std::string& label, const std::vector<HalfSpaceRow>& rows,
                   const std::vector<FrameAt>& frames, RowSink& sink);

}  // namespace tether::constraints
