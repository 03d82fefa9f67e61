#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "tether/common/error.h"
#include "tether/symbolic/pddl/formula.h"

namespace tether::symbolic {

/// A type. Here and below, names keep the spelling of their declaration and are found without regard to case.
struct Type {
  std::string name;
  int parent = -1;  ///< Index of the type above; -1 for `object`, which is type 0.
  Location where;
};

struct Predicate {
  std::string name;
  std::vector<TypedName> parameters;
  Location where;
};

/// A function with values from ':init', for costs. `total-cost` has none.
struct Function {
  std::string name;
  std::vector<TypedName> parameters;
  Location where;
};

/// Costs are decimal numbers with up to six digits after the point: they are held in millionths.
constexpr int64_t kMillion = 1'000'000;

/// A summand of an action's cost: a function of its parameters, or a number.
struct CostTerm {
  int function = -1;        ///< Index into Domain::functions; -1: a number.
  std::vector<Term> terms;  ///< Arguments of the function.
  int64_t millionths = 0;   ///< The number.
  Location where;
};

struct Action {
  std::string name;
  std::vector<TypedName> parameters;
  Formula precondition;
  Effect effect;
  std::vector<CostTerm> cost;  ///< What `(increase (total-cost) …)` adds, in sum.
  Location where;
};

/// A rule of a derived predicate: it holds of the parameters whenever `body` does.
struct DerivedRule {
  int predicate = -1;
  std::vector<TypedName> parameters;
  Formula body;
  Location where;
};

struct Domain {
  std::string name;
  std::string file;
  std::vector<std::string> requirements;
  std::vector<Type> types;
  std::vector<TypedName> constants;
  std::vector<Predicate> predicates;
  std::vector<Function> functions;
  std::vector<Action> actions;
  std::vector<DerivedRule> derived;
  /// Per predicate: 0 if actions may change it, else its stratum. A derived predicate's bodies refer to its
  /// own stratum without negation, and otherwise to lower ones.
  std::vector<int> strata;
  std::vector<Diagnostic> warnings;  ///< About what is odd but still has one meaning.

  /// Index by name, -1 if there is none.
  int FindType(std::string_view name) const;
  int FindPredicate(std::string_view name) const;
  int FindFunction(std::string_view name) const;
  int FindAction(std::string_view name) const;
  bool IsDerived(int predicate) const { return strata[static_cast<size_t>(predicate)] > 0; }

  /// Whether `type` is `ancestor` or below it.
  bool IsSubtype(int type, int ancestor) const;
  /// Whether everything of a type in `types` is of a type in `accepted`.
  bool Fits(const std::vector<int>& types, const std::vector<int>& accepted) const;
  /// "movable", or "either movable physobj".
  std::string TypeText(const std::vector<int>& types) const;
};

/// A fact of the initial state: a predicate and its arguments, as indices.
struct Fact {
  int predicate = -1;
  std::vector<int> arguments;  ///< Indices into Problem::objects.
  Location where;
};

/// The value of a function in the initial state; values never change.
struct FunctionValue {
  int function = -1;
  std::vector<int> arguments;  ///< Indices into Problem::objects.
  int64_t millionths = 0;
  Location where;
};

struct Problem {
  std::shared_ptr<const Domain> domain;
  std::string name;
  std::string file;
  std::vector<TypedName>
      objects;             ///< The domain's constants, then the problem's objects, each in file order.
  std::vector<Fact> init;  ///< In file order; the rest is false.
  std::vector<FunctionValue> values;  ///< In file order.
  bool minimize_cost = false;  ///< `(:metric minimize (total-cost))`; without it, every action costs 1.
  Formula goal;
  std::vector<Diagnostic> warnings;  ///< As in Domain.

  /// Index by name, -1 if there is none.
  int FindObject(std::string_view name) const;
};

/// Parses a domain. `file` names the text in errors. Throws InputError with every mistake found.
std::shared_ptr<const Domain> ParseDomain(std::string_view text, const std::string& file);

/// Parses a problem for `domain`. Throws InputError with every mistake found.
std::shared_ptr<const Problem> ParseProblem(std::string_view text, const std::string& file,
                                            std::shared_ptr<const Domain> domain);

/// Reads both files; the mistakes of both are thrown together, as far as the domain can be understood. Logs
/// warnings.
std::shared_ptr<const Problem> ReadProblem(const std::string& domain_file, const std::string& problem_file);

/// The same problem with another goal, given as a PDDL formula. Lines and columns in errors count from
/// `where`, the place of the text's first character; leave its line 0 when the text stands alone. Throws
/// InputError.
std::shared_ptr<const Problem> WithGoal(const Problem& problem, std::string_view goal, const Location& where);

/// PDDL text that parses to the same domain, problem or formula (constants go with the domain).
std::string WriteDomain(const Domain& domain);
std::string WriteProblem(const Problem& problem);
/// `formula` must have no free variables beyond `scope`, the parameters around it.
std::string WriteFormula(const Formula& formula, const Domain& domain, const std::vector<TypedName>& objects,
                         const std::vector<TypedName>& scope = {});

}  // namespace tether::symbolic
