#include "tether/symbolic/pddl/formula_parser.h"

#include <algorithm>
#include <utility>

namespace tether::symbolic {
namespace {

const std::vector<std::string> kConnectives = {"and", "or", "not", "imply", "forall", "exists"};
const std::vector<std::string> kNumeric = {"<",        ">",        "<=",     ">=",       "+",         "*",
                                           "increase", "decrease", "assign", "scale-up", "scale-down"};
const std::vector<std::string> kModal = {"preference",      "always",       "sometime",
                                         "within",          "at-most-once", "sometime-after",
                                         "sometime-before", "hold-during",  "hold-after"};

bool Contains(const std::vector<std::string>& list, const std::string& word) {
  return std::find(list.begin(), list.end(), word) != list.end();
}

std::string Quote(std::string_view text) { return "'" + std::string(text) + "'"; }

/// A short form of the expression for messages.
std::string Show(const Expression& expression) {
  if (!expression.is_list) return Quote(expression.word);
  if (expression.items.empty()) return "'()'";
  return "'(" + std::string(expression.head()) + (expression.items.size() > 1 ? " …)'" : ")'");
}

std::string Signature(const Predicate& predicate, const Domain& domain) {
  std::string text = "(" + predicate.name;
  for (const TypedName& p : predicate.parameters) text += " ?" + p.name + " - " + domain.TypeText(p.types);
  return text + ")";
}

}  // namespace

bool IsName(std::string_view word) {
  auto is_letter = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
           static_cast<unsigned char>(c) >= 0x80;
  };
  const auto is_in = [](char c, std::string_view list) { return list.find(c) != std::string_view::npos; };
  if (word.empty() || !(is_letter(word.front()) || is_in(word.front(), "_@#$&%"))) return false;
  return std::all_of(word.begin(), word.end(),
                     [&](char c) { return is_letter(c) || is_in(c, "-_.@#$&%+*/^~!|<>"); });
}

std::string Suggest(std::string_view word, const std::vector<std::string>& known) {
  if (known.empty()) return "none is declared";
  std::vector<std::string> lower;
  for (const std::string& name : known) lower.push_back(LowerCase(name));
  const std::string nearest = NearestMatch(LowerCase(word), lower);
  std::string text;
  for (size_t i = 0; i < known.size() && text.empty() && !nearest.empty(); ++i) {
    if (lower[i] == nearest) text = "did you mean " + Quote(known[i]) + "? ";
  }
  return text + "accepted: " + JoinAlternatives(known);
}

std::vector<TypedName> ParseTypedList(const std::vector<Expression>& items, size_t first, NameKind kind,
                                      const Domain& domain, Diagnostics& diagnostics) {
  std::vector<TypedName> list;
  size_t untyped = 0;     // Names from here on still wait for their type.
  bool has_name = false;  // Since the last type; a bad name counts too.
  auto add_type = [&](const Expression& e, std::vector<int>& types) {
    const int type = e.is_list ? -1 : domain.FindType(e.word);
    if (type >= 0) {
      types.push_back(type);
      return;
    }
    const std::string message = "unknown type " + Show(e);
    const bool said = std::any_of(diagnostics.list().begin(), diagnostics.list().end(),
                                  [&](const Diagnostic& known) { return known.message == message; });
    if (!said) diagnostics.Add(e.where, message, Suggest(e.word, NamesOf(domain.types)));
  };
  for (size_t i = first; i < items.size(); ++i) {
    const Expression& item = items[i];
    if (!item.is_list && item.word == "-") {
      std::vector<int> types;
      if (!has_name) diagnostics.Add(item.where, "'-' without a name before it");
      if (++i >= items.size()) {
        diagnostics.Add(item.where, "'-' without a type after it", Suggest("", NamesOf(domain.types)));
        break;
      }
      if (LowerCase(items[i].head()) == "either") {
        for (size_t j = 1; j < items[i].items.size(); ++j) add_type(items[i].items[j], types);
        if (items[i].items.size() == 1) diagnostics.Add(items[i].where, "'(either)' without a type");
      } else {
        add_type(items[i], types);
      }
      for (; untyped < list.size(); ++untyped) list[untyped].types = types;
      has_name = false;
      continue;
    }
    has_name = true;
    std::string name = item.word;
    if (name.size() > 1 && name.front() == '-' && domain.FindType(std::string_view(name).substr(1)) >= 0) {
      diagnostics.Add(item.where, "a space is missing after the '-' of " + Show(item),
                      "accepted: - " + name.substr(1));
      continue;
    }
    if (kind != NameKind::kObject) {
      if (item.is_list || name.size() < 2 || name[0] != '?' || !IsName(std::string_view(name).substr(1))) {
        diagnostics.Add(item.where, Show(item) + " is not a variable",
                        "accepted: a name that begins with '?'");
        // Kept, so that its uses are not reported too.
        if (!item.is_list && kind == NameKind::kDeclared) list.push_back({std::move(name), {}, item.where});
        continue;
      }
      name.erase(0, 1);
    } else if (item.is_list || !IsName(name)) {
      diagnostics.Add(item.where, Show(item) + " is not a name",
                      "accepted: letters, digits, '-', '_', '.' and '@'");
      continue;
    }
    if (kind != NameKind::kObject && FindNamed(list, name) >= 0) {
      if (kind == NameKind::kDeclared) {
        diagnostics.Warn(item.where, "parameter '?" + name + "' is declared twice: they are taken for two");
      } else {
        diagnostics.Add(item.where, "variable '?" + name + "' is declared twice");
        continue;
      }
    }
    list.push_back({std::move(name), {}, item.where});
  }
  for (; untyped < list.size(); ++untyped) list[untyped].types = {0};
  return list;
}

