#include "tether/ltl/formula/evaluate.h"

#include <cstdint>

namespace tether::ltl {
namespace {

/// Truth of each node at each position, computed once. Under kCosafe, each node has two values: its own, and
/// that of its negation in negation normal form.
class Evaluator {
 public:
  Evaluator(const Formula& formula, const Word& word, Semantics semantics)
      : formula_(formula),
        word_(word),
        cosafe_(semantics == Semantics::kCosafe),
        known_(2 * formula.nodes().size() * (word.size() + 1), kUnknown) {}

  bool Holds(int node, size_t position, bool positive) {
    if (!cosafe_ && !positive) return !Holds(node, position, true);
    int8_t& value =
        known_[(2 * static_cast<size_t>(node) + (positive ? 1 : 0)) * (word_.size() + 1) + position];
    if (value == kUnknown) value = Compute(formula_.node(node), position, positive) ? 1 : 0;
    return value == 1;
  }

 private:
  static constexpr int8_t kUnknown = -1;

  bool Compute(const Formula::Node& node, size_t i, bool positive) {
    const size_t n = word_.size();
    const auto left = [&](size_t j, bool sign) { return Holds(node.operands.front(), j, sign); };
    const auto right = [&](size_t j, bool sign) { return Holds(node.operands.back(), j, sign); };
    switch (node.op) {
      case Operator::kFalse:
        return !positive;
      case Operator::kTrue:
        return positive;
      case Operator::kAtom:
        return i < n && IsTrue(word_[i], node.atom) == positive;
      case Operator::kNot:
        return left(i, !positive);
      case Operator::kAnd:
      case Operator::kOr:
        for (int operand : node.operands) {
          const bool decisive = (node.op == Operator::kOr) == positive;
          if (Holds(operand, i, positive) == decisive) return decisive;
        }
        return (node.op == Operator::kAnd) == positive;
      case Operator::kImplies:
        return positive ? left(i, false) || right(i, true) : left(i, true) && right(i, false);
      case Operator::kXor:
      case Operator::kEquivalent: {
        const bool same = (node.op == Operator::kEquivalent) == positive;
        return (left(i, true) && right(i, same)) || (left(i, false) && right(i, !same));
      }
      case Operator::kNext:
        return i + 1 < n ? left(i + 1, positive) : !cosafe_;
      case Operator::kStrongNext:
        return i + 1 < n && left(i + 1, positive);
      default:
        return positive ? ComputeTemporal(node, i) : ComputeNegatedTemporal(node, i);
    }
  }

  bool ComputeTemporal(const Formula::Node& node, size_t i) {
    const size_t n = word_.size();
    for (size_t j = i; j < n; ++j) {
      const bool first = Holds(node.operands.front(), j, true);
      const bool last = Holds(node.operands.back(), j, true);
      switch (node.op) {
        case Operator::kEventually:
          if (last) return true;
          break;
        case Operator::kAlways:
          if (!last) return false;
          break;
        case Operator::kUntil:
        case Operator::kWeakUntil:
          if (last) return true;
          if (!first) return false;
          break;
        default:  // R and M
          if (!last) return false;
          if (first) return true;
          break;
      }
    }
    return node.op == Operator::kAlways || node.op == Operator::kWeakUntil || node.op == Operator::kRelease;
  }

  /// Only under kCosafe, so the node is G, R or W; its negation is an eventuality of negated operands.
  bool ComputeNegatedTemporal(const Formula::Node& node, size_t i) {
    for (size_t j = i; j < word_.size(); ++j) {
      const bool not_first = Holds(node.operands.front(), j, false);
      const bool not_last = Holds(node.operands.back(), j, false);
      switch (node.op) {
        case Operator::kAlways:
          if (not_last) return true;
          break;
        case Operator::kRelease:
          if (not_last) return true;
          if (!not_first) return false;
          break;
        default:  // not (f W g) is (not g) U (not f & not g)
          if (!not_last) return false;
          if (not_first) return true;
          break;
      }
    }
    return false;
  }

  const Formula& formula_;
  const Word& word_;
  bool cosafe_;
  std::vector<int8_t> known_;
};

}  // namespace

bool Evaluate(const Formula& formula, const Word& word, Semantics semantics) {
  return Evaluator(formula, word, semantics).Holds(formula.root(), 0, true);
}

}  // namespace tether::ltl
