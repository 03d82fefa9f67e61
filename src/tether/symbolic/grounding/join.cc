#include "tether/symbolic/grounding/join.h"

#include <algorithm>

namespace tether::symbolic {

size_t AtomHash::operator()(const Atom& atom) const {
  uint64_t hash = static_cast<uint64_t>(atom.predicate) + 0x9E3779B97F4A7C15u;
  for (int argument : atom.arguments) {
    hash = (hash ^ static_cast<uint64_t>(argument)) * 0xBF58476D1CE4E5B9u;
    hash ^= hash >> 29;
  }
  return static_cast<size_t>(hash);
}

int AtomTable::Number(const Atom& atom) {
  const auto [it, is_new] = numbers_.try_emplace(atom, static_cast<int>(atoms_.size()));
  if (is_new) atoms_.push_back(&it->first);
  return it->second;
}

int AtomTable::Find(const Atom& atom) const {
  const auto it = numbers_.find(atom);
  return it == numbers_.end() ? -1 : it->second;
}

Join::Join(const Problem& problem, const AtomTable& table, Instantiator& instantiator)
    : problem_(problem), table_(table), instantiator_(instantiator) {
  const Domain& domain = *problem.domain;
  for (const Predicate& predicate : domain.predicates) {
    relations_.push_back({{}, {}});
    relations_.back().by_argument.assign(predicate.parameters.size(),
                                         std::vector<std::vector<int>>(problem.objects.size()));
  }
  for (size_t type = 0; type < domain.types.size(); ++type) {
    of_type_.emplace_back();
    for (const TypedName& object : problem.objects) {
      of_type_.back().push_back(domain.Fits(object.types, {static_cast<int>(type)}));
    }
  }
}

void Join::AddFact(int number) {
  const Atom& atom = table_.atom(number);
  Relation& relation = relations_[atom.predicate];
  relation.facts.push_back(number);
  for (size_t i = 0; i < atom.arguments.size(); ++i) {
    relation.by_argument[i][atom.arguments[i]].push_back(number);
  }
}

void Join::Begin(const JoinRule& rule) {
  binding_.assign(rule.parameters->size(), -1);
  trail_.clear();
  used_.assign(rule.patterns.size(), false);
  waits_.clear();
  for (const JoinRule::Test& test : rule.tests) waits_.push_back(static_cast<int>(test.variables.size()));
  trigger_ = trigger_fact_ = -1;
}

void Join::Match(const JoinRule& rule, const Visit& visit) {
  Begin(rule);
  for (const JoinRule::Test& test : rule.tests) {
    if (test.variables.empty() && instantiator_.Instantiate(*test.formula, binding_).is_false()) return;
  }
  Extend(rule, visit);
}

void Join::Match(const JoinRule& rule, int trigger, int number, const Visit& visit) {
  Begin(rule);
  for (const JoinRule::Test& test : rule.tests) {
    if (test.variables.empty() && instantiator_.Instantiate(*test.formula, binding_).is_false()) return;
  }
  trigger_ = trigger;
  trigger_fact_ = number;
  used_[trigger] = true;
  if (Unify(rule, rule.patterns[trigger], table_.atom(number))) Extend(rule, visit);
}

const std::vector<int>& Join::Candidates(const JoinRule::Pattern& pattern) const {
  const Relation& relation = relations_[pattern.predicate];
  const std::vector<int>* fewest = &relation.facts;
  for (size_t i = 0; i < pattern.terms.size(); ++i) {
    const Term& term = pattern.terms[i];
    const int object = term.is_variable ? binding_[term.index] : term.index;
    if (object < 0) continue;
    const std::vector<int>& facts = relation.by_argument[i][object];
    if (facts.size() < fewest->size()) fewest = &facts;
  }
  return *fewest;
}

void Join::Extend(const JoinRule& rule, const Visit& visit) {
  int best = -1;
  const std::vector<int>* fewest = nullptr;
  for (size_t i = 0; i < rule.patterns.size(); ++i) {
    if (used_[i]) continue;
    const std::vector<int>& candidates = Candidates(rule.patterns[i]);
    if (best >= 0 && candidates.size() >= fewest->size()) continue;
    best = static_cast<int>(i);
    fewest = &candidates;
  }
  const size_t mark = trail_.size();
  if (best >= 0) {
    used_[best] = true;
    for (int fact : *fewest) {
      instantiator_.CountStep();
      if (best < trigger_ && fact == trigger_fact_) continue;
      if (Unify(rule, rule.patterns[best], table_.atom(fact))) Extend(rule, visit);
      Undo(rule, mark);
    }
    used_[best] = false;
    return;
  }
  const auto open = std::find(binding_.begin(), binding_.end(), -1);
  if (open == binding_.end()) {
    instantiator_.CountStep();
    visit(binding_);
    return;
  }
  const auto variable = static_cast<size_t>(open - binding_.begin());
  for (int object : instantiator_.types().ObjectsOf((*rule.parameters)[variable].types)) {
    instantiator_.CountStep();
    if (Bind(rule, static_cast<int>(variable), object)) Extend(rule, visit);
    Undo(rule, mark);
  }
}

bool Join::Unify(const JoinRule& rule, const JoinRule::Pattern& pattern, const Atom& fact) {
  for (size_t i = 0; i < pattern.terms.size(); ++i) {
    const Term& term = pattern.terms[i];
    const int bound = term.is_variable ? binding_[term.index] : term.index;
    if (bound >= 0) {
      if (bound != fact.arguments[i]) return false;
    } else if (!Bind(rule, term.index, fact.arguments[i])) {
      return false;
    }
  }
  return true;
}

bool Join::Bind(const JoinRule& rule, int variable, int object) {
  const std::vector<int>& types = (*rule.parameters)[variable].types;
  bool fits = std::any_of(types.begin(), types.end(), [&](int type) { return of_type_[type][object]; });
  // An object of an `either` type fits where all of its types do.
  if (!fits && types.size() > 1) {
    fits = problem_.domain->Fits(problem_.objects[object].types, types);
  }
  if (!fits) return false;
  binding_[variable] = object;
  trail_.push_back(variable);
  bool good = true;
  for (size_t i = 0; i < rule.tests.size(); ++i) {
    const std::vector<int>& variables = rule.tests[i].variables;
    if (std::find(variables.begin(), variables.end(), variable) == variables.end()) continue;
    if (--waits_[i] == 0 && good) {
      good = !instantiator_.Instantiate(*rule.tests[i].formula, binding_).is_false();
    }
  }
  return good;
}

void Join::Undo(const JoinRule& rule, size_t mark) {
  while (trail_.size() > mark) {
    const int variable = trail_.back();
    trail_.pop_back();
    binding_[variable] = -1;
    for (size_t i = 0; i < rule.tests.size(); ++i) {
      const std::vector<int>& variables = rule.tests[i].variables;
      if (std::find(variables.begin(), variables.end(), variable) != variables.end()) ++waits_[i];
    }
  }
}

}  // namespace tether::symbolic