bool FormulaParser::HasItems(const Expression& expression, size_t count, const char* usage) {
  if (expression.items.size() == count) return true;
  diagnostics_.Add(expression.where,
                   "'(" + expression.items.front().word + " …)' has " +
                       std::to_string(expression.items.size() - 1) + " parts, not " +
                       std::to_string(count - 1),
                   std::string("accepted: ") + usage);
  return false;
}

const std::vector<int>& FormulaParser::TypesOf(const Term& term) const {
  return term.is_variable ? scope_[term.index].types : objects_[term.index].types;
}

bool FormulaParser::ParseTerm(const Expression& expression, Term& term) {
  if (expression.is_list) {
    diagnostics_.Add(expression.where, Show(expression) + " is not a variable or object",
                     "functions are not supported");
    return false;
  }
  const std::string& word = expression.word;
  if (word[0] == '?') {
    const std::string name = LowerCase(std::string_view(word).substr(1));
    for (size_t i = scope_.size(); i-- > 0;) {
      if (LowerCase(scope_[i].name) == name) {
        term = {true, static_cast<int>(i)};
        return true;
      }
    }
    std::vector<std::string> known;
    for (const TypedName& variable : scope_) known.push_back("?" + variable.name);
    diagnostics_.Add(expression.where, "unknown variable " + Quote(word), Suggest(word, known));
    return false;
  }
  const int object = FindNamed(objects_, word);
  if (object >= 0) {
    term = {false, object};
    return true;
  }
  std::vector<std::string> known = NamesOf(objects_);
  for (const TypedName& variable : scope_) {
    if (LowerCase(variable.name) == LowerCase(word)) known = {"?" + variable.name};
  }
  diagnostics_.Add(expression.where, "unknown object " + Quote(word), Suggest(word, known));
  return false;
}

Formula FormulaParser::ParseAtom(const Expression& expression) {
  Formula formula;
  formula.where = expression.where;
  const std::string_view head = expression.head();
  const int index = domain_.FindPredicate(head);
  if (index < 0) {
    std::vector<std::string> known = NamesOf(domain_.predicates);
    known.insert(known.end(), kConnectives.begin(), kConnectives.end());
    known.push_back("=");
    diagnostics_.Add(
        expression.items.empty() ? expression.where : expression.items.front().where,
        head.empty() ? "a predicate or connective is missing" : "unknown predicate " + Quote(head),
        Suggest(head, known));
    return formula;
  }
  std::vector<Term> terms;
  if (!ParseArguments(expression, domain_.predicates[index], terms)) return formula;
  formula.kind = Formula::Kind::kAtom;
  formula.predicate = index;
  formula.terms = std::move(terms);
  return formula;
}

bool FormulaParser::ParseArguments(const Expression& expression, const Predicate& predicate,
                                   std::vector<Term>& terms) {
  const size_t given = expression.items.size() - 1;
  const bool right_count = given == predicate.parameters.size();
  if (!right_count) {
    diagnostics_.Add(expression.where,
                     Quote(predicate.name) + " has " + std::to_string(given) + " argument" +
                         (given == 1 ? "" : "s") + ", not " + std::to_string(predicate.parameters.size()),
                     "accepted: " + Signature(predicate, domain_));
  }
  bool good = right_count;
  for (size_t i = 0; i < given; ++i) {
    const Expression& item = expression.items[i + 1];
    Term term;
    if (!ParseTerm(item, term)) {
      good = false;
      continue;
    }
    if (right_count && !domain_.Fits(TypesOf(term), predicate.parameters[i].types)) {
      diagnostics_.Add(item.where,
                       Quote(item.word) + " is of type '" + domain_.TypeText(TypesOf(term)) +
                           "', but argument " + std::to_string(i + 1) + " of " + Quote(predicate.name) +
                           " must be '" + domain_.TypeText(predicate.parameters[i].types) + "'",
                       "accepted: " + Signature(predicate, domain_));
      good = false;
    }
    terms.push_back(term);
  }
  return good;
}

