#include "tether/evaluation/judge.h"

#include <algorithm>

#include "tether/execution/observer/fact_observer.h"
#include "tether/geometry/distance/query.h"
#include "tether/geometry/polygon/support.h"
#include "tether/scene/region.h"
#include "tether/scene/resting_contact.h"

namespace tether::evaluation {
namespace {

constexpr double kContact = 3e-3;     // m: what a settled simulated contact stays well within
constexpr double kLean = 0.1;         // rad
constexpr double kRestSpeed = 0.02;   // m/s
constexpr double kRestTurn = 0.2;     // rad/s
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
        // No short cut: every atom is evaluated, so that the judgement lists them all.
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
    return term.is_variable ? binding_[term.index] : term.index;
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
  const math::Pose &X_WA = truth.X_WO.at(upper), &X_WB = truth.X_WO.at(lower);
  if (!scene::StandsOn(*a, X_WA, *b, X_WB, kContact, kLean)) return false;
  if (truth.X_WO_before.empty()) return true;
  // The motion relative to the lower one.
  const math::Pose X_BA = math::Between(X_WB, X_WA),
                   X_BA_before = math::Between(truth.X_WO_before.at(lower), truth.X_WO_before.at(upper));
  const Eigen::Vector3d turned = math::LogSO3(X_BA.R * X_BA_before.R.transpose());
  // An object on a round side turns as it rolls: its turning may be as fast as rolling at the allowed speed.
  const Eigen::Vector3d down = -X_WA.R.transpose().col(2);
  const double height = geometry::Support(a->shape, down) - down.dot(geometry::CentreOfMass(a->shape));
  const double turn = std::max(kRestTurn, kRestSpeed / std::max(height, kContact));
  return (X_BA.p - X_BA_before.p).norm() <= kRestSpeed * kRestWindow && turned.norm() <= turn * kRestWindow;
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
    const ActionId action = task.FindAction(actions[i]);
    if (action.valid() && task.IsApplicable(action, state)) state = task.Apply(action, state);
  }
  return state;
}

