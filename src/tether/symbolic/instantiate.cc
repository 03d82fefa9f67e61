#include "tether/symbolic/instantiate.h"

#include <algorithm>
#include <utility>

namespace tether::symbolic {
const std::vector<int>& TypeIndex::ObjectsOf(const std::vector<int>& types) {
  const auto [it, is_new] = objects_.try_emplace(types);
  if (is_new) {
    for (size_t i = 0; i < problem_.objects.size(); ++i) {
      if (problem_.domain->Fits(problem_.objects[i].types, types)) it->second.push_back(static_cast<int>(i));
    }
  }
  return it->second;
}

Atom Instantiator::Bind(int predicate, const std::vector<Term>& terms, const std::vector<int>& binding) {
  Atom atom{predicate, {}};
  atom.arguments.reserve(terms.size());
  for (const Term& term : terms) {
    atom.arguments.push_back(term.is_variable ? binding[static_cast<size_t>(term.index)] : term.index);
  }
  return atom;
}

bool Instantiator::ForEach(const std::vector<TypedName>& variables, std::vector<int>& binding,
                           const std::function<bool()>& visit) {
  std::function<bool(size_t)> choose = [&](size_t depth) {
    CountStep();
    if (depth == variables.size()) return visit();
    for (int object : types_.ObjectsOf(variables[depth].types)) {
      binding.push_back(object);
      const bool go_on = choose(depth + 1);
      binding.pop_back();
      if (!go_on) return false;
    }
    return true;
  };
  return choose(0);
}

GroundFormula Instantiator::Instantiate(const Formula& formula, std::vector<int>& binding, bool positive) {
  using Kind = Formula::Kind;
  using Ground = GroundFormula;
  switch (formula.kind) {
    case Kind::kAtom: {
      Ground atom = ground_atom_(Bind(formula.predicate, formula.terms, binding));
      if (positive) return atom;
      if (atom.kind == Ground::Kind::kLiteral) return Ground::Literal(atom.atom, !atom.positive);
      return Ground::Constant(atom.is_false());
    }
    case Kind::kEquals: {
      const Atom pair = Bind(-1, formula.terms, binding);
      return Ground::Constant((pair.arguments[0] == pair.arguments[1]) == positive);
    }
    case Kind::kNot:
      return Instantiate(formula.children[0], binding, !positive);
    case Kind::kImply: {
      std::vector<Ground> parts;
      parts.push_back(Instantiate(formula.children[0], binding, !positive));
      parts.push_back(Instantiate(formula.children[1], binding, positive));
      return Ground::Join(positive ? Ground::Kind::kOr : Ground::Kind::kAnd, std::move(parts));
    }
    case Kind::kAnd:
    case Kind::kOr: {
      const auto kind = (formula.kind == Kind::kAnd) == positive ? Ground::Kind::kAnd : Ground::Kind::kOr;
      std::vector<Ground> parts;
      for (const Formula& child : formula.children) {
        parts.push_back(Instantiate(child, binding, positive));
        if (kind == Ground::Kind::kAnd ? parts.back().is_false() : parts.back().is_true()) break;
      }
      return Ground::Join(kind, std::move(parts));
    }
    case Kind::kForall:
    case Kind::kExists: {
      const auto kind = (formula.kind == Kind::kForall) == positive ? Ground::Kind::kAnd : Ground::Kind::kOr;
      std::vector<Ground> parts;
      ForEach(formula.variables, binding, [&] {
        parts.push_back(Instantiate(formula.children[0], binding, positive));
        return !(kind == Ground::Kind::kAnd ? parts.back().is_false() : parts.back().is_true());
      });
      return Ground::Join(kind, std::move(parts));
    }
  }
  return {};
}

}  // namespace tether::symbolic
