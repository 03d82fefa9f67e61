#pragma once

#include <set>
#include <string>
#include <vector>

#include "tether/common/random.h"
#include "tether/symbolic/grounding/task.h"

/// For tests: an oracle of PDDL's semantics, and random problems to compare with it.
namespace tether::symbolic::naive {

using Facts = std::set<Atom>;

/// Every choice of objects for the variables, added to `binding`.
inline std::vector<std::vector<int>> Bindings(const Problem& problem, const std::vector<TypedName>& variables,
                                              const std::vector<int>& binding) {
  std::vector<std::vector<int>> all = {binding};
  for (const TypedName& variable : variables) {
    std::vector<std::vector<int>> longer;
    for (const std::vector<int>& start : all) {
      for (size_t object = 0; object < problem.objects.size(); ++object) {
        if (!problem.domain->Fits(problem.objects[object].types, variable.types)) continue;
        longer.push_back(start);
        longer.back().push_back(static_cast<int>(object));
      }
    }
    all = longer;
  }
  return all;
}

inline Atom Bind(int predicate, const std::vector<Term>& terms, const std::vector<int>& binding) {
  Atom atom{predicate, {}};
  for (const Term& t : terms) atom.arguments.push_back(t.is_variable ? binding.at(t.index) : t.index);
  return atom;
}

inline bool Holds(const Problem& problem, const Formula& f, const Facts& facts,
                  const std::vector<int>& binding) {
  using Kind = Formula::Kind;
  auto child = [&](size_t i) { return Holds(problem, f.children[i], facts, binding); };
  switch (f.kind) {
    case Kind::kAtom:
      return facts.count(Bind(f.predicate, f.terms, binding)) > 0;
    case Kind::kEquals: {
      const Atom pair = Bind(0, f.terms, binding);
      return pair.arguments[0] == pair.arguments[1];
    }
    case Kind::kNot:
      return !child(0);
    case Kind::kImply:
      return !child(0) || child(1);
    case Kind::kAnd:
      for (size_t i = 0; i < f.children.size(); ++i) {
        if (!child(i)) return false;
      }
      return true;
    case Kind::kOr:
      for (size_t i = 0; i < f.children.size(); ++i) {
        if (child(i)) return true;
      }
      return false;
    case Kind::kForall:
      for (const auto& inner : Bindings(problem, f.variables, binding)) {
        if (!Holds(problem, f.children[0], facts, inner)) return false;
      }
      return true;
    case Kind::kExists:
      for (const auto& inner : Bindings(problem, f.variables, binding)) {
        if (Holds(problem, f.children[0], facts, inner)) return true;
      }
      return false;
  }
  return false;
}

/// Derived predicates, stratum by stratum, until nothing more follows.
inline void Derive(const Problem& problem, Facts& facts) {
  const Domain& domain = *problem.domain;
  std::erase_if(facts, [&](const Atom& atom) { return domain.IsDerived(atom.predicate); });
  for (int stratum = 1; stratum <= static_cast<int>(domain.predicates.size()); ++stratum) {
    for (bool changed = true; changed;) {
      changed = false;
      for (const DerivedRule& rule : domain.derived) {
        if (domain.strata[rule.predicate] != stratum) continue;
        for (const auto& binding : Bindings(problem, rule.parameters, {})) {
          if (!Holds(problem, rule.body, facts, binding)) continue;
          changed = facts.insert({rule.predicate, binding}).second || changed;
        }
      }
    }
  }
}

inline Facts Initial(const Problem& problem) {
  Facts facts;
  for (const Fact& fact : problem.init) facts.insert({fact.predicate, fact.arguments});
  Derive(problem, facts);
  return facts;
}

inline void Collect(const Problem& problem, const Effect& e, const Facts& before,
                    const std::vector<int>& binding, Facts& adds, Facts& deletes) {
  switch (e.kind) {
    case Effect::Kind::kAdd:
      adds.insert(Bind(e.predicate, e.terms, binding));
      break;
    case Effect::Kind::kDelete:
      deletes.insert(Bind(e.predicate, e.terms, binding));
      break;
    case Effect::Kind::kAnd:
      for (const Effect& child : e.children) Collect(problem, child, before, binding, adds, deletes);
      break;
    case Effect::Kind::kForall:
      for (const auto& inner : Bindings(problem, e.variables, binding)) {
        Collect(problem, e.children[0], before, inner, adds, deletes);
      }
      break;
    case Effect::Kind::kWhen:
      if (Holds(problem, e.condition, before, binding)) {
        Collect(problem, e.children[0], before, binding, adds, deletes);
      }
      break;
  }
}

struct Step {
  std::string name;
  Facts after;
  const Action* action = nullptr;
  std::vector<int> arguments;
};

/// In millionths, as the problem's metric counts it; an action costs one whole unless costs are minimised.
inline int64_t CostOf(const Problem& problem, const Step& step) {
  if (!problem.minimize_cost) return kMillion;
  int64_t cost = 0;
  for (const CostTerm& term : step.action->cost) {
    if (term.function < 0) cost += term.millionths;
    for (const FunctionValue& value : problem.values) {
      if (value.function == term.function &&
          value.arguments == Bind(term.function, term.terms, step.arguments).arguments)
        cost += value.millionths;
    }
  }
  return cost;
}

/// Every applicable action, in the order of declaration, with its result.
inline std::vector<Step> Steps(const Problem& problem, const Facts& facts) {
  std::vector<Step> steps;
  for (const Action& action : problem.domain->actions) {
    for (const auto& binding : Bindings(problem, action.parameters, {})) {
      if (!Holds(problem, action.precondition, facts, binding)) continue;
      Step step{action.name + "(", facts, &action, binding};
      for (size_t i = 0; i < binding.size(); ++i) {
        step.name += (i > 0 ? "," : "") + problem.objects[binding[i]].name;
      }
      step.name += ")";
      Facts adds, deletes;
      Collect(problem, action.effect, facts, binding, adds, deletes);
      for (const Atom& atom : deletes) step.after.erase(atom);
      step.after.insert(adds.begin(), adds.end());
      Derive(problem, step.after);
      steps.push_back(step);
    }
  }
  return steps;
}

/// Writes random problems of a random domain: nested formulas, conditional and universal effects, a type
/// hierarchy; if asked for, costs (some of them 0), and derived predicates, of which one follows from itself
/// and the other from the negation of that.
class RandomProblem {
 public:
  struct Extras {
    bool costs = false;
    bool derived = false;
  };