GoalFact JudgeAtom(const scene::Scene& scene, const Truth& truth, const symbolic::Task& task,
                   const symbolic::Atom& atom, const symbolic::State& state) {
  GoalFact fact;
  fact.atom = task.AtomName(atom);
  const std::string& predicate = task.domain().predicates[atom.predicate].name;
  std::vector<std::string> names;
  for (int argument : atom.arguments) names.push_back(task.problem().objects[argument].name);
  using execution::Observable;
  const Observable observable = execution::FindObservable(scene, predicate, names);
  fact.geometric = observable != Observable::kNothing;
  switch (observable) {
    case Observable::kOn:
      fact.holds = IsOn(scene, truth, names[0], names[1]);
      break;
    case Observable::kIn:
      fact.holds = IsIn(scene, truth, names[0], names[1]);
      break;
    case Observable::kInHand:
      fact.holds = IsInHand(scene, truth, names[0]);
      break;
    case Observable::kNothing:
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

namespace {

bool HasNext(const ltl::Formula& formula) {
  const auto& nodes = formula.nodes();
  return std::any_of(nodes.begin(), nodes.end(), [](const ltl::Formula::Node& node) {
    return node.op == ltl::Operator::kNext || node.op == ltl::Operator::kStrongNext;
  });
}

/// The conjunction of the conjuncts with an X, or of those without.
ltl::Formula Conjuncts(const ltl::Formula& formula, bool with_next) {
  std::vector<ltl::Formula> all, chosen;
  const ltl::Formula::Node& root = formula.node(formula.root());
  if (root.op == ltl::Operator::kAnd) {
    for (const int operand : root.operands) all.push_back(formula.Sub(operand));
  } else {
    all.push_back(formula);
  }
  for (const ltl::Formula& conjunct : all) {
    if (HasNext(conjunct) == with_next) chosen.push_back(conjunct);
  }
  if (chosen.empty()) return ltl::Formula();
  return chosen.size() == 1 ? chosen[0] : ltl::Formula::Make(ltl::Operator::kAnd, chosen);
}

}  // namespace

TemporalJudge::Part::Part(const ltl::Formula& formula, const symbolic::Task& task,
                          const task::TemporalGoal& goal)
    : propositions(task::Propositions::Resolve(task, {formula, goal.semantics, goal.where})),
      automaton(formula, goal.semantics) {}

TemporalJudge::TemporalJudge(const scene::Scene& scene, const symbolic::Task& task,
                             const task::TemporalGoal& goal)
    : scene_(scene),
      task_(task),
      bounded_(Conjuncts(goal.formula, true), task, goal),
      sampled_(Conjuncts(goal.formula, false), task, goal),
      symbolic_(task.initial_state()) {
  for (const int atom : task::Propositions::Resolve(task, goal)) {
    if (atom >= 0 && std::find(atoms_.begin(), atoms_.end(), atom) == atoms_.end()) atoms_.push_back(atom);
  }
}

GoalFact TemporalJudge::JudgeNumber(int atom, const Truth& truth) const {
  return JudgeAtom(scene_, truth, task_, task_.atoms()[atom], symbolic_);
}

void TemporalJudge::Step(Part& part, const Values& holds) {
  ltl::Letter letter(part.automaton.letter_words(), 0);
  for (const int proposition : part.automaton.RelevantAtoms(part.state)) {
    const auto i = static_cast<size_t>(proposition);
    const int atom = part.propositions[i];
    if (atom >= 0 ? holds(atom) : atom == task::Propositions::kAlways)
      letter[i / 64] |= uint64_t{1} << (i % 64);
  }
  part.state = part.automaton.Step(part.state, ltl::LetterView(letter));
}

void TemporalJudge::Feed(const std::function<Truth()>& truth, const std::vector<std::string>& actions,
                         int done, bool running) {
  const int count = static_cast<int>(actions.size());
  if (letters_ > done) {
    if (!NeedsSamples()) return;
    return Sample(truth(), running && done < count ? actions[ToIndex(std::max(done, 0))] : "");
  }
  while (letters_ <= done && letters_ <= count) Observe(truth(), actions);
}

void TemporalJudge::Observe(const Truth& truth, const std::vector<std::string>& actions) {
  symbolic_ = StateAfter(task_, actions, letters_++);
  for (const int atom : atoms_) {
    const bool holds = at_boundary_[atom] = JudgeNumber(atom, truth).holds;
    if (holds) held_[atom] = true;
  }
  const Values holds = [&](int atom) { return at_boundary_.at(atom); };
  Step(bounded_, holds);
  Step(sampled_, holds);
}

void TemporalJudge::Sample(const Truth& truth, const std::string& running) {
  if (running != running_) {
    running_ = running;
    effects_.clear();
    const ActionId action = running.empty() ? ActionId() : task_.FindAction(running);
    if (action.valid()) {
      for (const symbolic::GroundEffect& effect : task_.actions()[action].effects) {
        effects_.insert(effects_.end(), effect.deletes.begin(), effect.deletes.end());
        effects_.insert(effects_.end(), effect.adds.begin(), effect.adds.end());
      }
    }
  }
  Step(sampled_, [&](int atom) {
    const auto before = at_boundary_.find(atom);
    const bool changing = std::find(effects_.begin(), effects_.end(), atom) != effects_.end();
    if (changing && before != at_boundary_.end()) return before->second;
    const bool holds = JudgeNumber(atom, truth).holds;
    if (holds) held_[atom] = true;
    return holds;
  });
}

Judgement TemporalJudge::Judge(const Truth& truth) const {
  Judgement judgement;
  judgement.goal_reached =
      bounded_.automaton.IsAccepting(bounded_.state) && sampled_.automaton.IsAccepting(sampled_.state);
  for (const int atom : atoms_) {
    GoalFact fact = JudgeNumber(atom, truth);
    fact.lapsed = !fact.holds && held_.contains(atom) && task_.Holds(task_.atoms()[atom], symbolic_);
    judgement.facts.push_back(fact);
  }
  return judgement;
}

}  // namespace tether::evaluation
