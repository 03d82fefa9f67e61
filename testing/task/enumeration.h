#pragma once

#include <algorithm>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "testing/symbolic/naive.h"
#include "testing/task/random_formula.h"
#include "tether/common/random.h"
#include "tether/ltl/automaton/automaton.h"
#include "tether/symbolic/pddl/expression.h"
#include "tether/task/goal/product.h"

/// For tests: an oracle that finds every plan of a small task by walking all paths by PDDL's definition, and
/// random small tasks to compare with it. Shares no code with grounding, heuristics and search; for a
/// temporal goal it uses the minimal automaton of the whole formula, which the search does not build.
namespace tether::task::oracle {

struct Plan {
  std::vector<std::string> actions;
  int64_t cost = 0;  ///< In millionths.

  auto operator<=>(const Plan&) const = default;
};

class Paths {
 public:
  explicit Paths(const symbolic::Problem& problem, const TemporalGoal* goal = nullptr) : problem_(problem) {
    if (goal != nullptr) automaton_ = ltl::BuildAutomaton(goal->formula, goal->semantics);
    const symbolic::naive::Facts facts = symbolic::naive::Initial(problem);
    Intern(facts, automaton_ ? automaton_->Step(ltl::Automaton::initial(), LetterOf(facts)) : 0);
  }

  /// The plans of up to `longest` actions (-1: all): paths to the first goal state, without a state that
  /// comes twice unless `revisits`. Nothing if there are more than `most` steps to be walked.
  std::optional<std::vector<Plan>> All(int longest, bool revisits, size_t most) {
    longest_ = longest;
    revisits_ = revisits;
    left_ = most;
    cut_off_ = false;
    path_ = {};
    plans_.clear();
    on_path_.clear();
    if (!Walk(0)) return std::nullopt;
    std::sort(plans_.begin(), plans_.end());
    return plans_;
  }
  /// Whether the bound on the length cut paths off in All().
  bool cut_off() const { return cut_off_; }

  enum class Verdict { kPlan, kRevisits, kNoPlan };
  /// The verdict on a sequence of actions.
  Verdict Judge(const std::vector<std::string>& actions) {
    int state = 0;
    std::set<int> seen = {state};
    bool revisits = false;
    for (const std::string& name : actions) {
      if (is_goal_[state]) return Verdict::kNoPlan;
      const std::vector<Step>& steps = StepsOf(state);
      const auto step =
          std::find_if(steps.begin(), steps.end(), [&](const Step& s) { return s.name == name; });
      if (step == steps.end()) return Verdict::kNoPlan;
      state = step->target;
      revisits = !seen.insert(state).second || revisits;
    }
    if (!is_goal_[state]) return Verdict::kNoPlan;
    return revisits ? Verdict::kRevisits : Verdict::kPlan;
  }

 private:
  struct Step {
    std::string name;
    int64_t cost;
    int target;
  };

  /// The propositions are names such as on(a,b).
  ltl::Letter LetterOf(const symbolic::naive::Facts& facts) const {
    std::set<std::string> names;
    for (const symbolic::Atom& atom : facts) {
      std::string name = problem_.domain->predicates[atom.predicate].name;
      for (size_t i = 0; i < atom.arguments.size(); ++i)
        name += (i == 0 ? "(" : ",") + problem_.objects[atom.arguments[i]].name;
      names.insert(symbolic::LowerCase(name + (atom.arguments.empty() ? "" : ")")));
    }
    const std::vector<std::string>& atoms = automaton_->atoms();
    ltl::Letter letter(ltl::LetterWords(atoms.size()), 0);
    for (size_t i = 0; i < atoms.size(); ++i) {
      if (names.count(symbolic::LowerCase(atoms[i]))) letter[i / 64] |= uint64_t{1} << (i % 64);
    }
    return letter;
  }

  int Intern(const symbolic::naive::Facts& facts, int automaton_state) {
    const auto [it, is_new] =
        numbers_.emplace(std::make_pair(facts, automaton_state), static_cast<int>(states_.size()));
    if (is_new) {
      states_.push_back(it->first);
      steps_.emplace_back();
      is_goal_.push_back(automaton_ ? automaton_->IsAccepting(automaton_state)
                                    : symbolic::naive::Holds(problem_, problem_.goal, facts, {}));
    }
    return it->second;
  }

  const std::vector<Step>& StepsOf(int state) {
    const auto s = static_cast<size_t>(state);
    if (!steps_[s]) {
      std::vector<Step> steps;
      const auto [facts, automaton_state] = states_[s];
      for (const symbolic::naive::Step& step : symbolic::naive::Steps(problem_, facts)) {
        const int next = automaton_ ? automaton_->Step(automaton_state, LetterOf(step.after)) : 0;
        steps.push_back({step.name, symbolic::naive::CostOf(problem_, step), Intern(step.after, next)});
      }
      steps_[s] = std::make_unique<std::vector<Step>>(std::move(steps));
    }
    return *steps_[s];
  }

  bool Walk(int state) {
    if (left_-- == 0) return false;
    if (is_goal_[state]) {
      plans_.push_back(path_);
      return true;
    }
    if (automaton_ && automaton_->IsTrap(states_[state].second)) return true;
    if (longest_ >= 0 && path_.actions.size() == static_cast<size_t>(longest_)) {
      cut_off_ = true;
      return true;
    }
    on_path_.insert(state);
    for (const Step& step : StepsOf(state)) {
      if (!revisits_ && on_path_.count(step.target)) continue;
      path_.actions.push_back(step.name);
      path_.cost += step.cost;
      const bool again = on_path_.count(step.target) > 0;
      const bool go_on = Walk(step.target);
      if (again) on_path_.insert(step.target);
      path_.cost -= step.cost;
      path_.actions.pop_back();
      if (!go_on) return false;
    }
    on_path_.erase(state);
    return true;
  }

