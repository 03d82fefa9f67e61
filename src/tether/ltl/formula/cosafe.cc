#include "tether/ltl/formula/cosafe.h"

#include <algorithm>
#include <utility>

#include "tether/ltl/formula/parser.h"

namespace tether::ltl {
namespace {

std::string At(const Formula::Node& node) {
  return node.column > 0 ? " at column " + std::to_string(node.column) : "";
}

/// Walks a formula with the polarity of each node: under an even or odd number of negations. Nodes below
/// <-> and xor have both.
class PolarityWalk {
 public:
  explicit PolarityWalk(const Formula& formula) : formula_(formula), seen_(2 * formula.nodes().size()) {}
  virtual ~PolarityWalk() = default;

  void Walk() { Visit(formula_.root(), true, nullptr); }

 protected:
  /// `negation` is the operator that turned the node negative last, if it is negative.
  virtual void OnNode(const Formula::Node& node, bool positive, const Formula::Node* negation) = 0;

 private:
  void Visit(int i, bool positive, const Formula::Node* negation) {
    std::vector<bool>::reference seen = seen_[2 * static_cast<size_t>(i) + (positive ? 1 : 0)];
    if (seen) return;
    seen = true;
    const Formula::Node& node = formula_.node(i);
    OnNode(node, positive, negation);
    for (size_t k = 0; k < node.operands.size(); ++k) {
      const bool both = node.op == Operator::kXor || node.op == Operator::kEquivalent;
      const bool flips = node.op == Operator::kNot || (node.op == Operator::kImplies && k == 0);
      if (both || !flips) Visit(node.operands[k], positive, negation);
      if (both || flips) Visit(node.operands[k], !positive, positive ? &node : nullptr);
    }
  }

  const Formula& formula_;
  std::vector<bool> seen_;
};

class CosafeWalk : public PolarityWalk {
 public:
  using PolarityWalk::PolarityWalk;

  std::vector<CosafeViolation> Violations() {
    Walk();
    std::stable_sort(found_.begin(), found_.end(),
                     [](const auto& a, const auto& b) { return a.column < b.column; });
    return std::move(found_);
  }

 protected:
  void OnNode(const Formula::Node& node, bool positive, const Formula::Node* negation) override {
    const std::string quoted = "'" + std::string(Symbol(node.op)) + "'";
    switch (node.op) {
      case Operator::kAlways:
        if (positive) Add(node, quoted + " requires something at every position for ever");
        break;
      case Operator::kRelease:
        if (positive) Add(node, quoted + " requires its right side for ever unless its left side comes");
        break;
      case Operator::kWeakUntil:
        if (positive) Add(node, quoted + " may be satisfied by its left side for ever");
        break;
      case Operator::kEventually:
      case Operator::kUntil:
      case Operator::kStrongRelease:
        if (!positive && negation != nullptr) {
          Add(node, quoted + " is negated by '" + std::string(Symbol(negation->op)) + "'" + At(*negation) +
                        ", which requires that something never happens");
        }
        break;
      default:
        break;
    }
  }

 private:
  void Add(const Formula::Node& node, const std::string& why) {
    found_.push_back({node.column, why + "; no finite word is enough to tell"});
  }

  std::vector<CosafeViolation> found_;
};

/// Whether `op` is an eventuality: it may be fulfilled at a later position.
bool IsEventuality(Operator op) {
  return op == Operator::kEventually || op == Operator::kUntil || op == Operator::kStrongRelease;
}

class WeakNextWalk : public PolarityWalk {
 public:
  explicit WeakNextWalk(const Formula& formula) : PolarityWalk(formula), formula_(formula) {}

  std::vector<const Formula::Node*> Suspects() {
    for (const Formula::Node& node : formula_.nodes()) {
      if (node.op == Operator::kStrongNext) return {};
    }
    Walk();
    return std::move(found_);
  }

 protected:
  void OnNode(const Formula::Node& node, bool positive, const Formula::Node*) override {
    if (IsEventuality(node.op) && positive) CollectNexts(node.operands.back());
    if (node.op == Operator::kNext && positive && IsEventuality(formula_.node(node.operands.front()).op))
      Add(node);
  }

 private:
  /// The X directly below an eventuality, through & and | only.
  void CollectNexts(int i) {
    const Formula::Node& node = formula_.node(i);
    if (node.op == Operator::kNext) Add(node);
    if (node.op == Operator::kAnd || node.op == Operator::kOr) {
      for (int operand : node.operands) CollectNexts(operand);
    }
  }

  void Add(const Formula::Node& node) {
    if (std::find(found_.begin(), found_.end(), &node) == found_.end()) found_.push_back(&node);
  }

  const Formula& formula_;
  std::vector<const Formula::Node*> found_;
};

}  // namespace

std::vector<CosafeViolation> WhyNotCosafe(const Formula& formula) { return CosafeWalk(formula).Violations(); }

void RequireSemantics(const Formula& formula, Semantics semantics, const Location& where) {
  if (semantics != Semantics::kCosafe) return;
  Diagnostics diagnostics;
  for (const CosafeViolation& violation : WhyNotCosafe(formula)) {
    diagnostics.Add(
        FormulaLocation(where, violation.column),
        FormulaPrefix(where, violation.column) + "the formula is not co-safe: " + violation.message,
        "accepted: & | X F U M, and negation of what has no F, U or M; or the semantics 'ltlf', "
        "which judges the whole finite word");
  }
  diagnostics.ThrowIfAny();
}

std::vector<Diagnostic> SemanticsWarnings(const Formula& formula, Semantics semantics,
                                          const Location& where) {
  std::vector<Diagnostic> warnings;
  if (semantics != Semantics::kLtlf) return warnings;
  for (const Formula::Node* node : WeakNextWalk(formula).Suspects()) {
    warnings.push_back({FormulaLocation(where, node->column),
                        FormulaPrefix(where, node->column) +
                            "X is weak: at the last position of the word it holds whatever should follow",
                        "X[!] requires a next position"});
  }
  return warnings;
}

Semantics ReadSemantics(const std::string& name) {
  for (Semantics semantics : {Semantics::kCosafe, Semantics::kLtlf}) {
    if (name == ToString(semantics)) return semantics;
  }
  throw InputError("--semantics: unknown '" + name + "'", SuggestFrom(name, {"cosafe", "ltlf"}));
}

}  // namespace tether::ltl
