#include "tether/experiment/judge.h"

#include <algorithm>

#include "tether/experiment/contact.h"
#include "tether/geometry/query.h"
#include "tether/scene/region.h"

namespace tether::experiment {
namespace {

constexpr double kContact = 3e-3;     // m: what a settled simulated contact stays well within
constexpr double kGraspForce = 1.0;   // N
constexpr double kGraspReach = 0.01;  // m

/// Evaluates a formula over the problem's objects, atom by atom.
class Evaluator {
 public:
  Evaluator(const symbolic::Problem& problem, std::function<bool(const symbolic::Atom&)> holds)
      : problem_(problem), holds_(std::move(holds)) {}

  bool Evaluate(const symbolic::Formula& formula) {
    using Kind = symbolic::Formula::Kind;
    switch (formula.kind) {
      case Kind::kAtom: {
        symbolic::Atom atom{formula.predicate, {}};
        for (const symbolic::Term& term : formula.terms) atom.arguments.push_back(Resolve(term));
        return holds_(atom);
      }
      case Kind::kEquals:
        return Resolve(formula.terms[0]) == Resolve(formula.terms[1]);
      case Kind::kNot:
        return !Evaluate(formula.children[0]);
      case Kind::kImply:
        return !Evaluate(formula.children[0]) || Evaluate(formula.children[1]);
      case Kind::kAnd:
      case Kind::kOr: {
        // No short cut: every atom is looked at, so that the judgement can tell them all.
        bool all = true, any = false;
        for (const symbolic::Formula& child : formula.children) {
          const bool value = Evaluate(child);
          all = all && value;
          any = any || value;
        }
        return formula.kind == Kind::kAnd ? all : any;
      }
      case Kind::kForall:
      case Kind::kExists: {
        bool all = true, any = false;
        Quantify(formula, 0, all, any);
        return formula.kind == Kind::kForall ? all : any;
      }
    }
    return false;
  }

 private:
  int Resolve(const symbolic::Term& term) const {
    return term.is_variable ? binding_[static_cast<size_t>(term.index)] : term.index;
  }

  void Quantify(const symbolic::Formula& formula, size_t variable, bool& all, bool& any) {
    if (variable == formula.variables.size()) {
      const bool value = Evaluate(formula.children[0]);
      all = all && value;
      any = any || value;
      return;
    }
    for (size_t i = 0; i < problem_.objects.size(); ++i) {
      if (!problem_.domain->Fits(problem_.objects[i].types, formula.variables[variable].types)) continue;
      binding_.push_back(static_cast<int>(i));
      Quantify(formula, variable + 1, all, any);
      binding_.pop_back();
    }
  }

