#include "tether/constraints/core/half_space_rows.h"

#include <algorithm>
#include <cstddef>

namespace tether::constraints {

void AddHalfSpaces(nlp::Role role, const std::string& label, const std::vector<HalfSpaceRow>& rows,
                   const std::vector<FrameAt>& frames, RowSink& sink) {
  const auto most = static_cast<std::ptrdiff_t>(kMostRows);
  for (auto begin = rows.begin(); begin != rows.end();) {
    const auto end = begin + std::min(most, rows.end() - begin);
    sink.Add(role, label, MakeHalfSpaces({begin, end}), frames);
    begin = end;
  }
}

}  // namespace tether::constraints
