#include "tether/ltl/automaton/compiler.h"

#include <algorithm>
#include <utility>

namespace tether::ltl {
namespace {

/// Keeps targets, the negative ones too, away from TripleMap::kNone.
constexpr uint32_t kOffset = 0x80000000u;

}  // namespace

Compiler::Compiler(const Core& core, const DiagramLimits& limits) : core_(core), limits_(limits) {}

std::optional<Diagram> Compiler::Compile(Core::Ref f) {
  if (core_.node(f).kind != Core::Kind::kAnd || !core_.IsTemporal(f)) return CompileByProgression(f);
  std::optional<Diagram> diagram = CompileConjunction(f & ~1u);
  if (diagram && Core::IsNegated(f)) diagram = Complement(*std::move(diagram));
  return diagram;
}

std::optional<Diagram> Compiler::CompileConjunction(Core::Ref f) {
  std::vector<Diagram> parts;
  for (Core::Ref conjunct : core_.Conjuncts(f)) {
    std::optional<Diagram> part = Compile(conjunct);
    if (!part) return std::nullopt;
    parts.push_back(*std::move(part));
  }
  return IntersectAll(std::move(parts));
}

std::optional<Diagram> Compiler::IntersectAll(std::vector<Diagram> parts) const {
  while (parts.size() > 1) {
    // The two smallest, earlier ones first among equals; their product goes to the end of the queue.
    const auto smaller = [](const Diagram& x, const Diagram& y) { return x.nodes.size() < y.nodes.size(); };
    const auto take_smallest = [&] {
      const auto smallest = std::min_element(parts.begin(), parts.end(), smaller);
      Diagram diagram = std::move(*smallest);
      parts.erase(smallest);
      return diagram;
    };
    const Diagram a = take_smallest();
    const Diagram b = take_smallest();
    const std::optional<Diagram> product = Intersect(a, b, limits_);
    if (!product) return std::nullopt;
    parts.push_back(Minimize(*product));
  }
  return std::move(parts.front());
}

std::optional<Diagram> Compiler::CompileByProgression(Core::Ref f) {
  try {
    if (!progression_) progression_ = std::make_unique<Progression>(core_, limits_.max_nodes);
    diagram_ = {};
    states_.clear();
    state_numbers_.Clear();
    converted_.Clear();
    states_.push_back(progression_->Initial(f));
    state_numbers_.FindOrInsert(states_.front(), 0, 0, 0);
    for (size_t s = 0; s < states_.size(); ++s) {
      if (states_.size() > limits_.max_states) return std::nullopt;
      const Target root = Convert(progression_->Transition(states_[s]));
      diagram_.roots.push_back(root);
      diagram_.accepting.push_back(progression_->IsAccepting(states_[s]));
    }
  } catch (const Bdd::TooLarge&) {
    progression_.reset();
    return std::nullopt;
  }
  return Minimize(diagram_);
}

Target Compiler::Convert(Bdd::Ref transition) {
  const Bdd& bdd = progression_->bdd();
  if (bdd.Level(transition) >= progression_->first_state_level()) {
    const auto fresh = static_cast<uint32_t>(states_.size());
    const uint32_t state = state_numbers_.FindOrInsert(transition, 0, 0, fresh);
    if (state == fresh) states_.push_back(transition);
    return ~static_cast<int>(state);
  }
  const uint32_t cached = converted_.Find(transition, 0, 0);
  if (cached != TripleMap::kNone) return static_cast<Target>(cached - kOffset);
  const Target low = Convert(bdd.Low(transition));
  const Target high = Convert(bdd.High(transition));
  const auto node = static_cast<Target>(diagram_.nodes.size());
  diagram_.nodes.push_back({bdd.Level(transition), low, high});
  converted_.FindOrInsert(transition, 0, 0, static_cast<uint32_t>(node) + kOffset);
  return node;
}

}  // namespace tether::ltl
