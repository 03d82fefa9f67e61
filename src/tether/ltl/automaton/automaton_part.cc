#include "tether/ltl/automaton/automaton_part.h"

#include <algorithm>
#include <map>
#include <optional>
#include <utility>

#include "tether/ltl/automaton/compiler.h"
#include "tether/ltl/formula/core.h"
#include "tether/ltl/formula/progression.h"

namespace tether::ltl {
namespace {

class CompiledPart : public AutomatonPart {
 public:
  CompiledPart(const std::vector<std::string>& atoms, Diagram diagram)
      : automaton_(atoms, std::move(diagram)) {
    for (int s = 0; s < automaton_.states(); ++s) relevant_.push_back(automaton_.RelevantAtoms(s));
  }

  int Step(int state, LetterView letter) override { return automaton_.Step(state, letter); }
  bool IsAccepting(int state) const override { return automaton_.IsAccepting(state); }
  bool IsSettled(int state) const override { return automaton_.IsSettled(state); }
  int LowerBound(int state) const override { return automaton_.distance(state); }
  const std::vector<int>& RelevantAtoms(int state) const override { return relevant_[state]; }
  const Automaton* automaton() const override { return &automaton_; }

 private:
  Automaton automaton_;
  std::vector<std::vector<int>> relevant_;
};

class ProgressedPart : public AutomatonPart {
 public:
  ProgressedPart(std::shared_ptr<const Core> core, Core::Ref formula)
      : core_(std::move(core)), progression_(*core_) {
    Intern(progression_.Initial(formula));
  }

  int Step(int state, LetterView letter) override {
    std::vector<uint64_t> key{static_cast<uint64_t>(state)};
    const std::vector<int>& relevant = RelevantAtoms(state);
    for (size_t k = 0; k < relevant.size(); ++k) {
      if (k % 64 == 0) key.push_back(0);
      key.back() |= static_cast<uint64_t>(IsTrue(letter, relevant[k])) << (k % 64);
    }
    const auto [place, fresh] = steps_.try_emplace(std::move(key), -1);
    if (fresh) place->second = Intern(progression_.Step(info_[state].state, letter));
    return place->second;
  }

  bool IsAccepting(int state) const override { return info_[state].accepting; }
  bool IsSettled(int state) const override { return info_[state].state == Bdd::kTrue; }
  int LowerBound(int state) const override { return info_[state].bound; }
  const std::vector<int>& RelevantAtoms(int state) const override { return info_[state].relevant; }

 private:
  struct Info {
    Progression::State state;
    bool accepting;
    int bound;
    std::vector<int> relevant;
  };

  int Intern(Progression::State state) {
    const auto fresh = static_cast<uint32_t>(info_.size());
    const uint32_t number = numbers_.FindOrInsert(state, 0, 0, fresh);
    if (number == fresh) {
      info_.push_back({state, progression_.IsAccepting(state), progression_.LowerBound(state),
                       progression_.RelevantAtoms(state)});
    }
    return static_cast<int>(number);
  }

  std::shared_ptr<const Core> core_;
  Progression progression_;
  std::vector<Info> info_;
  TripleMap numbers_;
  std::map<std::vector<uint64_t>, int> steps_;
};

static_assert(Progression::kNever == Automaton::kNever);

/// Conjuncts, grouped so that two groups have no atom in common; groups and members in order of appearance.
std::vector<std::vector<Core::Ref>> GroupByAtoms(const Core& core) {
  std::vector<std::vector<Core::Ref>> groups;
  std::vector<size_t> group_of_atom(core.atoms(), SIZE_MAX);
  for (Core::Ref conjunct : core.Conjuncts(core.root())) {
    const size_t home = groups.size();
    groups.push_back({conjunct});
    for (int atom : core.AtomsBelow(conjunct)) {
      const size_t other = std::exchange(group_of_atom[atom], home);
      if (other == SIZE_MAX || other == home) continue;
      groups[home].insert(groups[home].begin(), groups[other].begin(), groups[other].end());
      groups[other].clear();
      std::replace(group_of_atom.begin(), group_of_atom.end(), other, home);
    }
  }
  for (auto& group : groups) std::sort(group.begin(), group.end());
  std::erase_if(groups, [](const auto& group) { return group.empty(); });
  return groups;
}

/// Builds products, smallest first, until one would be too large.
std::vector<Diagram> Combine(std::vector<Diagram> parts, size_t max_states, size_t max_nodes) {
  const auto smaller = [](const Diagram& x, const Diagram& y) { return x.states() < y.states(); };
  while (parts.size() > 1) {
    std::stable_sort(parts.begin(), parts.end(), smaller);
    // Minimisation may shrink it: the product may be somewhat larger.
    const auto product = Intersect(parts[0], parts[1], {4 * max_states, 4 * max_nodes});
    if (!product) break;
    Diagram minimal = Minimize(*product);
    if (minimal.states() > max_states || minimal.nodes.size() > max_nodes) break;
    parts.erase(parts.begin());
    parts.front() = std::move(minimal);
  }
  return parts;
}

}  // namespace

std::vector<std::unique_ptr<AutomatonPart>> SplitIntoParts(const Formula& formula, Semantics semantics,
                                                           size_t max_states, size_t max_nodes) {
  const auto core = std::make_shared<const Core>(formula, semantics);
  Compiler compiler(*core, {max_states, max_nodes});
  std::vector<std::unique_ptr<AutomatonPart>> parts;
  for (const std::vector<Core::Ref>& group : GroupByAtoms(*core)) {
    std::vector<Diagram> compiled;
    for (Core::Ref conjunct : group) {
      if (std::optional<Diagram> diagram = compiler.Compile(conjunct)) {
        compiled.push_back(*std::move(diagram));
      } else {
        parts.push_back(std::make_unique<ProgressedPart>(core, conjunct));
      }
    }
    for (Diagram& diagram : Combine(std::move(compiled), max_states, max_nodes)) {
      parts.push_back(std::make_unique<CompiledPart>(formula.atoms(), std::move(diagram)));
    }
  }
  return parts;
}

}  // namespace tether::ltl
