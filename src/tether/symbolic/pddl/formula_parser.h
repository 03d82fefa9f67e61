#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "tether/symbolic/pddl/expression.h"
#include "tether/symbolic/pddl/pddl.h"

namespace tether::symbolic {

/// Whether `word` may name a thing: letters, digits, '_', '-', '.', '@' and the like; not '-', '.' or an
/// operator first.
bool IsName(std::string_view word);

/// "did you mean 'x'? accepted: x, y or z": the hint for an unknown `word`.
std::string Suggest(std::string_view word, const std::vector<std::string>& known);

template <typename Named>
std::vector<std::string> NamesOf(const std::vector<Named>& list) {
  std::vector<std::string> names;
  for (const Named& item : list) names.push_back(item.name);
  return names;
}

/// Index of the item called `name` without regard to case, -1 if there is none.
template <typename Named>
int FindNamed(const std::vector<Named>& list, std::string_view name) {
  const std::string lower = LowerCase(name);
  for (size_t i = 0; i < list.size(); ++i) {
    if (LowerCase(list[i].name) == lower) return static_cast<int>(i);
  }
  return -1;
}

/// The kind of names in a typed list, for checks and messages.
enum class NameKind {
  kVariable,
  kDeclared,  ///< Parameters of a predicate or function: variables whose names mean nothing.
  kObject,
};

/// Reads `a b - t c - (either u v) d` from `items` starting at `first`. Names without a type get `object`.
/// Reports unknown types and bad names. A name of an unknown type has no type, so that no further errors
/// follow.
std::vector<TypedName> ParseTypedList(const std::vector<Expression>& items, size_t first, NameKind kind,
                                      const Domain& domain, Diagnostics& diagnostics);

/// Reads formulas and effects over the predicates of a domain and given objects. Mistakes are reported, and
/// reading goes on.
class FormulaParser {
 public:
  /// All must outlive the parser. `scope` holds the variables around the formula.
  FormulaParser(const Domain& domain, const std::vector<TypedName>& objects, std::vector<TypedName> scope,
                Diagnostics& diagnostics)
      : domain_(domain), objects_(objects), scope_(std::move(scope)), diagnostics_(diagnostics) {}

  /// From now on `(increase (total-cost) …)` is an effect, and adds to `cost`.
  void CollectCost(std::vector<CostTerm>* cost) { cost_ = cost; }

  Formula ParseFormula(const Expression& expression);
  Effect ParseEffect(const Expression& expression);
  /// Checks the arguments of a predicate or function, `signature`, and reads them into `terms`.
  bool ParseArguments(const Expression& expression, const Predicate& signature, std::vector<Term>& terms);

 private:
  Formula ParseAtom(const Expression& expression);
  void ParseIncrease(const Expression& expression);
  void ParseCost(const Expression& expression);
  std::vector<TypedName> ParseVariables(const Expression& expression);
  bool ParseTerm(const Expression& expression, Term& term);
  const std::vector<int>& TypesOf(const Term& term) const;
  void Push(const std::vector<TypedName>& variables) {
    scope_.insert(scope_.end(), variables.begin(), variables.end());
  }
  void Pop(size_t count) { scope_.resize(scope_.size() - count); }
  bool HasItems(const Expression& expression, size_t count, const char* usage);

  const Domain& domain_;
  const std::vector<TypedName>& objects_;
  std::vector<TypedName> scope_;
  Diagnostics& diagnostics_;
  std::vector<CostTerm>* cost_ = nullptr;
  int nested_ = 0;  // Effects around the place that depend on the state or on objects.
};

/// Reads a number that is not negative and has up to six digits after the point, in millionths; reports other
/// text, called `what` in the message, and returns 0.
int64_t ParseNumber(const Expression& expression, const std::string& what, Diagnostics& diagnostics);

/// Whether `expression` is `(total-cost)`.
bool IsTotalCost(const Expression& expression);

}  // namespace tether::symbolic
