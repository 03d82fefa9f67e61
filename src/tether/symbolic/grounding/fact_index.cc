#include "tether/symbolic/grounding/fact_index.h"

#include <algorithm>

#include "tether/symbolic/grounding/instantiate.h"

namespace tether::symbolic {
namespace {

int Value(const Term& term, const std::vector<int>& binding) {
  return term.is_variable ? binding[term.index] : term.index;
}

class VariableJoin {
 public:
  using Test = std::function<bool(const Literal&, const std::vector<int>&)>;
  using Visit = std::function<bool(std::vector<int>&)>;

  VariableJoin(const FactIndex& facts, TypeIndex& types, const std::vector<TypedName>& variables,
               std::vector<int> binding, const Test& fails, const std::function<void()>& step)
      : facts_(facts), fails_(fails), step_(step), first_(binding.size()), binding_(std::move(binding)) {
    for (const TypedName& variable : variables) objects_.push_back(&types.ObjectsOf(variable.types));
    binding_.resize(first_ + variables.size(), -1);
  }

  void Run(const std::vector<Literal>& conjuncts, const Visit& visit) {
    for (const Literal& conjunct : conjuncts) {
      const bool is_atom = conjunct.formula->kind == Formula::Kind::kAtom;
      if (is_atom && !facts_.IsKnown(conjunct.formula->predicate)) continue;
      if (is_atom && conjunct.positive) {
        patterns_.push_back(conjunct.formula);
      } else if (is_atom || conjunct.formula->kind == Formula::Kind::kEquals) {
        tests_.push_back(conjunct);
      }
    }
    used_.assign(patterns_.size(), false);
    if (std::any_of(tests_.begin(), tests_.end(), [&](const Literal& test) { return Fails(test, -1); }))
      return;
    if (patterns_.empty()) {
      Extend(visit);
      return;
    }
    std::vector<std::vector<int>> found;
    Extend([&](const std::vector<int>& binding) {
      found.push_back(binding);
      return true;
    });
    std::sort(found.begin(), found.end());
    found.erase(std::unique(found.begin(), found.end()), found.end());
    for (std::vector<int>& binding : found) {
      if (!visit(binding)) return;
    }
  }

 private:
  /// `test` is known to fail now that `variable` is bound (-1: at the beginning).
  bool Fails(const Literal& test, int variable) const {
    bool concerned = variable < 0;
    for (const Term& term : test.formula->terms) {
      if (Value(term, binding_) < 0) return false;
      concerned = concerned || (term.is_variable && term.index == variable);
    }
    return concerned && fails_(test, binding_);
  }

  bool Bind(int variable, int object) {
    const std::vector<int>& fit = *objects_[static_cast<size_t>(variable) - first_];
    if (!std::binary_search(fit.begin(), fit.end(), object)) return false;
    binding_[variable] = object;
    trail_.push_back(variable);
    return std::none_of(tests_.begin(), tests_.end(),
                        [&](const Literal& test) { return Fails(test, variable); });
  }

  bool Unify(const Formula& pattern, const std::vector<int>& fact) {
    for (size_t i = 0; i < fact.size(); ++i) {
      const int bound = Value(pattern.terms[i], binding_);
      if (bound >= 0 ? bound != fact[i] : !Bind(pattern.terms[i].index, fact[i])) return false;
    }
    return true;
  }

  void Undo(size_t mark) {
    for (; trail_.size() > mark; trail_.pop_back()) binding_[trail_.back()] = -1;
  }

