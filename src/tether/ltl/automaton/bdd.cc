#include "tether/ltl/automaton/bdd.h"

#include "tether/common/limits.h"

#include <algorithm>
#include <utility>

namespace tether::ltl {

Bdd::Bdd(size_t max_nodes) : max_nodes_(max_nodes) { nodes_.push_back({kTerminalLevel, kTrue, kTrue}); }

Bdd::Ref Bdd::MakeNode(int level, Ref low, Ref high) {
  if (low == high) return low;
  const Ref negated = high & 1;
  low ^= negated;
  high ^= negated;
  const auto fresh = static_cast<Ref>(nodes_.size());
  const Ref index = unique_.FindOrInsert(static_cast<uint32_t>(level), low, high, fresh);
  if (index == fresh) {
    if (nodes_.size() >= max_nodes_) throw TooLarge{};
    PollLimits();
    nodes_.push_back({level, low, high});
  }
  return index << 1 | negated;
}

Bdd::Ref Bdd::Ite(Ref f, Ref g, Ref h) {
  if (f == kTrue) return g;
  if (f == kFalse) return h;
  if (g == f) g = kTrue;
  if (g == Not(f)) g = kFalse;
  if (h == f) h = kFalse;
  if (h == Not(f)) h = kTrue;
  if (g == h) return g;
  if (g == kTrue && h == kFalse) return f;
  if (g == kFalse && h == kTrue) return Not(f);
  // One of the equivalent triples, so that the cache is hit more often: f and g are not complemented, and
  // conjunctions have their smaller operand first.
  if (f & 1) {
    f = Not(f);
    std::swap(g, h);
  }
  const Ref negated = g & 1;
  g ^= negated;
  h ^= negated;
  if (h == kFalse && g < f && (g & 1) == 0 && g != kTrue) std::swap(f, g);
  const Ref cached = ite_cache_.Find(f, g, h);
  if (cached != TripleMap::kNone) return cached ^ negated;
  const int level = std::min({Level(f), Level(g), Level(h)});
  const Ref low = Ite(LowAt(f, level), LowAt(g, level), LowAt(h, level));
  const Ref high = Ite(HighAt(f, level), HighAt(g, level), HighAt(h, level));
  const Ref result = MakeNode(level, low, high);
  ite_cache_.FindOrInsert(f, g, h, result);
  return result ^ negated;
}

}  // namespace tether::ltl
