#include "tether/symbolic/pddl/pddl_sections.h"

#include <algorithm>
#include <utility>

#include "tether/symbolic/pddl/formula_parser.h"

namespace tether::symbolic {
namespace {

std::string Quote(std::string_view text) { return "'" + std::string(text) + "'"; }

/// Calls `visit` with each predicate of `formula` and whether it stands under a negation.
template <typename Visit>
void VisitPredicates(const Formula& formula, bool negated, const Visit& visit) {
  using Kind = Formula::Kind;
  if (formula.kind == Kind::kAtom) visit(formula.predicate, negated);
  for (size_t i = 0; i < formula.children.size(); ++i) {
    const bool turns = formula.kind == Kind::kNot || (formula.kind == Kind::kImply && i == 0);
    VisitPredicates(formula.children[i], negated != turns, visit);
  }
}

}  // namespace

void ParseFunctions(const Expression& section, Domain& domain, Diagnostics& diagnostics) {
  for (size_t i = 1; i < section.items.size(); ++i) {
    const Expression& item = section.items[i];
    if (!item.is_list && item.word == "-") {
      const bool ends = i + 1 >= section.items.size();
      const Expression& type = ends ? item : section.items[++i];
      if (type.is_list || LowerCase(type.word) != "number") {
        diagnostics.Add(type.where, "a function's values are numbers, not " + Quote(type.word),
                        "accepted: - number; functions with objects as values are not supported");
      }
      continue;
    }
    if (item.head().empty() || !IsName(item.head())) {
      diagnostics.Add(item.where, (item.is_list ? "a list" : Quote(item.word)) + " is not a function",
                      "accepted: (name ?a - type …) - number");
      continue;
    }
    domain.functions.push_back({item.items[0].word,
                                ParseTypedList(item.items, 1, NameKind::kDeclared, domain, diagnostics),
                                item.items[0].where});
    if (LowerCase(item.head()) == "total-cost" && item.items.size() > 1) {
      diagnostics.Add(item.where, "'total-cost' has no parameters", "accepted: (total-cost) - number");
    }
  }
}

void ParseValue(const Expression& item, Problem& problem, const Domain& domain, Diagnostics& diagnostics) {
  if (item.items.size() != 3 || item.items[1].head().empty()) {
    diagnostics.Add(item.where, "'(= …)' in ':init' must give a function's value",
                    "accepted: (= (function object …) number)");
    return;
  }
  const Expression& function = item.items[1];
  const int64_t millionths =
      ParseNumber(item.items[2], "the value of " + Quote(function.head()), diagnostics);
  if (IsTotalCost(function)) return;  // Where costs begin makes no difference.
  const int index = domain.FindFunction(function.head());
  if (index < 0) {
    diagnostics.Add(function.where, "unknown function " + Quote(function.head()),
                    Suggest(function.head(), NamesOf(domain.functions)));
    return;
  }
  const Function& known = domain.functions[index];
  std::vector<Term> terms;
  FormulaParser parser(domain, problem.objects, {}, diagnostics);
  if (!parser.ParseArguments(function, {known.name, known.parameters, known.where}, terms)) return;
  FunctionValue value{index, {}, millionths, item.where};
  for (const Term& term : terms) value.arguments.push_back(term.index);
  for (const FunctionValue& other : problem.values) {
    if (other.function == value.function && other.arguments == value.arguments) {
      diagnostics.Add(item.where, "this value is given twice; first at " + other.where.ToString());
      return;
    }
  }
  problem.values.push_back(std::move(value));
}

void ParseMetric(const Expression& section, Problem& problem, const Domain& domain,
                 Diagnostics& diagnostics) {
  const char* const form = "accepted: (:metric minimize (total-cost))";
  const bool minimize = section.items.size() == 3 && LowerCase(section.items[1].word) == "minimize";
  const std::string what = minimize ? LowerCase(section.items[2].head()) : "";
  if (minimize && IsTotalCost(section.items[2])) {
    if (domain.FindFunction("total-cost") < 0) {
      diagnostics.Warn(section.items[2].where, "the domain's ':functions' does not declare 'total-cost'",
                       "(:functions (total-cost) - number)");
    }
    problem.minimize_cost = true;
  } else if (minimize && (what == "total-time" || LowerCase(section.items[2].word) == "total-time")) {
    diagnostics.Warn(section.where, "actions have no durations here: their number is minimised", form);
  } else {
    diagnostics.Add(section.where, "only the total cost of actions can be minimised", form);
  }
}

void ParseDerived(const Expression& section, Domain& domain, Diagnostics& diagnostics) {
  const char* const form = "accepted: (:derived (predicate ?a - type …) formula)";
  if (section.items.size() != 3 || section.items[1].head().empty()) {
    diagnostics.Add(section.where, "':derived' needs a predicate and a formula", form);
    return;
  }
  const Expression& head = section.items[1];
  const int index = domain.FindPredicate(head.head());
  if (index < 0 && LowerCase(head.head()) == "not") {
    diagnostics.Add(
        head.where,
        "a rule can't say where a predicate does not hold: a derived predicate holds where one of its "
        "rules says so, and nowhere else",
        form);
    return;
  }
  if (index < 0) {
    diagnostics.Add(head.items[0].where, "unknown predicate " + Quote(head.head()),
                    Suggest(head.head(), NamesOf(domain.predicates)));
    return;
  }
  const Predicate& predicate = domain.predicates[index];
  DerivedRule rule;
  rule.predicate = index;
  rule.where = head.where;
  rule.parameters = ParseTypedList(head.items, 1, NameKind::kVariable, domain, diagnostics);
  if (rule.parameters.size() != predicate.parameters.size()) {
    diagnostics.Add(head.where,
                    Quote(predicate.name) + " has " + std::to_string(rule.parameters.size()) +
                        " parameters here, not " + std::to_string(predicate.parameters.size()),
                    "as in ':predicates', " + predicate.where.ToString());
    return;
  }
  for (size_t i = 0; i < rule.parameters.size(); ++i) {
    // Often the types are left out here.
    if (rule.parameters[i].types == std::vector<int>{0})
      rule.parameters[i].types = predicate.parameters[i].types;
  }
  domain.strata[index] = 1;
  rule.body =
      FormulaParser(domain, domain.constants, rule.parameters, diagnostics).ParseFormula(section.items[2]);
  domain.derived.push_back(std::move(rule));
}

void Stratify(Domain& domain, Diagnostics& diagnostics) {
  const int most = static_cast<int>(domain.predicates.size());
  for (bool changed = true; changed;) {
    changed = false;
    for (const DerivedRule& rule : domain.derived) {
      int& stratum = domain.strata[rule.predicate];
      VisitPredicates(rule.body, false, [&](int predicate, bool negated) {
        const int below = domain.strata[predicate];
        if (below == 0 || below + (negated ? 1 : 0) <= stratum) return;
        stratum = below + (negated ? 1 : 0);
        changed = true;
      });
      if (stratum > most) {
        diagnostics.Add(rule.where,
                        "derived predicate " + Quote(domain.predicates[rule.predicate].name) +
                            " depends on its own negation",
                        "derived predicates must be stratified");
        return;
      }
    }
  }
}

}  // namespace tether::symbolic
