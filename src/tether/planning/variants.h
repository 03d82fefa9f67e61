#pragma once

#include <optional>
#include <set>
#include <vector>

#include "tether/planning/program_builder.h"

namespace tether::planning {

/// Enumerates the ways to make a program's discrete choices, in the order of the sum of their scores, each
/// once. Which choices there are shows only when a program is built, so the queue grows as variants are
/// expanded.
class VariantQueue {
 public:
  /// Yields at most `limit` variants.
  explicit VariantQueue(int limit);

  /// The next variant, first the one that takes every first option; none at the end.
  std::optional<Variant> Next();
  /// Tells which choices `variant` met: its neighbours, one choice taken one option further, join the queue.
  void Expand(const Variant& variant, const std::vector<ChoicePoint>& choices);
  /// Every variant has been yielded.
  bool exhausted() const { return queue_.empty(); }

 private:
  struct Entry {
    double score;
    int order;  // of insertion: ties are deterministic
    Variant variant;
    bool operator<(const Entry& other) const {
      return score != other.score ? score < other.score : order < other.order;
    }
  };
  std::set<Entry> queue_;
  std::set<Variant> seen_;
  int limit_;
  int inserted_ = 0;
  int yielded_ = 0;
};

}  // namespace tether::planning