  explicit RandomProblem(uint64_t seed) : RandomProblem(seed, Extras{}) {}
  RandomProblem(uint64_t seed, const Extras& extras) : random_(seed), extras_(extras) {
    const int count = 2 + random_.Index(3);
    for (int i = 0; i < count; ++i) objects_.push_back({"Obj" + std::to_string(i), random_.Index(3)});
    domain_ =
        "(define (domain d) (:requirements :adl :typing)\n(:types left right - top top - "
        "object)\n(:constants";
    domain_ += " Obj0 - " + TypeName(objects_[0].second) + ")\n";
    domain_ += "(:predicates (zero) (one ?x - object) (two ?x - top ?y - object) (still ?x - object)";
    domain_ += " (fixed ?x - object ?y - left)";
    if (extras.derived) domain_ += " (follows ?x - object) (nothing ?x - top)";
    domain_ += ")\n";
    if (extras.costs) domain_ += "(:functions (total-cost) (price ?x - object) - number)\n";
    if (extras.derived) {
      visible_ = {objects_[0]};
      extras_.derived = false;  // The bodies are over the others.
      domain_ += "(:derived (follows ?x) (or " + FormulaText({{"?x", 3}}, 2) +
                 " (exists (?y - top) (and (two ?y ?x) (follows ?y)))))\n";
      extras_.derived = true;
      domain_ += "(:derived (nothing ?x) (and (not (follows ?x)) (imply (zero) (follows Obj0))))\n";
    }
    const int actions = 2 + random_.Index(3);
    for (int i = 0; i < actions; ++i) {
      std::vector<std::pair<std::string, int>> scope;
      std::string parameters;
      const int arity = random_.Index(3);
      for (int k = 0; k < arity; ++k) {
        scope.push_back({"?v" + std::to_string(k), random_.Index(4)});
        parameters += " " + scope.back().first + " - " + TypeName(scope.back().second);
      }
      visible_ = {objects_[0]};
      domain_ += "(:action act" + std::to_string(i) + " :parameters (" + parameters + ")\n  :precondition ";
      domain_ += FormulaText(scope, 3) + "\n  :effect ";
      if (extras.costs) {
        const std::string price = arity > 0 ? "(price ?v0)" : std::to_string(random_.Index(4));
        domain_ += "(and (increase (total-cost) " + price + ") " + EffectText(scope, 3) + "))\n";
      } else {
        domain_ += EffectText(scope, 3) + ")\n";
      }
    }
    domain_ += ")\n";
    visible_ = objects_;
    problem_ = "(define (problem p) (:domain D) (:objects";
    for (size_t i = 1; i < objects_.size(); ++i)
      problem_ += " " + objects_[i].first + " - " + TypeName(objects_[i].second);
    problem_ += ")\n(:init";
    const int facts = random_.Index(8);
    in_init_ = true;
    for (int i = 0; i < facts; ++i) problem_ += " " + AtomText({}, false);
    in_init_ = false;
    for (const auto& [name, type] : extras.costs ? objects_ : Scope{}) {
      problem_ += " (= (price " + name + ") " + std::to_string(random_.Index(4)) + ".5)";
    }
    problem_ += ")\n(:goal " + FormulaText({}, 2) + ")";
    problem_ += extras.costs ? "(:metric minimize (total-cost)))\n" : ")\n";
  }

