#include "tether/ltl/formula/core.h"

#include <cassert>
#include <utility>

#include "tether/ltl/formula/cosafe.h"

namespace tether::ltl {

Core::Core(const Formula& formula, Semantics semantics)
    : cosafe_(semantics == Semantics::kCosafe),
      atoms_(static_cast<int>(formula.atoms().size())),
      memo_(2 * formula.nodes().size(), TripleMap::kNone) {
  RequireSemantics(formula, semantics);
  nodes_.push_back({});
  empty_.push_back(true);
  temporal_.push_back(false);
  root_ = Translate(formula, formula.root(), true);
}

Core::Ref Core::Add(Kind kind, int atom, Ref left, Ref right) {
  const auto fresh = static_cast<uint32_t>(nodes_.size());
  const uint32_t key = static_cast<uint32_t>(kind) | static_cast<uint32_t>(atom + 1) << 3;
  const uint32_t index = unique_.FindOrInsert(key, left, right, fresh);
  if (index == fresh) {
    nodes_.push_back({kind, atom, left, right});
    empty_.push_back(kind == Kind::kAnd && HoldsOnEmptyWord(left) && HoldsOnEmptyWord(right));
    temporal_.push_back(kind == Kind::kNext || kind == Kind::kUntil ||
                        (kind == Kind::kAnd && (IsTemporal(left) || IsTemporal(right))));
  }
  return index << 1;
}

Core::Ref Core::And(Ref f, Ref g) {
  if (f == g || g == kTrue) return f;
  if (f == kTrue) return g;
  if (f == kFalse || g == kFalse) return kFalse;
  if (f == Not(g)) return kFalse;
  return Add(Kind::kAnd, -1, f, g);
}

Core::Ref Core::Translate(const Formula& formula, int node, bool positive) {
  if (!cosafe_ && !positive) return Not(Translate(formula, node, true));
  const size_t slot = 2 * static_cast<size_t>(node) + (positive ? 1 : 0);
  if (memo_[slot] == TripleMap::kNone) memo_[slot] = TranslateNew(formula, formula.node(node), positive);
  return memo_[slot];
}

Core::Ref Core::TranslateNew(const Formula& formula, const Formula::Node& node, bool positive) {
  const auto left = [&](bool sign) { return Translate(formula, node.operands.front(), sign == positive); };
  const auto right = [&](bool sign) { return Translate(formula, node.operands.back(), sign == positive); };
  // A negative node is the dual of its operator on negated operands; `sign` is relative to the node's.
  const auto both = [&](Ref f, Ref g) { return positive ? And(f, g) : Or(f, g); };
  const auto either = [&](Ref f, Ref g) { return positive ? Or(f, g) : And(f, g); };
  switch (node.op) {
    case Operator::kFalse:
      return positive ? kFalse : kTrue;
    case Operator::kTrue:
      return positive ? kTrue : kFalse;
    case Operator::kAtom:
      return Add(positive ? Kind::kAtom : Kind::kNegatedAtom, node.atom, kTrue, kTrue);
    case Operator::kNot:
      return left(false);
    case Operator::kAnd:
    case Operator::kOr: {
      Ref result = Translate(formula, node.operands.front(), positive);
      for (size_t k = 1; k < node.operands.size(); ++k) {
        const Ref operand = Translate(formula, node.operands[k], positive);
        result = node.op == Operator::kAnd ? both(result, operand) : either(result, operand);
      }
      return result;
    }
    case Operator::kImplies:
      return either(left(false), right(true));
    case Operator::kXor:
    case Operator::kEquivalent: {
      const bool same = (node.op == Operator::kEquivalent) == positive;
      const auto plain = [&](size_t k, bool sign) { return Translate(formula, node.operands[k], sign); };
      return Or(And(plain(0, true), plain(1, same)), And(plain(0, false), plain(1, !same)));
    }
    case Operator::kNext:
      if (!cosafe_) return Not(Add(Kind::kNext, -1, Not(left(true)), kTrue));
      [[fallthrough]];
    case Operator::kStrongNext:
      return Add(Kind::kNext, -1, left(true), kTrue);
    case Operator::kEventually:
      assert(positive);
      return Until(kTrue, left(true));
    case Operator::kUntil:
      assert(positive);
      return Until(left(true), right(true));
    case Operator::kStrongRelease:
      assert(positive);
      return Until(right(true), And(left(true), right(true)));
    case Operator::kAlways:
      return positive ? Not(Until(kTrue, left(false))) : Until(kTrue, left(true));
    case Operator::kRelease:
      return positive ? Not(Until(left(false), right(false))) : Until(left(true), right(true));
    case Operator::kWeakUntil: {
      // f W g is not ((not g) U (not f & not g)).
      const Ref not_f = left(!positive), not_g = right(!positive);
      const Ref until = Until(not_g, And(not_f, not_g));
      return positive ? Not(until) : until;
    }
  }
  return kTrue;
}

std::vector<Core::Ref> Core::Conjuncts(Ref f) const {
  std::vector<Ref> conjuncts;
  std::vector<Ref> open{f};
  std::vector<bool> seen(2 * nodes_.size());
  while (!open.empty()) {
    const Ref next = open.back();
    open.pop_back();
    if (seen[next]) continue;
    seen[next] = true;
    if (node(next).kind == Kind::kAnd && !IsNegated(next)) {
      open.push_back(node(next).right);
      open.push_back(node(next).left);
    } else {
      conjuncts.push_back(next);
    }
  }
  return conjuncts;
}

std::vector<int> Core::AtomsBelow(Ref f) const {
  std::vector<bool> needed(nodes_.size());
  std::vector<bool> has(atoms_);
  needed[f >> 1] = true;
  for (size_t i = nodes_.size(); i-- > 0;) {
    if (!needed[i]) continue;
    needed[nodes_[i].left >> 1] = true;
    needed[nodes_[i].right >> 1] = true;
    if (nodes_[i].atom >= 0) has[nodes_[i].atom] = true;
  }
  std::vector<int> atoms;
  for (int a = 0; a < atoms_; ++a) {
    if (has[a]) atoms.push_back(a);
  }
  return atoms;
}

}  // namespace tether::ltl
