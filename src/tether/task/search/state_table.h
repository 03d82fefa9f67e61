#pragma once

#include <cstdint>
#include <vector>

#include "tether/symbolic/pddl/condition.h"

namespace tether::task {

/// Packed states, each once, numbered in the order in which they came: a hash table with open addressing.
class StateTable {
 public:
  explicit StateTable(size_t words) : width_(words), slots_(64, -1) {}

  /// The number of `state`; `is_new` says whether it came for the first time.
  int Insert(symbolic::StateView state, bool& is_new);
  /// -1 if it never came.
  int Find(symbolic::StateView state) const { return slots_[Probe(state)]; }
  size_t size() const { return size_; }
  /// Valid until the next Insert().
  symbolic::StateView operator[](int index) const {
    return {words_.data() + static_cast<size_t>(index) * width_, width_};
  }

 private:
  size_t Probe(symbolic::StateView state) const;
  void Grow();

  size_t width_;
  size_t size_ = 0;
  std::vector<uint64_t> words_;
  std::vector<int> slots_;  ///< State numbers, -1 free.
};

}  // namespace tether::task
