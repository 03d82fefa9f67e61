#include "tether/symbolic/pddl/condition.h"

#include <algorithm>
#include <iterator>
#include <utility>

namespace tether::symbolic {
namespace {

bool Evaluate(const GroundFormula& formula, StateView state) {
  auto holds = [&](const GroundFormula& child) { return Evaluate(child, state); };
  switch (formula.kind) {
    case GroundFormula::Kind::kTrue:
      return true;
    case GroundFormula::Kind::kFalse:
      return false;
    case GroundFormula::Kind::kLiteral: {
      const auto atom = static_cast<size_t>(formula.atom);
      return ((state[atom / 64] >> (atom % 64) & 1) != 0) == formula.positive;
    }
    case GroundFormula::Kind::kAnd:
      return std::all_of(formula.children.begin(), formula.children.end(), holds);
    case GroundFormula::Kind::kOr:
      return std::any_of(formula.children.begin(), formula.children.end(), holds);
  }
  return false;
}

}  // namespace

GroundFormula GroundFormula::Join(Kind kind, std::vector<GroundFormula> children) {
  const Kind neutral = kind == Kind::kAnd ? Kind::kTrue : Kind::kFalse;
  const Kind absorbing = kind == Kind::kAnd ? Kind::kFalse : Kind::kTrue;
  GroundFormula joined{kind, -1, true, {}};
  for (GroundFormula& child : children) {
    if (child.kind == neutral) continue;
    if (child.kind == absorbing) return {absorbing, -1, true, {}};
    if (child.kind == kind) {
      std::move(child.children.begin(), child.children.end(), std::back_inserter(joined.children));
    } else {
      joined.children.push_back(std::move(child));
    }
  }
  if (joined.children.empty()) return {neutral, -1, true, {}};
  if (joined.children.size() == 1) {
    GroundFormula only = std::move(joined.children.front());
    return only;
  }
  return joined;
}

Condition::Condition(const GroundFormula& formula) : formula_(formula) {
  auto require = [&](const GroundFormula& literal) {
    const auto atom = static_cast<size_t>(literal.atom);
    auto it =
        std::find_if(tests_.begin(), tests_.end(), [&](const WordTest& t) { return t.word == atom / 64; });
    if (it == tests_.end()) it = tests_.insert(tests_.end(), WordTest{atom / 64, 0, 0});
    (literal.positive ? it->must : it->must_not) |= uint64_t{1} << (atom % 64);
  };
  if (formula.kind == GroundFormula::Kind::kLiteral) {
    require(formula);
  } else if (formula.kind == GroundFormula::Kind::kAnd) {
    for (const GroundFormula& child : formula.children) {
      if (child.kind == GroundFormula::Kind::kLiteral) {
        require(child);
      } else {
        rest_.push_back(child);
      }
    }
  } else if (formula.kind != GroundFormula::Kind::kTrue) {
    rest_.push_back(formula);
  }
}

bool Condition::Holds(StateView state) const {
  for (const WordTest& test : tests_) {
    const uint64_t word = state[test.word];
    if ((word & test.must) != test.must || (word & test.must_not) != 0) return false;
  }
  return std::all_of(rest_.begin(), rest_.end(), [&](const GroundFormula& f) { return Evaluate(f, state); });
}

}  // namespace tether::symbolic
