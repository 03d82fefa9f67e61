#include "tether/task/search/state_table.h"

#include <algorithm>

namespace tether::task {
namespace {

uint64_t Hash(symbolic::StateView state) {
  uint64_t hash = 0x9E3779B97F4A7C15u;
  for (uint64_t word : state) {
    hash ^= word;
    hash *= 0xBF58476D1CE4E5B9u;
    hash ^= hash >> 29;
    hash *= 0x94D049BB133111EBu;
    hash ^= hash >> 32;
  }
  return hash;
}

}  // namespace

size_t StateTable::Probe(symbolic::StateView state) const {
  const size_t mask = slots_.size() - 1;
  size_t slot = Hash(state) & mask;
  for (; slots_[slot] >= 0; slot = (slot + 1) & mask) {
    const symbolic::StateView known = (*this)[slots_[slot]];
    if (std::equal(known.begin(), known.end(), state.begin())) break;
  }
  return slot;
}

int StateTable::Insert(symbolic::StateView state, bool& is_new) {
  const size_t slot = Probe(state);
  is_new = slots_[slot] < 0;
  if (!is_new) return slots_[slot];
  const int index = static_cast<int>(size_++);
  slots_[slot] = index;
  words_.insert(words_.end(), state.begin(), state.end());
  if (size_ * 2 > slots_.size()) Grow();
  return index;
}

void StateTable::Grow() {
  slots_.assign(slots_.size() * 2, -1);
  const size_t mask = slots_.size() - 1;
  for (size_t i = 0; i < size_; ++i) {
    size_t slot = Hash((*this)[static_cast<int>(i)]) & mask;
    while (slots_[slot] >= 0) slot = (slot + 1) & mask;
    slots_[slot] = static_cast<int>(i);
  }
}

}  // namespace tether::task
