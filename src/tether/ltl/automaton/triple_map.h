#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace tether::ltl {

/// A hash map from three 32-bit numbers to one; nothing can be erased. The tables of decision diagrams.
class TripleMap {
 public:
  static constexpr uint32_t kNone = 0xffffffffu;

  explicit TripleMap(size_t expected = 16) { Reserve(expected); }

  /// The value of the key, kNone if there is none.
  uint32_t Find(uint32_t a, uint32_t b, uint32_t c) const { return slots_[Probe(a, b, c)].value; }

  /// The value of the key; if there is none, `fresh` becomes it. `fresh` is not kNone.
  uint32_t FindOrInsert(uint32_t a, uint32_t b, uint32_t c, uint32_t fresh) {
    Slot& slot = slots_[Probe(a, b, c)];
    if (slot.value != kNone) return slot.value;
    slot = {a, b, c, fresh};
    if (2 * ++size_ > slots_.size()) Reserve(2 * size_);
    return fresh;
  }

  size_t size() const { return size_; }
  /// Forgets everything, keeps the memory.
  void Clear() {
    slots_.assign(slots_.size(), Slot{});
    size_ = 0;
  }

 private:
  struct Slot {
    uint32_t a = 0, b = 0, c = 0;
    uint32_t value = kNone;
  };

  size_t Probe(uint32_t a, uint32_t b, uint32_t c) const {
    const size_t mask = slots_.size() - 1;
    uint64_t hash = (static_cast<uint64_t>(b) << 32 | c) * 0x9e3779b97f4a7c15u;
    hash = (hash ^ (hash >> 32) ^ a) * 0xbf58476d1ce4e5b9u;
    size_t i = static_cast<size_t>(hash ^ (hash >> 29)) & mask;
    while (slots_[i].value != kNone && (slots_[i].a != a || slots_[i].b != b || slots_[i].c != c)) {
      i = (i + 1) & mask;
    }
    return i;
  }

  /// Room for twice as many as expected, so that probes stay short.
  void Reserve(size_t expected) {
    size_t capacity = 16;
    while (capacity < 2 * expected) capacity *= 2;
    std::vector<Slot> old(capacity);
    old.swap(slots_);
    for (const Slot& slot : old) {
      if (slot.value != kNone) slots_[Probe(slot.a, slot.b, slot.c)] = slot;
    }
  }

  std::vector<Slot> slots_;
  size_t size_ = 0;
};

}  // namespace tether::ltl
