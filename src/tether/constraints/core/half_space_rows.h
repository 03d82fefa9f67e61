#pragma once

#include <string>
#include <vector>

#include "tether/constraints/core/context.h"

namespace tether::constraints {

/// A function that a solver evaluates should not have more rows: up to here nothing is taken from the heap.
inline constexpr int kMostRows = 64;

/// Adds half spaces over (B, A), as MakeHalfSpaces takes them, in functions of no more than kMostRows rows
/// each.
void AddHalfSpaces(nlp::Role role, const std::string& label, const std::vector<HalfSpaceRow>& rows,
                   const std::vector<FrameAt>& frames, RowSink& sink);

}  // namespace tether::constraints