  const std::string& domain() const { return domain_; }
  const std::string& problem() const { return problem_; }

 private:
  using Scope = std::vector<std::pair<std::string, int>>;

  /// 0 left, 1 right, 2 top, 3 object.
  static std::string TypeName(int type) {
    static const char* const kNames[] = {"left", "right", "top", "object"};
    return kNames[type];
  }
  static bool Below(int type, int above) { return type == above || above == 3 || (above == 2 && type < 2); }

  std::string TermText(const Scope& scope, int type) {
    std::vector<std::string> fit;
    for (const Scope& names : {scope, visible_}) {
      for (const auto& [name, own] : names) {
        if (Below(own, type)) fit.push_back(name);
      }
    }
    return fit.empty() ? "" : fit[random_.Index(static_cast<int>(fit.size()))];
  }

  std::string AtomText(const Scope& scope, bool changing) {
    const int which = random_.Index(changing ? 3 : extras_.derived && !in_init_ ? 7 : 5);
    const std::string any = TermText(scope, 3), top = TermText(scope, 2), left = TermText(scope, 0);
    if (which == 1 && !any.empty()) return "(one " + any + ")";
    if (which == 2 && !any.empty() && !top.empty()) return "(TWO " + top + " " + any + ")";
    if (which == 3 && !any.empty()) return "(still " + any + ")";
    if (which == 5 && !any.empty()) return "(follows " + any + ")";
    if (which == 6 && !top.empty()) return "(nothing " + top + ")";
    if (which == 4 && !any.empty() && !left.empty()) return "(fixed " + any + " " + left + ")";
    return "(zero)";
  }

  std::string QuantifiedText(const Scope& scope, Scope& inner) {
    inner = scope;
    inner.push_back({"?q" + std::to_string(scope.size()), random_.Index(4)});
    return "(" + inner.back().first + " - " + TypeName(inner.back().second) + ") ";
  }

  std::string FormulaText(const Scope& scope, int depth) {
    Scope inner;
    switch (depth == 0 ? 9 : random_.Index(10)) {
      case 0:
        return "(and " + FormulaText(scope, depth - 1) + " " + FormulaText(scope, depth - 1) + ")";
      case 1:
        return "(or " + FormulaText(scope, depth - 1) + " " + FormulaText(scope, depth - 1) + ")";
      case 2:
        return "(not " + FormulaText(scope, depth - 1) + ")";
      case 3:
        return "(imply " + FormulaText(scope, depth - 1) + " " + FormulaText(scope, depth - 1) + ")";
      case 4: {
        const std::string variables = QuantifiedText(scope, inner);
        return "(forall " + variables + FormulaText(inner, depth - 1) + ")";
      }
      case 5: {
        const std::string variables = QuantifiedText(scope, inner);
        return "(exists " + variables + FormulaText(inner, depth - 1) + ")";
      }
      case 6: {
        const std::string a = TermText(scope, 3), b = TermText(scope, 3);
        return a.empty() ? "(and)" : "(= " + a + " " + b + ")";
      }
      default:
        return AtomText(scope, false);
    }
  }

  std::string EffectText(const Scope& scope, int depth) {
    Scope inner;
    switch (depth == 0 ? 5 + random_.Index(2) : random_.Index(7)) {
      case 0:
      case 1:
        return "(and " + EffectText(scope, depth - 1) + " " + EffectText(scope, depth - 1) + ")";
      case 2: {
        const std::string variables = QuantifiedText(scope, inner);
        return "(forall " + variables + EffectText(inner, depth - 1) + ")";
      }
      case 3:
        return "(when " + FormulaText(scope, 2) + " " + EffectText(scope, depth - 1) + ")";
      case 4:
      case 5:
        return "(not " + AtomText(scope, true) + ")";
      default:
        return AtomText(scope, true);
    }
  }

  Random random_;
  Extras extras_;
  bool in_init_ = false;
  Scope objects_, visible_;
  std::string domain_, problem_;
};

}  // namespace tether::symbolic::naive
