#include "tether/symbolic/grounding/instantiate.h"

#include <algorithm>
#include <set>
#include <utility>

namespace tether::symbolic {
namespace {

/// The literals of a conjunction or disjunction of nothing else, in order; empty for others.
std::vector<std::pair<int, bool>> LiteralsOf(const GroundFormula& formula) {
  if (formula.kind == GroundFormula::Kind::kLiteral) return {{formula.atom, formula.positive}};
  std::vector<std::pair<int, bool>> literals;
  for (const GroundFormula& child : formula.children) {
    if (child.kind != GroundFormula::Kind::kLiteral) return {};
    literals.emplace_back(child.atom, child.positive);
  }
  std::sort(literals.begin(), literals.end());
  literals.erase(std::unique(literals.begin(), literals.end()), literals.end());
  return literals;
}

}  // namespace

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
    atom.arguments.push_back(term.is_variable ? binding[term.index] : term.index);
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

void Instantiator::ForEachMatch(const std::vector<TypedName>& variables, const Formula& formula,
                                bool positive, const std::vector<int>& binding,
                                const std::function<bool(std::vector<int>&)>& visit) {
  std::vector<int> scratch;
  JoinVariables(
      facts_, types_, variables, Conjuncts(formula, positive), binding,
      [&](const Literal& literal, const std::vector<int>& bound) {
        scratch = bound;
        return Instantiate(*literal.formula, scratch, literal.positive).is_false();
      },
      [&] { CountStep(); }, visit);
}

/// Joined are the necessary literals of a disjunction's part, and for a conjunction those that make a part of
/// it false: other bindings have no part.
GroundFormula Instantiator::InstantiateQuantifier(const Formula& formula, const std::vector<int>& binding,
                                                  bool positive) {
  using Kind = Formula::Kind;
  const auto is_all = [](const Formula& f, bool sign) { return (f.kind == Kind::kForall) == sign; };
  const bool all = is_all(formula, positive);
  std::vector<TypedName> variables = formula.variables;
  const Formula* body = &formula.children[0];
  bool sign = positive;
  for (;; body = &body->children[0]) {
    if (body->kind == Kind::kNot) {
      sign = !sign;
    } else if ((body->kind == Kind::kForall || body->kind == Kind::kExists) && is_all(*body, sign) == all) {
      variables.insert(variables.end(), body->variables.begin(), body->variables.end());
    } else {
      break;
    }
  }
  std::vector<GroundFormula> parts;
  std::set<std::vector<std::pair<int, bool>>> seen;
  bool settled = false;
  ForEachMatch(variables, *body, sign != all, binding, [&](std::vector<int>& bound) {
    GroundFormula part = Instantiate(*body, bound, sign);
    settled = all ? part.is_false() : part.is_true();
    if (settled) return false;
    if (all ? part.is_true() : part.is_false()) return true;
    auto literals = LiteralsOf(part);
    if (literals.empty() || seen.insert(std::move(literals)).second) parts.push_back(std::move(part));
    return true;
  });
  if (settled) return GroundFormula::Constant(!all);
  return GroundFormula::Join(all ? GroundFormula::Kind::kAnd : GroundFormula::Kind::kOr, std::move(parts));
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
    case Kind::kExists:
      return InstantiateQuantifier(formula, binding, positive);
  }
  return {};
}

}  // namespace tether::symbolic