std::vector<TypedName> FormulaParser::ParseVariables(const Expression& expression) {
  if (!expression.is_list) {
    diagnostics_.Add(expression.where, Show(expression) + " is not a list of variables",
                     "accepted: (?a - type …)");
    return {};
  }
  return ParseTypedList(expression.items, 0, NameKind::kVariable, domain_, diagnostics_);
}

Formula FormulaParser::ParseFormula(const Expression& expression) {
  Formula formula;
  formula.where = expression.where;
  if (!expression.is_list) {
    diagnostics_.Add(expression.where, Quote(expression.word) + " is not a formula",
                     "a formula stands in parentheses");
    return formula;
  }
  if (expression.items.empty()) return formula;  // '()' is true, as in the oldest domains.
  const std::string head = LowerCase(expression.head());
  using Kind = Formula::Kind;
  if (head == "and" || head == "or") {
    formula.kind = head == "and" ? Kind::kAnd : Kind::kOr;
    for (size_t i = 1; i < expression.items.size(); ++i)
      formula.children.push_back(ParseFormula(expression.items[i]));
  } else if (head == "not") {
    if (!HasItems(expression, 2, "(not formula)")) return formula;
    formula.kind = Kind::kNot;
    formula.children.push_back(ParseFormula(expression.items[1]));
  } else if (head == "imply") {
    if (!HasItems(expression, 3, "(imply formula formula)")) return formula;
    formula.kind = Kind::kImply;
    for (size_t i = 1; i < 3; ++i) formula.children.push_back(ParseFormula(expression.items[i]));
  } else if (head == "forall" || head == "exists") {
    if (!HasItems(expression, 3, "(forall (?a - type …) formula) or (exists (?a - type …) formula)"))
      return formula;
    formula.kind = head == "forall" ? Kind::kForall : Kind::kExists;
    formula.variables = ParseVariables(expression.items[1]);
    Push(formula.variables);
    formula.children.push_back(ParseFormula(expression.items[2]));
    Pop(formula.variables.size());
  } else if (head == "=") {
    if (!HasItems(expression, 3, "(= term term)")) return formula;
    std::vector<Term> terms(2);
    for (size_t i = 0; i < 2; ++i) {
      if (!ParseTerm(expression.items[i + 1], terms[i])) return formula;
    }
    formula.kind = Kind::kEquals;
    formula.terms = std::move(terms);
  } else if (domain_.FindPredicate(head) < 0 && Contains(kNumeric, head)) {
    diagnostics_.Add(expression.where, Show(expression) + ": numeric fluents are not supported");
  } else if (domain_.FindPredicate(head) < 0 && Contains(kModal, head)) {
    diagnostics_.Add(expression.where,
                     Show(expression) + ": preferences and trajectory constraints are not supported");
  } else if (domain_.FindPredicate(head) < 0 && head == "when") {
    diagnostics_.Add(expression.where, "'(when …)' is an effect, not a formula",
                     "write (imply condition formula)");
  } else {
    return ParseAtom(expression);
  }
  return formula;
}

