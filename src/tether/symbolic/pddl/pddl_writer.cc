#include "tether/symbolic/pddl/pddl.h"

namespace tether::symbolic {
namespace {

/// Writes formulas and effects with their variables under the names they were given.
class Writer {
 public:
  Writer(const Domain& domain, const std::vector<TypedName>& objects, std::vector<TypedName> scope)
      : domain_(domain), objects_(objects), scope_(std::move(scope)) {}

  std::string Write(const Formula& formula) {
    using Kind = Formula::Kind;
    switch (formula.kind) {
      case Kind::kAtom:
        return Atom(formula.predicate, formula.terms);
      case Kind::kEquals:
        return "(= " + Name(formula.terms[0]) + " " + Name(formula.terms[1]) + ")";
      case Kind::kNot:
        return List("not", formula.children);
      case Kind::kAnd:
        return List("and", formula.children);
      case Kind::kOr:
        return List("or", formula.children);
      case Kind::kImply:
        return List("imply", formula.children);
      case Kind::kForall:
        return Quantified("forall", formula);
      case Kind::kExists:
        return Quantified("exists", formula);
    }
    return "";
  }

  std::string Write(const CostTerm& term) const {
    if (term.function < 0) return Number(term.millionths);
    std::string text = "(" + domain_.functions[term.function].name;
    for (const Term& argument : term.terms) text += " " + Name(argument);
    return text + ")";
  }

  static std::string Number(int64_t millionths) {
    std::string text = std::to_string(millionths / kMillion);
    std::string fraction = std::to_string(kMillion + millionths % kMillion).substr(1);
    while (!fraction.empty() && fraction.back() == '0') fraction.pop_back();
    return fraction.empty() ? text : text + "." + fraction;
  }

  std::string Write(const Effect& effect) {
    using Kind = Effect::Kind;
    switch (effect.kind) {
      case Kind::kAdd:
        return Atom(effect.predicate, effect.terms);
      case Kind::kDelete:
        return "(not " + Atom(effect.predicate, effect.terms) + ")";
      case Kind::kAnd:
        return List("and", effect.children);
      case Kind::kForall:
        return Quantified("forall", effect);
      case Kind::kWhen:
        return "(when " + Write(effect.condition) + " " + Write(effect.children[0]) + ")";
    }
    return "";
  }

 private:
  std::string Name(const Term& term) const {
    const auto index = static_cast<size_t>(term.index);
    return term.is_variable ? "?" + scope_[index].name : objects_[index].name;
  }

  std::string Atom(int predicate, const std::vector<Term>& terms) const {
    std::string text = "(" + domain_.predicates[predicate].name;
    for (const Term& term : terms) text += " " + Name(term);
    return text + ")";
  }

  template <typename Node>
  std::string List(const char* head, const std::vector<Node>& children) {
    std::string text = std::string("(") + head;
    for (const Node& child : children) text += " " + Write(child);
    return text + ")";
  }

  template <typename Node>
  std::string Quantified(const char* head, const Node& node) {
    std::string text = std::string("(") + head + " (";
    for (size_t i = 0; i < node.variables.size(); ++i) {
      text +=
          (i > 0 ? " ?" : "?") + node.variables[i].name + " - " + domain_.TypeText(node.variables[i].types);
    }
    scope_.insert(scope_.end(), node.variables.begin(), node.variables.end());
    text += ") " + Write(node.children[0]) + ")";
    scope_.resize(scope_.size() - node.variables.size());
    return text;
  }

  const Domain& domain_;
  const std::vector<TypedName>& objects_;
  std::vector<TypedName> scope_;
};

std::string TypedList(const std::vector<TypedName>& list, size_t first, const char* prefix,
                      const Domain& domain) {
  std::string text;
  for (size_t i = first; i < list.size(); ++i) {
    text += " " + (prefix + list[i].name) + " - " + domain.TypeText(list[i].types);
  }
  return text;
}

}  // namespace

std::string WriteFormula(const Formula& formula, const Domain& domain, const std::vector<TypedName>& objects,
                         const std::vector<TypedName>& scope) {
  return Writer(domain, objects, scope).Write(formula);
}

std::string WriteDomain(const Domain& domain) {
  std::string text = "(define (domain " + domain.name + ")\n";
  if (!domain.requirements.empty()) {
    text += "  (:requirements";
    for (const std::string& requirement : domain.requirements) text += " " + requirement;
    text += ")\n";
  }
  if (domain.types.size() > 1) {
    text += "  (:types";
    for (size_t i = 1; i < domain.types.size(); ++i) {
      text += " " + domain.types[i].name + " - " + domain.types[domain.types[i].parent].name;
    }
    text += ")\n";
  }
  text += "  (:constants" + TypedList(domain.constants, 0, "", domain) + ")\n  (:predicates";
  for (const Predicate& predicate : domain.predicates) {
    text += "\n    (" + predicate.name + TypedList(predicate.parameters, 0, "?", domain) + ")";
  }
  text += ")";
  if (!domain.functions.empty()) {
    text += "\n  (:functions";
    for (const Function& function : domain.functions) {
      text += "\n    (" + function.name + TypedList(function.parameters, 0, "?", domain) + ") - number";
    }
    text += ")";
  }
  for (const DerivedRule& rule : domain.derived) {
    text += "\n  (:derived (" + domain.predicates[rule.predicate].name +
            TypedList(rule.parameters, 0, "?", domain) + ")\n    " +
            Writer(domain, domain.constants, rule.parameters).Write(rule.body) + ")";
  }
  for (const Action& action : domain.actions) {
    Writer writer(domain, domain.constants, action.parameters);
    text += "\n  (:action " + action.name + "\n    :parameters (" +
            TypedList(action.parameters, 0, "?", domain) + ")";
    text += "\n    :precondition " + writer.Write(action.precondition);
    std::string effect = writer.Write(action.effect);
    if (!action.cost.empty()) {
      if (action.effect.kind == Effect::Kind::kAnd) {
        effect.pop_back();
      } else {
        effect = "(and " + effect;
      }
      for (const CostTerm& term : action.cost) {
        effect += " (increase (total-cost) " + writer.Write(term) + ")";
      }
      effect += ")";
    }
    text += "\n    :effect " + effect + ")";
  }
  return text + ")\n";
}

std::string WriteProblem(const Problem& problem) {
  const Domain& domain = *problem.domain;
  std::string text = "(define (problem " + problem.name + ")\n  (:domain " + domain.name + ")\n  (:objects";
  text += TypedList(problem.objects, domain.constants.size(), "", domain) + ")\n  (:init";
  for (const Fact& fact : problem.init) {
    text += "\n    (" + domain.predicates[fact.predicate].name;
    for (int argument : fact.arguments) text += " " + problem.objects[argument].name;
    text += ")";
  }
  for (const FunctionValue& value : problem.values) {
    text += "\n    (= (" + domain.functions[value.function].name;
    for (int argument : value.arguments) text += " " + problem.objects[argument].name;
    text += ") " + Writer::Number(value.millionths) + ")";
  }
  text += ")\n  (:goal " + Writer(domain, problem.objects, {}).Write(problem.goal) + ")";
  if (problem.minimize_cost) text += "\n  (:metric minimize (total-cost))";
  return text + ")\n";
}

}  // namespace tether::symbolic