  const symbolic::Problem& problem_;
  std::function<bool(const symbolic::Atom&)> holds_;
  std::vector<int> binding_;
};

}  // namespace

bool IsInHand(const scene::Scene& scene, const Truth& truth, const std::string& object) {
  const scene::Object* body = scene.FindObject(object);
  if (body == nullptr || !truth.contact_force) return false;
  for (const auto& [robot, X_WH] : truth.X_WHand) {
    if (truth.contact_force(robot, object) < kGraspForce) continue;
    if (geometry::DistanceToPoint(body->shape, truth.X_WO.at(object), X_WH.p).distance < kGraspReach)
      return true;
  }
  return false;
}

bool IsOn(const scene::Scene& scene, const Truth& truth, const std::string& upper, const std::string& lower) {
  const scene::Object* a = scene.FindObject(upper);
  const scene::Object* b = scene.FindObject(lower);
  if (a == nullptr || b == nullptr || a == b || IsInHand(scene, truth, upper)) return false;
  return FindResting(*a, truth.X_WO.at(upper), *b, truth.X_WO.at(lower)).Holds(kContact);
}

bool IsIn(const scene::Scene& scene, const Truth& truth, const std::string& object, const std::string& area) {
  const scene::Object* body = scene.FindObject(object);
  return body != nullptr && !IsInHand(scene, truth, object) && scene::IsIn(scene, truth.X_WO, *body, area);
}

namespace {

/// The symbolic state after the first `actions_done` actions.
symbolic::State StateAfter(const symbolic::Task& task, const std::vector<std::string>& actions,
                           int actions_done) {
  symbolic::State state = task.initial_state();
  for (int i = 0; i < actions_done && i < static_cast<int>(actions.size()); ++i) {
    const int action = task.FindAction(actions[static_cast<size_t>(i)]);
    if (action >= 0 && task.IsApplicable(action, state)) state = task.Apply(action, state);
  }
  return state;
}

GoalFact JudgeAtom(const scene::Scene& scene, const Truth& truth, const symbolic::Task& task,
                   const symbolic::Atom& atom, const symbolic::State& state) {
  GoalFact fact;
  fact.atom = task.AtomName(atom);
  const std::string& predicate = task.domain().predicates[static_cast<size_t>(atom.predicate)].name;
  std::vector<std::string> names;
  for (int argument : atom.arguments)
    names.push_back(task.problem().objects[static_cast<size_t>(argument)].name);
  const bool of_body = !names.empty() && scene.FindObject(names[0]) != nullptr;
  fact.geometric = true;
  if (predicate == "on" && names.size() == 2 && of_body && scene.FindObject(names[1]) != nullptr) {
    fact.holds = IsOn(scene, truth, names[0], names[1]);
  } else if (predicate == "in" && names.size() == 2 && of_body &&
             (scene.FindRegion(names[1]) != nullptr || scene.groups.contains(names[1]))) {
    fact.holds = IsIn(scene, truth, names[0], names[1]);
  } else if (predicate == "inhand" && names.size() == 1 && of_body) {
    fact.holds = IsInHand(scene, truth, names[0]);
  } else {
    fact.geometric = false;
    fact.holds = task.Holds(atom, state);
  }
  return fact;
}

}  // namespace

Judgement JudgeGoal(const scene::Scene& scene, const Truth& truth, const symbolic::Task& task,
                    const std::vector<std::string>& actions, int actions_done) {
  const symbolic::State state = StateAfter(task, actions, actions_done);
  Judgement judgement;
  const auto holds = [&](const symbolic::Atom& atom) {
    const GoalFact fact = JudgeAtom(scene, truth, task, atom, state);
    const auto same = [&](const GoalFact& other) { return other.atom == fact.atom; };
    if (std::none_of(judgement.facts.begin(), judgement.facts.end(), same)) judgement.facts.push_back(fact);
    return fact.holds;
  };
  judgement.goal_reached = Evaluator(task.problem(), holds).Evaluate(task.problem().goal);
  return judgement;
}

TemporalJudge::TemporalJudge(const scene::Scene& scene, const symbolic::Task& task,
                             const task::TemporalGoal& goal)
    : scene_(scene),
      task_(task),
      propositions_(task::Propositions::Resolve(task, goal)),
      automaton_(goal.formula, goal.semantics) {}

void TemporalJudge::Observe(const Truth& truth, const std::vector<std::string>& actions) {
  const symbolic::State state = StateAfter(task_, actions, letters_++);
  ltl::Letter letter(automaton_.letter_words(), 0);
  facts_.clear();
  for (int proposition : automaton_.RelevantAtoms(state_)) {
    const auto i = static_cast<size_t>(proposition);
    bool holds = propositions_[i] == task::Propositions::kAlways;
    if (propositions_[i] >= 0) {
      facts_.push_back(
          JudgeAtom(scene_, truth, task_, task_.atoms()[static_cast<size_t>(propositions_[i])], state));
      holds = facts_.back().holds;
    }
    if (holds) letter[i / 64] |= uint64_t{1} << (i % 64);
  }
  state_ = automaton_.Step(state_, ltl::LetterView(letter));
}

Judgement TemporalJudge::Judge() const { return {automaton_.IsAccepting(state_), facts_}; }

}  // namespace tether::experiment