Effect FormulaParser::ParseEffect(const Expression& expression) {
  Effect effect;
  effect.where = expression.where;
  if (!expression.is_list) {
    diagnostics_.Add(expression.where, Quote(expression.word) + " is not an effect",
                     "an effect stands in parentheses");
    return effect;
  }
  if (expression.items.empty()) return effect;
  const std::string head = LowerCase(expression.head());
  using Kind = Effect::Kind;
  auto literal = [&](const Expression& atom, Kind kind) {
    const Formula parsed = ParseAtom(atom);
    if (parsed.kind != Formula::Kind::kAtom) return;
    if (domain_.IsDerived(parsed.predicate)) {
      diagnostics_.Add(atom.where, Show(atom) + ": an effect can't change a derived predicate");
      return;
    }
    effect.kind = kind;
    effect.predicate = parsed.predicate;
    effect.terms = parsed.terms;
  };
  if (head == "and") {
    for (size_t i = 1; i < expression.items.size(); ++i) {
      Effect child = ParseEffect(expression.items[i]);
      const bool is_cost = LowerCase(expression.items[i].head()) == "increase" && child.children.empty() &&
                           child.kind == Kind::kAnd;
      if (!is_cost) effect.children.push_back(std::move(child));
    }
  } else if (head == "not") {
    if (!HasItems(expression, 2, "(not (predicate …))")) return effect;
    const Expression& atom = expression.items[1];
    const std::string inner = LowerCase(atom.head());
    if (!atom.is_list || Contains(kConnectives, inner) || inner == "=" || inner == "when") {
      diagnostics_.Add(atom.where, "an effect can negate only a predicate, not " + Show(atom),
                       "accepted: (not (predicate …))");
      return effect;
    }
    literal(atom, Kind::kDelete);
  } else if (head == "forall") {
    if (!HasItems(expression, 3, "(forall (?a - type …) effect)")) return effect;
    effect.kind = Kind::kForall;
    effect.variables = ParseVariables(expression.items[1]);
    Push(effect.variables);
    ++nested_;
    effect.children.push_back(ParseEffect(expression.items[2]));
    --nested_;
    Pop(effect.variables.size());
  } else if (head == "when") {
    if (!HasItems(expression, 3, "(when condition effect)")) return effect;
    effect.kind = Kind::kWhen;
    effect.condition = ParseFormula(expression.items[1]);
    ++nested_;
    effect.children.push_back(ParseEffect(expression.items[2]));
    --nested_;
  } else if (head == "increase" && domain_.FindPredicate(head) < 0) {
    ParseIncrease(expression);
  } else if (domain_.FindPredicate(head) < 0 && Contains(kNumeric, head)) {
    diagnostics_.Add(expression.where, Show(expression) + ": numeric fluents are not supported, except costs",
                     "accepted: (increase (total-cost) …)");
  } else if (domain_.FindPredicate(head) < 0 && (Contains(kConnectives, head) || head == "=")) {
    diagnostics_.Add(expression.where, Show(expression) + " is not an effect",
                     "accepted: (predicate …), (not (predicate …)), (and …), (forall …) and (when …)");
  } else {
    literal(expression, Kind::kAdd);
  }
  return effect;
}

bool IsTotalCost(const Expression& expression) {
  return LowerCase(expression.head()) == "total-cost" && expression.items.size() == 1;
}

int64_t ParseNumber(const Expression& expression, const std::string& what, Diagnostics& diagnostics) {
  constexpr size_t kMostDigits = 9;  // Sums along a plan must not overflow.
  const std::string& word = expression.word;
  const size_t point = std::min(word.find('.'), word.size());
  const std::string whole = word.substr(0, point);
  std::string fraction = point < word.size() ? word.substr(point + 1) : "";
  while (!fraction.empty() && fraction.back() == '0') fraction.pop_back();
  const bool digits = (whole + fraction).find_first_not_of("0123456789") == std::string::npos;
  if (expression.is_list || !digits || whole.empty() || whole.size() > kMostDigits || fraction.size() > 6) {
    diagnostics.Add(expression.where, what + " is " + Show(expression),
                    "accepted: a number from 0 to 999999999, with up to six digits after the point");
    return 0;
  }
  fraction.resize(6, '0');
  return std::stoll(whole) * kMillion + std::stoll(fraction);
}

void FormulaParser::ParseIncrease(const Expression& expression) {
  if (!HasItems(expression, 3, "(increase (total-cost) cost)")) return;
  if (!IsTotalCost(expression.items[1])) {
    diagnostics_.Add(expression.items[1].where,
                     "'(increase " + Show(expression.items[1]).substr(1) +
                         ": numeric fluents are not supported, except costs",
                     "accepted: (increase (total-cost) …)");
  } else if (nested_ > 0 || cost_ == nullptr) {
    diagnostics_.Add(expression.where, "the cost of an action can't depend on the state or on other objects",
                     "accepted: '(increase (total-cost) …)' outside 'when' and 'forall'");
  } else {
    if (domain_.FindFunction("total-cost") < 0) {
      diagnostics_.Warn(expression.items[1].where, "':functions' does not declare 'total-cost'",
                        "(:functions (total-cost) - number)");
    }
    ParseCost(expression.items[2]);
  }
}

void FormulaParser::ParseCost(const Expression& expression) {
  CostTerm term;
  term.where = expression.where;
  if (!expression.is_list) {
    term.millionths = ParseNumber(expression, "the cost", diagnostics_);
    cost_->push_back(std::move(term));
    return;
  }
  const std::string_view head = expression.head();
  if (head == "+") {
    for (size_t i = 1; i < expression.items.size(); ++i) ParseCost(expression.items[i]);
    return;
  }
  const int index = domain_.FindFunction(head);
  if (index < 0 || IsTotalCost(expression)) {
    diagnostics_.Add(
        expression.where, Show(expression) + " is not a cost",
        "accepted: a number, (+ …), or a function: " + Suggest(head, NamesOf(domain_.functions)));
    return;
  }
  const Function& function = domain_.functions[index];
  if (!ParseArguments(expression, {function.name, function.parameters, function.where}, term.terms)) return;
  term.function = index;
  cost_->push_back(std::move(term));
}

}  // namespace tether::symbolic
