#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "tether/common/error.h"
#include "tether/symbolic/formula.h"

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

struct Action {
  std::string name;
  std::vector<TypedName> parameters;
  Formula precondition;
  Effect effect;
  Location where;
};

struct Domain {
  std::string name;
  std::string file;
  std::vector<std::string> requirements;
  std::vector<Type> types;
  std::vector<TypedName> constants;
  std::vector<Predicate> predicates;
  std::vector<Action> actions;

  /// Index by name, -1 if there is none.
  int FindType(std::string_view name) const;
  int FindPredicate(std::string_view name) const;
  int FindAction(std::string_view name) const;

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

struct Problem {
  std::shared_ptr<const Domain> domain;
  std::string name;
  std::string file;
  std::vector<TypedName>
      objects;             ///< The domain's constants, then the problem's objects, each in file order.
  std::vector<Fact> init;  ///< In file order; the rest is false.
  Formula goal;

  /// Index by name, -1 if there is none.
  int FindObject(std::string_view name) const;
};

/// Parses a domain. `file` names the text in errors. Throws InputError with every mistake found.
std::shared_ptr<const Domain> ParseDomain(std::string_view text, const std::string& file);

/// Parses a problem for `domain`. Throws InputError with every mistake found.
std::shared_ptr<const Problem> ParseProblem(std::string_view text, const std::string& file,
                                            std::shared_ptr<const Domain> domain);

/// Reads both files; the mistakes of both are thrown together, as far as the domain can be understood.
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