  /// False if a visit ended the enumeration.
  bool Extend(const Visit& visit) {
    step_();
    size_t best = patterns_.size();
    const std::vector<int>* fewest = nullptr;
    for (size_t i = 0; i < patterns_.size(); ++i) {
      if (used_[i]) continue;
      const std::vector<int>& candidates = facts_.Candidates(*patterns_[i], binding_);
      if (fewest != nullptr && candidates.size() >= fewest->size()) continue;
      best = i;
      fewest = &candidates;
    }
    const size_t mark = trail_.size();
    bool go_on = true;
    if (fewest != nullptr) {
      used_[best] = true;
      const auto& facts = facts_.facts(patterns_[best]->predicate);
      for (size_t i = 0; i < fewest->size() && go_on; ++i) {
        step_();
        if (Unify(*patterns_[best], facts[static_cast<size_t>((*fewest)[i])])) go_on = Extend(visit);
        Undo(mark);
      }
      used_[best] = false;
      return go_on;
    }
    const auto open = std::find(binding_.begin() + static_cast<std::ptrdiff_t>(first_), binding_.end(), -1);
    if (open == binding_.end()) return visit(binding_);
    const int variable = static_cast<int>(open - binding_.begin());
    const std::vector<int>& objects = *objects_[static_cast<size_t>(variable) - first_];
    for (size_t i = 0; i < objects.size() && go_on; ++i) {
      if (Bind(variable, objects[i])) go_on = Extend(visit);
      Undo(mark);
    }
    return go_on;
  }

  const FactIndex& facts_;
  const Test& fails_;
  const std::function<void()>& step_;
  size_t first_;  ///< Variables before this one are bound already.
  std::vector<const std::vector<int>*> objects_;
  std::vector<const Formula*> patterns_;
  std::vector<Literal> tests_;
  std::vector<bool> used_;
  std::vector<int> binding_, trail_;
};

void Collect(const Formula& formula, bool positive, std::vector<Literal>& conjuncts) {
  using Kind = Formula::Kind;
  switch (formula.kind) {
    case Kind::kNot:
      Collect(formula.children[0], !positive, conjuncts);
      return;
    case Kind::kAnd:
    case Kind::kOr:
      if ((formula.kind == Kind::kAnd) != positive) break;
      for (const Formula& child : formula.children) Collect(child, positive, conjuncts);
      return;
    case Kind::kImply:
      if (positive) break;
      Collect(formula.children[0], true, conjuncts);
      Collect(formula.children[1], false, conjuncts);
      return;
    default:
      break;
  }
  conjuncts.push_back({&formula, positive});
}

}  // namespace

FactIndex::FactIndex(const Problem& problem, std::vector<bool> known) : known_(std::move(known)) {
  for (const Predicate& predicate : problem.domain->predicates)
    relations_.emplace_back().with.resize(predicate.parameters.size());
}

void FactIndex::Add(const Atom& atom) {
  if (!IsKnown(atom.predicate)) return;
  Relation& relation = relations_[atom.predicate];
  const int number = static_cast<int>(relation.facts.size());
  relation.facts.push_back(atom.arguments);
  relation.all.push_back(number);
  for (size_t i = 0; i < atom.arguments.size(); ++i) relation.with[i][atom.arguments[i]].push_back(number);
}

const std::vector<int>& FactIndex::Candidates(const Formula& atom, const std::vector<int>& binding) const {
  const Relation& relation = relations_[atom.predicate];
  const std::vector<int>* fewest = &relation.all;
  for (size_t i = 0; i < atom.terms.size(); ++i) {
    const int object = Value(atom.terms[i], binding);
    if (object < 0) continue;
    const auto it = relation.with[i].find(object);
    if (it == relation.with[i].end()) return none_;
    if (it->second.size() < fewest->size()) fewest = &it->second;
  }
  return *fewest;
}

std::vector<Literal> Conjuncts(const Formula& formula, bool positive) {
  std::vector<Literal> conjuncts;
  Collect(formula, positive, conjuncts);
  return conjuncts;
}

void JoinVariables(const FactIndex& facts, TypeIndex& types, const std::vector<TypedName>& variables,
                   const std::vector<Literal>& conjuncts, const std::vector<int>& binding,
                   const std::function<bool(const Literal&, const std::vector<int>&)>& fails,
                   const std::function<void()>& step, const std::function<bool(std::vector<int>&)>& visit) {
  VariableJoin(facts, types, variables, binding, fails, step).Run(conjuncts, visit);
}

}  // namespace tether::symbolic
