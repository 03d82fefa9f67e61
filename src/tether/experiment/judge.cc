#include "tether/experiment/judge.h"

#include <algorithm>

#include "tether/experiment/contact.h"
#include "tether/geometry/query.h"

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

Judgement JudgeGoal(const scene::Scene& scene, const Truth& truth, const symbolic::Task& task,
                    const std::vector<std::string>& actions, int actions_done) {
  symbolic::State state = task.initial_state();
  for (int i = 0; i < actions_done && i < static_cast<int>(actions.size()); ++i) {
    const int action = task.FindAction(actions[static_cast<size_t>(i)]);
    if (action >= 0 && task.IsApplicable(action, state)) state = task.Apply(action, state);
  }
  const symbolic::Problem& problem = task.problem();
  Judgement judgement;
  const auto holds = [&](const symbolic::Atom& atom) {
    GoalFact fact;
    fact.atom = task.AtomName(atom);
    const std::string& predicate = problem.domain->predicates[static_cast<size_t>(atom.predicate)].name;
    std::vector<std::string> names;
    for (int argument : atom.arguments) names.push_back(problem.objects[static_cast<size_t>(argument)].name);
    const bool bodies = std::all_of(names.begin(), names.end(), [&](const std::string& name) {
      return scene.FindObject(name) != nullptr;
    });
    if (predicate == "on" && names.size() == 2 && bodies) {
      fact.geometric = true;
      fact.holds = IsOn(scene, truth, names[0], names[1]);
    } else if (predicate == "inhand" && names.size() == 1 && bodies) {
      fact.geometric = true;
      fact.holds = IsInHand(scene, truth, names[0]);
    } else {
      fact.holds = task.Holds(atom, state);
    }
    const auto same = [&](const GoalFact& other) { return other.atom == fact.atom; };
    if (std::none_of(judgement.facts.begin(), judgement.facts.end(), same)) judgement.facts.push_back(fact);
    return fact.holds;
  };
  judgement.goal_reached = Evaluator(problem, holds).Evaluate(problem.goal);
  return judgement;
}

}  // namespace tether::experiment
