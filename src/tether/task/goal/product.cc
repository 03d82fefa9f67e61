#include "tether/task/goal/product.h"

#include <algorithm>
#include <utility>

#include "tether/ltl/formula/parser.h"
#include "tether/ltl/formula/words.h"
#include "tether/symbolic/pddl/formula_parser.h"

namespace tether::task {
namespace {

std::string Accepted(const std::string& word, const std::vector<std::string>& known) {
  return known.empty() ? "accepted: none is declared" : symbolic::Suggest(word, known);
}

/// Reads "on(box, table)", or "ready" and "ready()" where there are no arguments.
class PropositionReader {
 public:
  PropositionReader(const symbolic::Task& task, const TemporalGoal& goal) : task_(task), goal_(goal) {}

  int Read(const std::string& name, int column) {
    const size_t open = std::min(name.find('('), name.size());
    const symbolic::Domain& domain = task_.domain();
    symbolic::Atom atom{domain.FindPredicate(Trim(name.substr(0, open))), {}};
    if (atom.predicate < 0) {
      std::vector<std::string> known;
      for (const symbolic::Predicate& predicate : domain.predicates) known.push_back(predicate.name);
      const std::string word = Trim(name.substr(0, open));
      const std::string symbol = open < name.size() ? ltl::OperatorFor(word) : "";
      return Fail(column, "unknown proposition '" + name + "': there is no predicate '" + word + "'",
                  (symbol.empty() ? "" : "for the operator, write " + symbol + "; ") + Accepted(word, known));
    }
    const symbolic::Predicate& predicate = domain.predicates[atom.predicate];
    std::vector<std::string> words = Split(name, open);
    if (words.size() != predicate.parameters.size()) {
      std::string form = predicate.name + "(";
      for (size_t i = 0; i < predicate.parameters.size(); ++i) {
        form += (i > 0 ? "," : "") + domain.TypeText(predicate.parameters[i].types);
      }
      return Fail(column,
                  "'" + name + "' has " + std::to_string(words.size()) + " argument" +
                      (words.size() == 1 ? "" : "s") + ", not " + std::to_string(predicate.parameters.size()),
                  "accepted: " + form + ")");
    }
    for (size_t i = 0; i < words.size(); ++i) {
      const int object = task_.problem().FindObject(words[i]);
      const std::vector<int>& types = predicate.parameters[i].types;
      if (object >= 0 && domain.Fits(task_.problem().objects[object].types, types)) {
        atom.arguments.push_back(object);
        continue;
      }
      std::vector<std::string> fit;
      for (const symbolic::TypedName& known : task_.problem().objects) {
        if (domain.Fits(known.types, types)) fit.push_back(known.name);
      }
      return Fail(column,
                  "unknown proposition '" + name + "': " +
                      (object < 0 ? "there is no object '" + words[i] + "'"
                                  : "'" + words[i] + "' is not of type '" + domain.TypeText(types) + "'"),
                  Accepted(words[i], fit));
    }
    const int index = task_.FindAtom(atom);
    if (index >= 0) return index;
    return task_.HoldsAlways(atom) ? Propositions::kAlways : Propositions::kNever;
  }

  void ThrowIfAny() const { mistakes_.ThrowIfAny(); }

 private:
  static std::string Trim(const std::string& text) {
    const size_t begin = text.find_first_not_of(" \t");
    if (begin == std::string::npos) return "";
    return text.substr(begin, text.find_last_not_of(" \t") - begin + 1);
  }

  static std::vector<std::string> Split(const std::string& name, size_t open) {
    std::vector<std::string> words;
    if (open >= name.size()) return words;
    std::string inside = Trim(name.substr(open + 1));
    if (!inside.empty() && inside.back() == ')') inside.pop_back();
    if (Trim(inside).empty()) return words;
    for (size_t begin = 0; begin <= inside.size();) {
      const size_t comma = std::min(inside.find(',', begin), inside.size());
      words.push_back(Trim(inside.substr(begin, comma - begin)));
      begin = comma + 1;
    }
    return words;
  }

  int Fail(int column, const std::string& message, const std::string& accepted) {
    mistakes_.Add(ltl::FormulaLocation(goal_.where, column),
                  ltl::FormulaPrefix(goal_.where, column) + message, accepted);
    return Propositions::kNever;
  }

  const symbolic::Task& task_;
  const TemporalGoal& goal_;
  Diagnostics mistakes_;
};

}  // namespace

std::vector<int> Propositions::Resolve(const symbolic::Task& task, const TemporalGoal& goal) {
  const ltl::Formula& formula = goal.formula;
  std::vector<int> columns(formula.atoms().size(), 0);
  for (size_t i = formula.nodes().size(); i-- > 0;) {
    const ltl::Formula::Node& node = formula.nodes()[i];
    if (node.op == ltl::Operator::kAtom) columns[node.atom] = node.column;
  }
  PropositionReader reader(task, goal);
  std::vector<int> atoms;
  for (size_t i = 0; i < columns.size(); ++i) atoms.push_back(reader.Read(formula.atoms()[i], columns[i]));
  reader.ThrowIfAny();
  return atoms;
}

Product::Product(std::shared_ptr<const symbolic::Task> task, std::optional<TemporalGoal> goal)
    : task_(std::move(task)), goal_(std::move(goal)) {
  if (!goal_) return;
  propositions_ = Propositions::Resolve(*task_, *goal_);
  automaton_ = std::make_unique<ltl::LazyAutomaton>(goal_->formula, goal_->semantics);
  letter_.assign(automaton_->letter_words(), 0);
}

bool Product::Read(int automaton_state, std::span<uint64_t> state) {
  std::fill(letter_.begin(), letter_.end(), 0);
  for (int proposition : automaton_->RelevantAtoms(automaton_state)) {
    const auto i = static_cast<size_t>(proposition);
    const int atom = propositions_[i];
    const bool holds = atom >= 0 ? ltl::IsTrue(state, atom) : atom == Propositions::kAlways;
    if (holds) letter_[i / 64] |= uint64_t{1} << (i % 64);
  }
  const int next = automaton_->Step(automaton_state, ltl::LetterView(letter_));
  state[task_->words()] = static_cast<uint64_t>(next);
  return !automaton_->IsTrap(next);
}

std::optional<symbolic::State> Product::Start() {
  symbolic::State state = task_->initial_state();
  if (automaton_) {
    state.push_back(0);
    int at = ltl::LazyAutomaton::initial();
    for (const ltl::Letter& letter : goal_->read) at = automaton_->Step(at, ltl::LetterView(letter));
    if (automaton_->IsTrap(at) || !Read(at, state)) return std::nullopt;
  }
  for (const ActionId action : done_) {
    symbolic::State next(state.size());
    if (!Apply(action, state, next)) return std::nullopt;
    state = std::move(next);
  }
  return state;
}

bool Product::Apply(ActionId action, symbolic::StateView state, std::span<uint64_t> next) {
  const size_t words = task_->words();
  task_->Apply(action, state.first(words), next.first(words));
  return !automaton_ || Read(AutomatonState(state), next);
}

bool Product::IsGoal(symbolic::StateView state) const {
  if (automaton_) return automaton_->IsAccepting(AutomatonState(state));
  return task_->IsGoal(state);
}

}  // namespace tether::task
