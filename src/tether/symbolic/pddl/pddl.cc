#include "tether/symbolic/pddl/pddl.h"

#include <algorithm>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include "tether/common/document/value.h"
#include "tether/common/file.h"
#include "tether/common/log.h"
#include "tether/symbolic/pddl/expression.h"
#include "tether/symbolic/pddl/formula_parser.h"
#include "tether/symbolic/pddl/pddl_sections.h"

namespace tether::symbolic {
namespace {

const std::vector<std::string> kRequirements = {":strips",
                                                ":typing",
                                                ":equality",
                                                ":negative-preconditions",
                                                ":disjunctive-preconditions",
                                                ":existential-preconditions",
                                                ":universal-preconditions",
                                                ":quantified-preconditions",
                                                ":conditional-effects",
                                                ":adl",
                                                ":action-costs",
                                                ":derived-predicates"};
const std::vector<std::string> kUnsupportedRequirements = {":fluents",
                                                           ":numeric-fluents",
                                                           ":object-fluents",
                                                           ":durative-actions",
                                                           ":duration-inequalities",
                                                           ":continuous-effects",
                                                           ":timed-initial-literals",
                                                           ":preferences",
                                                           ":constraints"};

std::string Quote(std::string_view text) { return "'" + std::string(text) + "'"; }

/// Reads "(define (kind name) section…)" and returns the sections; reports anything else.
std::vector<const Expression*> OpenDefinition(const std::vector<Expression>& text, const std::string& kind,
                                              const std::string& file, std::string& name,
                                              Diagnostics& diagnostics) {
  std::vector<const Expression*> sections;
  const std::string form = "accepted: (define (" + kind + " name) …)";
  if (text.empty()) {
    if (diagnostics.empty()) diagnostics.Add({file, 1, 1}, "there is no " + kind + " in this file", form);
    return sections;
  }
  const Expression& define = text.front();
  if (LowerCase(define.head()) != "define") {
    diagnostics.Add(define.where,
                    define.is_list ? "the file begins with '(" + std::string(define.head()) + "'"
                                   : "the file begins with " + Quote(define.word),
                    form);
    return sections;
  }
  for (size_t i = 1; i < text.size(); ++i) {
    diagnostics.Add(text[i].where, "text after the end of '(define …)'");
  }
  if (define.items.size() < 2 || LowerCase(define.items[1].head()) != kind ||
      define.items[1].items.size() != 2 || define.items[1].items[1].is_list ||
      !IsName(define.items[1].items[1].word)) {
    const bool other = define.items.size() > 1 && !define.items[1].head().empty() &&
                       LowerCase(define.items[1].head()) != kind;
    diagnostics.Add(define.items.size() > 1 ? define.items[1].where : define.where,
                    other ? "this defines a " + Quote(define.items[1].head()) + ", not a " + kind
                          : "the name of the " + kind + " is missing",
                    form);
    if (other) return sections;
  } else {
    name = define.items[1].items[1].word;
  }
  for (size_t i = 2; i < define.items.size(); ++i) {
    if (define.items[i].head().empty()) {
      diagnostics.Add(define.items[i].where, "a section is missing its keyword", "accepted: (:keyword …)");
    } else {
      sections.push_back(&define.items[i]);
    }
  }
  return sections;
}

/// Sorts sections by keyword; reports unknown and repeated ones.
std::map<std::string, std::vector<const Expression*>> SortSections(
    const std::vector<const Expression*>& sections, const std::vector<std::string>& known,
    const std::map<std::string, std::string>& unsupported, Diagnostics& diagnostics) {
  std::map<std::string, std::vector<const Expression*>> sorted;
  for (const Expression* section : sections) {
    const std::string keyword = LowerCase(section->head());
    if (const auto reason = unsupported.find(keyword); reason != unsupported.end()) {
      diagnostics.Add(section->where, Quote(section->head()) + ": " + reason->second + " not supported");
    } else if (std::find(known.begin(), known.end(), keyword) == known.end()) {
      diagnostics.Add(section->where, "unknown section " + Quote(section->head()), Suggest(keyword, known));
    } else {
      std::vector<const Expression*>& same = sorted[keyword];
      if (!same.empty() && keyword != ":action" && keyword != ":derived") {
        diagnostics.Add(section->where, Quote(section->head()) + " is given twice; first at " +
                                            same.front()->where.ToString());
      } else {
        same.push_back(section);
      }
    }
  }
  return sorted;
}

void CheckRequirements(const Expression& section, std::vector<std::string>& requirements,
                       Diagnostics& diagnostics) {
  for (size_t i = 1; i < section.items.size(); ++i) {
    const Expression& item = section.items[i];
    const std::string word = LowerCase(item.word);
    auto is_in = [&](const std::vector<std::string>& list) {
      return std::find(list.begin(), list.end(), word) != list.end();
    };
    if (is_in(kRequirements)) {
      requirements.push_back(word);
      continue;
    }
    const std::string shown = item.is_list ? "(" + std::string(item.head()) + " …)" : item.word;
    // Unsupported requirements are reported where they are used.
    const bool known = is_in(kUnsupportedRequirements);
    diagnostics.Warn(item.where,
                     "requirement " + Quote(shown) + (known ? " is not supported" : " is unknown"),
                     known ? "" : Suggest(word, kRequirements));
  }
}

/// Reports names that stand in the list twice, and drops the later ones.
template <typename Named>
void DropTwins(std::vector<Named>& list, const std::string& what, Diagnostics& diagnostics) {
  std::map<std::string, Location> seen;
  std::vector<Named> kept;
  for (Named& item : list) {
    const auto [first, is_new] = seen.emplace(LowerCase(item.name), item.where);
    if (is_new) {
      kept.push_back(std::move(item));
    } else {
      diagnostics.Add(item.where, what + " " + Quote(item.name) + " is declared twice; first at " +
                                      first->second.ToString());
    }
  }
  list = std::move(kept);
}

/// The same for constants and objects, which may be declared twice if one of the types is below the other:
/// that one counts.
void DropTwinObjects(std::vector<TypedName>& list, const std::string& what, const Domain& domain,
                     Diagnostics& diagnostics) {
  std::map<std::string, size_t> seen;
  std::vector<TypedName> kept;
  for (TypedName& item : list) {
    const auto [first, is_new] = seen.emplace(LowerCase(item.name), kept.size());
    if (is_new) {
      kept.push_back(std::move(item));
      continue;
    }
    TypedName& other = kept[first->second];
    const std::string message =
        what + " " + Quote(item.name) + " is declared twice; first at " + other.where.ToString();
    if (domain.Fits(other.types, item.types)) {
      diagnostics.Warn(item.where, message);
    } else if (domain.Fits(item.types, other.types)) {
      diagnostics.Warn(item.where, message);
      other.types = item.types;
    } else {
      diagnostics.Add(item.where, message + ", with type " + Quote(domain.TypeText(other.types)));
    }
  }
  list = std::move(kept);
}

void ParsePredicates(const Expression& section, Domain& domain, Diagnostics& diagnostics) {
  for (size_t i = 1; i < section.items.size(); ++i) {
    const Expression& item = section.items[i];
    if (item.head().empty() || !IsName(item.head())) {
      diagnostics.Add(item.where,
                      (item.is_list ? Quote("(" + std::string(item.head()) + " …)") : Quote(item.word)) +
                          " is not a predicate",
                      "accepted: (name ?a - type …)");
      continue;
    }
    static const std::set<std::string> kReserved = {"and",    "or",     "not",  "imply",
                                                    "forall", "exists", "when", "either"};
    if (kReserved.count(LowerCase(item.head()))) {
      diagnostics.Add(item.items[0].where, "a predicate can't be called " + Quote(item.head()));
      continue;
    }
    domain.predicates.push_back({item.items[0].word,
                                 ParseTypedList(item.items, 1, NameKind::kDeclared, domain, diagnostics),
                                 item.items[0].where});
  }
  DropTwins(domain.predicates, "predicate", diagnostics);
}

void ParseAction(const Expression& section, Domain& domain, Diagnostics& diagnostics) {
  if (section.items.size() < 2 || section.items[1].is_list || !IsName(section.items[1].word)) {
    diagnostics.Add(section.where, "the name of the action is missing", "accepted: (:action name …)");
    return;
  }
  Action action;
  action.name = section.items[1].word;
  action.where = section.items[1].where;
  std::map<std::string, const Expression*> parts;
  static const std::vector<std::string> kParts = {":parameters", ":precondition", ":effect"};
  for (size_t i = 2; i < section.items.size(); i += 2) {
    const Expression& key = section.items[i];
    const std::string word = LowerCase(key.word);
    if (std::find(kParts.begin(), kParts.end(), word) == kParts.end()) {
      diagnostics.Add(key.where,
                      (key.is_list ? "a keyword is missing before '(" + std::string(key.head()) + "'"
                                   : "unknown keyword " + Quote(key.word)) +
                          " in action " + Quote(action.name),
                      Suggest(word, kParts));
      if (key.is_list) --i;
      continue;
    }
    if (i + 1 >= section.items.size()) {
      diagnostics.Add(key.where, "nothing follows " + Quote(key.word) + " of action " + Quote(action.name));
      break;
    }
    if (!parts.emplace(word, &section.items[i + 1]).second) {
      diagnostics.Add(key.where, Quote(key.word) + " of action " + Quote(action.name) + " is given twice");
    }
  }
  if (const auto it = parts.find(":parameters"); it != parts.end()) {
    if (it->second->is_list) {
      action.parameters = ParseTypedList(it->second->items, 0, NameKind::kVariable, domain, diagnostics);
    } else {
      diagnostics.Add(it->second->where, Quote(it->second->word) + " is not a list of parameters",
                      "accepted: (?a - type …)");
    }
  }
  FormulaParser parser(domain, domain.constants, action.parameters, diagnostics);
  parser.CollectCost(&action.cost);
  action.precondition.where = action.where;
  if (const auto it = parts.find(":precondition"); it != parts.end()) {
    action.precondition = parser.ParseFormula(*it->second);
  }
  if (const auto it = parts.find(":effect"); it != parts.end())
    action.effect = parser.ParseEffect(*it->second);
  domain.actions.push_back(std::move(action));
}

std::shared_ptr<Domain> ParseDomain(std::string_view text, const std::string& file,
                                    Diagnostics& diagnostics) {
  auto domain = std::make_shared<Domain>();
  domain->file = file;
  domain->types.push_back({"object", -1, {}});
  const std::vector<Expression> expressions = ParseExpressions(text, file, diagnostics);
  auto sections = SortSections(
      OpenDefinition(expressions, "domain", file, domain->name, diagnostics),
      {":requirements", ":types", ":constants", ":predicates", ":functions", ":derived", ":action"},
      {{":durative-action", "durative actions are"}, {":constraints", "trajectory constraints are"}},
      diagnostics);
  for (const Expression* s : sections[":requirements"])
    CheckRequirements(*s, domain->requirements, diagnostics);
  for (const Expression* s : sections[":types"]) ParseTypes(*s, *domain, diagnostics);
  for (const Expression* s : sections[":constants"]) {
    domain->constants = ParseTypedList(s->items, 1, NameKind::kObject, *domain, diagnostics);
    DropTwinObjects(domain->constants, "constant", *domain, diagnostics);
  }
  for (const Expression* s : sections[":predicates"]) ParsePredicates(*s, *domain, diagnostics);
  for (const Expression* s : sections[":functions"]) ParseFunctions(*s, *domain, diagnostics);
  DropTwins(domain->functions, "function", diagnostics);
  domain->strata.assign(domain->predicates.size(), 0);
  for (const Expression* s : sections[":derived"]) ParseDerived(*s, *domain, diagnostics);
  Stratify(*domain, diagnostics);
  for (const Expression* s : sections[":action"]) ParseAction(*s, *domain, diagnostics);
  DropTwins(domain->actions, "action", diagnostics);
  return domain;
}

void ParseInit(const Expression& section, const Domain& domain, Problem& problem, Diagnostics& diagnostics) {
  FormulaParser parser(domain, problem.objects, {}, diagnostics);
  for (size_t i = 1; i < section.items.size(); ++i) {
    const Expression& item = section.items[i];
    const std::string head = LowerCase(item.head());
    if (head == "=") {
      ParseValue(item, problem, domain, diagnostics);
      continue;
    }
    if (head == "at" && item.items.size() == 3 && !item.items[1].is_list &&
        item.items[1].word.find_first_not_of("0123456789.") == std::string::npos) {
      diagnostics.Add(item.where, "timed initial literals are not supported");
      continue;
    }
    const bool negated = head == "not" && item.items.size() == 2;
    const Formula formula = parser.ParseFormula(negated ? item.items[1] : item);
    if (formula.kind == Formula::Kind::kAtom) {
      if (domain.IsDerived(formula.predicate)) {
        diagnostics.Add(item.where, "':init' can't give " + Quote(domain.predicates[formula.predicate].name) +
                                        ", which is derived");
        continue;
      }
      if (negated) continue;  // Facts that are not listed are false.
      Fact fact{formula.predicate, {}, item.where};
      for (const Term& term : formula.terms) fact.arguments.push_back(term.index);
      problem.init.push_back(std::move(fact));
    } else if (formula.kind != Formula::Kind::kAnd || head == "and" || (item.is_list && item.items.empty())) {
      diagnostics.Add(item.where, "':init' holds facts, not formulas", "accepted: (predicate object …)");
    }
  }
}

void ParseProblem(std::string_view text, const std::string& file, const Domain& domain, Problem& problem,
                  Diagnostics& diagnostics) {
  problem.file = file;
  const std::vector<Expression> expressions = ParseExpressions(text, file, diagnostics);
  const size_t mistakes = diagnostics.list().size();
  auto sections =
      SortSections(OpenDefinition(expressions, "problem", file, problem.name, diagnostics),
                   {":domain", ":requirements", ":objects", ":init", ":goal", ":metric", ":length"},
                   {{":constraints", "trajectory constraints are"}}, diagnostics);
  for (const Expression* s : sections[":domain"]) {
    if (s->items.size() != 2 || s->items[1].is_list) {
      diagnostics.Add(s->where, "the name of the domain is missing",
                      "accepted: (:domain " + domain.name + ")");
    } else if (!domain.name.empty() && LowerCase(s->items[1].word) != LowerCase(domain.name)) {
      diagnostics.Add(s->items[1].where, "the problem is for domain " + Quote(s->items[1].word) + ", but " +
                                             domain.file + " defines " + Quote(domain.name));
    }
  }
  std::vector<std::string> requirements;
  for (const Expression* s : sections[":requirements"]) CheckRequirements(*s, requirements, diagnostics);
  problem.objects = domain.constants;
  for (const Expression* s : sections[":objects"]) {
    for (TypedName& object : ParseTypedList(s->items, 1, NameKind::kObject, domain, diagnostics)) {
      problem.objects.push_back(std::move(object));
    }
    DropTwinObjects(problem.objects, "object", domain, diagnostics);
  }
  for (const Expression* s : sections[":init"]) ParseInit(*s, domain, problem, diagnostics);
  for (const Expression* s : sections[":goal"]) {
    if (s->items.size() != 2) {
      diagnostics.Add(s->where, "':goal' holds " + std::to_string(s->items.size() - 1) + " formulas, not 1",
                      "accepted: (:goal formula)");
      continue;
    }
    problem.goal = FormulaParser(domain, problem.objects, {}, diagnostics).ParseFormula(s->items[1]);
  }
  for (const Expression* s : sections[":metric"]) ParseMetric(*s, problem, domain, diagnostics);
  if (!expressions.empty() && diagnostics.list().size() == mistakes) {
    for (const char* keyword : {":domain", ":goal"}) {
      if (sections[keyword].empty()) {
        diagnostics.Add(expressions.front().where, std::string("the problem has no '(") + keyword + " …)'");
      }
    }
  }
}

}  // namespace

int Domain::FindType(std::string_view type) const { return FindNamed(types, type); }
int Domain::FindPredicate(std::string_view predicate) const { return FindNamed(predicates, predicate); }
int Domain::FindFunction(std::string_view function) const { return FindNamed(functions, function); }
int Domain::FindAction(std::string_view action) const { return FindNamed(actions, action); }
int Problem::FindObject(std::string_view object) const { return FindNamed(objects, object); }

bool Domain::IsSubtype(int type, int ancestor) const {
  for (; type >= 0; type = types[type].parent) {
    if (type == ancestor) return true;
  }
  return false;
}

bool Domain::Fits(const std::vector<int>& own, const std::vector<int>& accepted) const {
  if (accepted.empty()) return true;  // Of an unknown type.
  return std::all_of(own.begin(), own.end(), [&](int type) {
    return std::any_of(accepted.begin(), accepted.end(), [&](int above) { return IsSubtype(type, above); });
  });
}

std::string Domain::TypeText(const std::vector<int>& list) const {
  if (list.size() == 1) return types[list[0]].name;
  std::string text = "(either";
  for (int type : list) text += " " + types[type].name;
  return text + ")";
}

std::shared_ptr<const Domain> ParseDomain(std::string_view text, const std::string& file) {
  Diagnostics diagnostics;
  const std::shared_ptr<Domain> domain = ParseDomain(text, file, diagnostics);
  diagnostics.ThrowIfAny();
  domain->warnings = diagnostics.warnings();
  return domain;
}

std::shared_ptr<const Problem> ParseProblem(std::string_view text, const std::string& file,
                                            std::shared_ptr<const Domain> domain) {
  Diagnostics diagnostics;
  auto problem = std::make_shared<Problem>();
  ParseProblem(text, file, *domain, *problem, diagnostics);
  diagnostics.ThrowIfAny();
  problem->domain = std::move(domain);
  problem->warnings = diagnostics.warnings();
  return problem;
}

std::shared_ptr<const Problem> ReadProblem(const std::string& domain_file, const std::string& problem_file) {
  Diagnostics diagnostics;
  std::optional<std::string> texts[2];
  const std::string* files[2] = {&domain_file, &problem_file};
  for (int i = 0; i < 2; ++i) {
    try {
      texts[i] = ReadFile(*files[i]);
    } catch (const InputError& error) {
      diagnostics.Add(error);
    }
  }
  std::shared_ptr<const Domain> domain;
  if (texts[0]) domain = ParseDomain(*texts[0], domain_file, diagnostics);
  auto problem = std::make_shared<Problem>();
  if (texts[1]) {
    if (diagnostics.empty()) {
      ParseProblem(*texts[1], problem_file, *domain, *problem, diagnostics);
    } else {
      ParseExpressions(*texts[1], problem_file,
                       diagnostics);  // Its names can't be judged without the domain.
    }
  }
  diagnostics.ThrowIfAny();
  problem->domain = std::move(domain);
  problem->warnings = diagnostics.warnings();
  for (const Diagnostic& warning : problem->warnings) LogWarning(warning.ToString());
  return problem;
}

std::shared_ptr<const Problem> WithGoal(const Problem& problem, std::string_view goal,
                                        const Location& where) {
  Diagnostics found;
  const std::vector<Expression> expressions = ParseExpressions(goal, where.file, found);
  auto changed = std::make_shared<Problem>(problem);
  if (expressions.size() == 1) {
    changed->goal =
        FormulaParser(*problem.domain, problem.objects, {}, found).ParseFormula(expressions.front());
  } else if (found.empty()) {
    found.Add(expressions.empty() ? Location{where.file, 1, 1} : expressions[1].where,
              expressions.empty() ? "the goal is empty" : "text after the end of the goal",
              "accepted: one formula");
  }
  Diagnostics moved;
  for (const Diagnostic& diagnostic : found.list()) {
    Location place = diagnostic.where;
    if (where.line > 0) {
      if (place.line == 1 && where.column > 0) place.column += where.column - 1;
      place.line += where.line - 1;
    }
    moved.Add(place, diagnostic.message, diagnostic.accepted);
  }
  moved.ThrowIfAny();
  return changed;
}

}  // namespace tether::symbolic