  const symbolic::Problem& problem_;
  std::optional<ltl::Automaton> automaton_;
  std::map<std::pair<symbolic::naive::Facts, int>, int> numbers_;
  std::vector<std::pair<symbolic::naive::Facts, int>> states_;
  std::vector<std::unique_ptr<std::vector<Step>>> steps_;
  std::vector<bool> is_goal_;
  int longest_ = -1;
  bool revisits_ = false, cut_off_ = false;
  size_t left_ = 0;
  Plan path_;
  std::set<int> on_path_;
  std::vector<Plan> plans_;
};

/// Writes a small task over objects that differ in nothing but the facts. By the seed: STRIPS, conditional
/// effects, derived predicates, all of them with nested formulas (naive::RandomProblem), or one of these with
/// a temporal goal; each with and without costs. Many tasks have no plan or an empty one: other attempts are
/// others of the same kind.
class RandomTask {
 public:
  explicit RandomTask(uint64_t seed, int attempt = 0) : random_(Random(seed).Split(std::to_string(attempt))) {
    const uint64_t kind = seed % 5;
    const int like = kind == 4 ? random_.Index(4) : static_cast<int>(kind);
    const bool costs = random_.Index(3) == 0;
    if (like == 3) {
      const symbolic::naive::RandomProblem nested(random_.Next(),
                                                  {.costs = costs, .derived = random_.Index(2) == 0});
      domain = nested.domain();
      problem = nested.problem();
    } else {
      Write(like == 1, like == 2, costs);
    }
    temporal = kind == 4;
  }

  /// A temporal goal, for the tasks with one.
  std::string Formula(const std::vector<std::string>& propositions, int depth) {
    return RandomFormula(propositions, 3, random_, depth);
  }

  std::string domain, problem;
  bool temporal = false;

 private:
  std::string Literal(const std::vector<std::string>& names, bool changing, bool derived) {
    const auto name = [&] { return names[random_.Index(static_cast<int>(names.size()))]; };
    std::string atom = "(a)";
    const int which = random_.Index(changing ? 5 : derived ? 8 : 6);
    if (!names.empty() && which > 0) {
      static const char* const kUnary[] = {"", "b", "c", "", "", "s", "r", "n"};
      atom = which == 3 || which == 4 ? "(d " + name() + " " + name() + ")"
                                      : std::string("(") + kUnary[which] + " " + name() + ")";
    }
    return random_.Index(3) == 0 ? "(not " + atom + ")" : atom;
  }

  std::string Effect(const std::vector<std::string>& names, bool conditional, bool derived) {
    const int how = conditional ? random_.Index(4) : 3;
    if (how == 0) return "(when " + Literal(names, false, derived) + " " + Literal(names, true, false) + ")";
    if (how > 1) return Literal(names, true, false);
    std::vector<std::string> more = names;
    more.push_back("?z");
    return "(forall (?z) (when " + Literal(more, false, derived) + " " + Literal(more, true, false) + "))";
  }

  void Write(bool conditional, bool derived, bool costs) {
    const int objects = 2 + random_.Index(2);
    domain =
        "(define (domain small) (:requirements :adl :derived-predicates :action-costs)\n"
        "(:predicates (a) (b ?x) (c ?x) (d ?x ?y) (s ?x) (r ?x) (n ?x))\n";
    if (costs) domain += "(:functions (total-cost) - number (price ?x) - number)\n";
    if (derived) {
      domain += "(:derived (r ?x) (or " + Literal({"?x"}, false, false) +
                " (exists (?y) (and (d ?x ?y) (r ?y)))))\n(:derived (n ?x) (and (not (r ?x)) " +
                Literal({"?x"}, false, false) + "))\n";
    }
    for (int i = 2 + random_.Index(2); i > 0; --i) {
      std::vector<std::string> names;
      for (int k = random_.Index(3); k > 0; --k) names.push_back("?v" + std::to_string(k));
      domain += "(:action do" + std::to_string(i) + " :parameters (";
      for (const std::string& name : names) domain += " " + name;
      domain += ") :precondition (and";
      for (int k = random_.Index(3); k > 0; --k) domain += " " + Literal(names, false, derived);
      if (names.size() == 2 && random_.Index(2) == 0) domain += " (not (= ?v1 ?v2))";
      domain += ")\n  :effect (and";
      for (int k = 1 + random_.Index(3); k > 0; --k) domain += " " + Effect(names, conditional, derived);
      if (costs) {
        domain += " (increase (total-cost) " +
                  (names.empty() ? std::to_string(random_.Index(3)) : "(price " + names[0] + ")") + ")";
      }
      domain += "))\n";
    }
    domain += ")\n";
    std::vector<std::string> names;
    for (int i = 0; i < objects; ++i) names.push_back("o" + std::to_string(i));
    problem = "(define (problem p) (:domain small) (:objects";
    for (const std::string& name : names) problem += " " + name;
    problem += ")\n(:init";
    for (int i = random_.Index(6); i > 0; --i) {
      const std::string fact = Literal(names, false, false);
      if (fact[1] != 'n') problem += " " + fact;
    }
    for (const std::string& name : names) {
      if (costs) problem += " (= (price " + name + ") " + std::to_string(random_.Index(3)) + ")";
    }
    problem += ")\n(:goal (and";
    for (int i = 1 + random_.Index(2); i > 0; --i) {
      const bool some = random_.Index(4) == 0;
      problem += some ? " (exists (?x) " + Literal({"?x"}, false, derived) + ")"
                      : " " + Literal(names, false, derived);
    }
    problem += costs ? ")) (:metric minimize (total-cost)))\n" : ")))\n";
  }

  Random random_;
};

}  // namespace tether::task::oracle
