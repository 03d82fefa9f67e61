#include "tether/task/symmetry/symmetry.h"

#include <algorithm>
#include <map>
#include <numeric>
#include <optional>
#include <utility>

namespace tether::task {
namespace {

using symbolic::Atom;
using symbolic::GroundFormula;

// The limit on the search for exchanges, in formulas and atoms visited: some 0.5 s.
constexpr size_t kMostWork = 15'000'000;

/// A formula as numbers, the same for all orders of its operands.
using Code = std::vector<int>;

/// Whether exchanging two objects maps a product onto itself.
class ExchangeTest {
 public:
  explicit ExchangeTest(const Product& product) : product_(product), task_(product.task()) {
    const IndexedVector<ActionId, symbolic::GroundAction>& actions = task_.actions();
    actions_of_.resize(task_.problem().objects.size());
    atoms_of_.resize(actions_of_.size());
    for (size_t i = 0; i < task_.atoms().size(); ++i)
      Note(task_.atoms()[i].arguments, static_cast<int>(i), atoms_of_);
    for (const ActionId index : actions.ids()) {
      const symbolic::GroundAction& action = actions[index];
      index_.emplace(std::make_pair(action.schema, action.arguments), index);
      Note(action.arguments, index, actions_of_);
      NoteAtoms(action.precondition.formula(), index);
      for (const symbolic::GroundEffect& effect : action.effects) {
        NoteAtoms(effect.condition.formula(), index);
        for (int atom : effect.deletes) NoteAtom(atom, index);
        for (int atom : effect.adds) NoteAtom(atom, index);
      }
      codes_.push_back(CodeOfAction(index));
    }
    work_ = 0;
  }

  bool Holds(int a, int b) {
    a_ = a;
    b_ = b;
    const auto &first = atoms_of_[a], &second = atoms_of_[b];
    if (first.size() != second.size() ||
        task_.problem().objects[ToIndex(a)].types != task_.problem().objects[ToIndex(b)].types)
      return false;
    image_.resize(task_.atoms().size());
    std::iota(image_.begin(), image_.end(), 0);
    for (const auto* atoms : {&first, &second}) {
      for (int atom : *atoms) {
        const int image = task_.FindAtom(Exchange(task_.atoms()[ToIndex(atom)]));
        if (image < 0) return false;
        image_[atom] = image;
      }
    }
    const bool same = GoalStays() && ActionsStay() && AxiomsStay();
    image_.clear();
    return same;
  }

  size_t work() const { return work_; }

 private:
  template <typename Item>
  static void Note(const std::vector<int>& arguments, Item item,
                   IndexedVector<int, std::vector<Item>>& lists) {
    for (int object : arguments) {
      std::vector<Item>& list = lists[object];
      if (list.empty() || list.back() != item) list.push_back(item);
    }
  }

  void NoteAtom(int atom, ActionId action) {
    Note(task_.atoms()[ToIndex(atom)].arguments, action, actions_of_);
  }
  void NoteAtoms(const GroundFormula& formula, ActionId action) {
    if (formula.kind == GroundFormula::Kind::kLiteral) NoteAtom(formula.atom, action);
    for (const GroundFormula& child : formula.children) NoteAtoms(child, action);
  }

  int Exchange(int object) const { return object == a_ ? b_ : object == b_ ? a_ : object; }
  std::vector<int> Exchange(std::vector<int> objects) const {
    for (int& object : objects) object = Exchange(object);
    return objects;
  }
  Atom Exchange(const Atom& atom) const { return {atom.predicate, Exchange(atom.arguments)}; }

  /// The atom's image under the exchange; itself outside of Holds().
  int Image(int atom) const { return image_.empty() ? atom : image_[atom]; }

  void Append(const GroundFormula& formula, Code& code) {
    ++work_;
    code.push_back(static_cast<int>(formula.kind));
    if (formula.kind == GroundFormula::Kind::kLiteral) {
      code.push_back(2 * Image(formula.atom) + (formula.positive ? 1 : 0));
      return;
    }
    std::vector<Code> children;
    for (const GroundFormula& child : formula.children) {
      children.emplace_back();
      Append(child, children.back());
    }
    AppendSorted(std::move(children), code);
  }

  static void AppendSorted(std::vector<Code> parts, Code& code) {
    std::sort(parts.begin(), parts.end());
    code.push_back(static_cast<int>(parts.size()));
    for (const Code& part : parts) code.insert(code.end(), part.begin(), part.end());
  }

  Code SortedImages(std::vector<int> atoms) {
    work_ += atoms.size();
    for (int& atom : atoms) atom = Image(atom);
    std::sort(atoms.begin(), atoms.end());
    return atoms;
  }

  Code CodeOfAction(ActionId index) {
    const symbolic::GroundAction& action = task_.actions()[index];
    Code code = {static_cast<int>(action.cost), static_cast<int>(action.cost >> 32),
                 product_.IsForbidden(index) ? 1 : 0};
    Append(action.precondition.formula(), code);
    std::vector<Code> effects;
    for (const symbolic::GroundEffect& effect : action.effects) {
      Code& one = effects.emplace_back();
      Append(effect.condition.formula(), one);
      for (const std::vector<int>* atoms : {&effect.deletes, &effect.adds}) {
        const Code images = SortedImages(*atoms);
        one.push_back(static_cast<int>(images.size()));
        one.insert(one.end(), images.begin(), images.end());
      }
    }
    AppendSorted(std::move(effects), code);
    return code;
  }

  /// Actions and atoms about neither object are mapped to themselves.
  bool ActionsStay() {
    for (const auto* list : {&actions_of_[a_], &actions_of_[b_]}) {
      for (const ActionId index : *list) {
        const symbolic::GroundAction& action = task_.actions()[index];
        const auto image = index_.find({action.schema, Exchange(action.arguments)});
        if (image == index_.end() || CodeOfAction(index) != codes_[image->second]) return false;
      }
    }
    return true;
  }

  /// Axioms of one stratum in any order.
  bool AxiomsStay() {
    const auto code_of = [&](const std::vector<symbolic::GroundAxiom>& stratum, bool exchanged) {
      IndexedVector<int, int> identity;
      if (!exchanged) std::swap(identity, image_);
      std::vector<Code> all;
      for (const symbolic::GroundAxiom& axiom : stratum) {
        Code& one = all.emplace_back(Code{Image(axiom.atom)});
        Append(axiom.body.formula(), one);
      }
      if (!exchanged) std::swap(identity, image_);
      std::sort(all.begin(), all.end());
      return all;
    };
    return std::all_of(task_.axioms().begin(), task_.axioms().end(), [&](const auto& stratum) {
      return code_of(stratum, true) == code_of(stratum, false);
    });
  }

  bool GoalStays() {
    // Letters that were read tell objects apart.
    if (product_.goal() != nullptr) return product_.goal()->read.empty() && FormulaStays();
    Code before, after;
    Append(task_.goal().formula(), after);
    IndexedVector<int, int> identity;
    std::swap(identity, image_);
    Append(task_.goal().formula(), before);
    std::swap(identity, image_);
    return before == after;
  }

  /// Every largest subformula without temporal operators is mapped to itself.
  bool FormulaStays() {
    const ltl::Formula& formula = product_.goal()->formula;
    IndexedVector<int, bool> is_boolean(formula.nodes().size(), false);
    IndexedVector<int, std::optional<Code>> before(formula.nodes().size()), after(formula.nodes().size());
    bool stays = true;
    for (const int i : is_boolean.ids()) {
      const ltl::Formula::Node& node = formula.nodes()[ToIndex(i)];
      const bool connective = node.op <= ltl::Operator::kNot || node.op >= ltl::Operator::kAnd;
      is_boolean[i] = connective && std::all_of(node.operands.begin(), node.operands.end(),
                                                [&](int k) { return is_boolean[k]; });
      if (is_boolean[i]) {
        before[i] = CodeOfNode(node, before, false);
        after[i] = CodeOfNode(node, after, true);
        continue;
      }
      for (int k : node.operands) {
        stays = stays && (!is_boolean[k] || before[k] == after[k]);
      }
    }
    return stays && (!is_boolean.back() || before.back() == after.back());
  }

  Code CodeOfNode(const ltl::Formula::Node& node, const IndexedVector<int, std::optional<Code>>& codes,
                  bool exchanged) {
    ++work_;
    Code code = {static_cast<int>(node.op)};
    if (node.op == ltl::Operator::kAtom) {
      const int atom = product_.propositions()[ToIndex(node.atom)];
      code.push_back(atom >= 0 && exchanged ? Image(atom) : atom);
      return code;
    }
    std::vector<Code> operands;
    for (int k : node.operands) operands.push_back(*codes[k]);
    if (node.op == ltl::Operator::kImplies) {
      for (const Code& operand : operands) code.insert(code.end(), operand.begin(), operand.end());
    } else {
      AppendSorted(std::move(operands), code);
    }
    return code;
  }

  const Product& product_;
  const symbolic::Task& task_;
  std::map<std::pair<int, std::vector<int>>, ActionId> index_;  ///< Of actions, by schema and arguments.
  IndexedVector<int, std::vector<ActionId>> actions_of_;        ///< By object that they are about.
  IndexedVector<int, std::vector<int>> atoms_of_;               ///< By object that they are about.
  IndexedVector<ActionId, Code> codes_;                         ///< Of the actions as they are.
  IndexedVector<int, int> image_;                               ///< Of the atoms; empty: themselves.
  int a_ = -1, b_ = -1;
  size_t work_ = 0;
};

/// Objects that can be exchanged, in classes of two or more. Being exchangeable is an equivalence: an
/// exchange of a and c is those of a and b, b and c, a and b after one another.
std::vector<std::vector<int>> FindClasses(const Product& product) {
  std::vector<std::vector<int>> classes;
  ExchangeTest test(product);
  const int objects = static_cast<int>(product.task().problem().objects.size());
  IndexedVector<int, bool> placed(ToIndex(objects), false);
  for (int a = 0; a < objects; ++a) {
    if (placed[a]) continue;
    std::vector<int> members = {a};
    for (int b = a + 1; b < objects; ++b) {
      if (placed[b] || !test.Holds(a, b)) continue;
      placed[b] = true;
      members.push_back(b);
      if (test.work() > kMostWork) break;
    }
    if (members.size() > 1) classes.push_back(std::move(members));
    if (test.work() > kMostWork) break;
  }
  return classes;
}

}  // namespace

symbolic::State ExchangeObjects(const symbolic::Task& task, symbolic::StateView state, int a, int b) {
  symbolic::State image(state.size(), 0);
  std::copy(state.begin() + static_cast<std::ptrdiff_t>(task.words()), state.end(),
            image.begin() + static_cast<std::ptrdiff_t>(task.words()));
  for (size_t i = 0; i < task.atoms().size(); ++i) {
    if ((state[i / 64] >> (i % 64) & 1) == 0) continue;
    Atom atom = task.atoms()[i];
    for (int& object : atom.arguments) object = object == a ? b : object == b ? a : object;
    const size_t at = ToIndex(task.FindAtom(atom));
    image[at / 64] |= uint64_t{1} << (at % 64);
  }
  return image;
}

Symmetry::Symmetry(const Product& product) {
  const symbolic::Task& task = product.task();
  atoms_ = task.atoms().size();
  std::vector<std::vector<int>> found = FindClasses(product);
  // The largest first: they save most.
  std::stable_sort(found.begin(), found.end(),
                   [](const auto& a, const auto& b) { return a.size() > b.size(); });
  IndexedVector<int, int> home(task.problem().objects.size(), -1);  // the class of an object, if it is used
  for (const std::vector<int>& members : found) {
    IndexedVector<int, int> with = home;
    for (int object : members) with[object] = static_cast<int>(classes_.size());
    const bool one_each = std::all_of(task.atoms().begin(), task.atoms().end(), [&](const Atom& atom) {
      return std::count_if(atom.arguments.begin(), atom.arguments.end(),
                           [&](int object) { return with[object] >= 0; }) <= 1;
    });
    if (!one_each) continue;
    home = std::move(with);
    Class own;
    own.objects = members;
    for (size_t i = 0; i < task.atoms().size(); ++i) {
      const std::vector<int>& arguments = task.atoms()[i].arguments;
      if (std::find(arguments.begin(), arguments.end(), members.front()) == arguments.end()) continue;
      ++own.patterns;
      for (int object : members) {
        Atom atom = task.atoms()[i];
        std::replace(atom.arguments.begin(), atom.arguments.end(), members.front(), object);
        own.atoms.push_back(task.FindAtom(atom));
      }
    }
    if (own.patterns == 0) continue;
    MapActions(task, own);
    classes_.push_back(std::move(own));
  }
}

void Symmetry::MapActions(const symbolic::Task& task, Class& one) {
  std::map<std::pair<int, std::vector<int>>, ActionId> index;
  for (const ActionId i : task.actions().ids())
    index.emplace(std::make_pair(task.actions()[i].schema, task.actions()[i].arguments), i);
  const size_t count = one.objects.size();
  one.member_of_action.assign(task.actions().size(), -1);
  one.images.resize(task.actions().size());
  for (const ActionId i : task.actions().ids()) {
    const symbolic::GroundAction& action = task.actions()[i];
    for (int object : action.arguments) {
      const auto at = std::find(one.objects.begin(), one.objects.end(), object);
      if (at == one.objects.end()) continue;
      int& member = one.member_of_action[i];
      const int own = static_cast<int>(at - one.objects.begin());
      if (member >= 0 && member != own) maps_actions_ = false;
      member = own;
    }
    if (one.member_of_action[i] < 0) continue;
    for (size_t k = 0; k < count; ++k) {
      std::vector<int> arguments = action.arguments;
      std::replace(arguments.begin(), arguments.end(), one.objects[ToIndex(one.member_of_action[i])],
                   one.objects[k]);
      const auto image = index.find({action.schema, arguments});
      if (image == index.end()) maps_actions_ = false;
      one.images[i].push_back(image == index.end() ? ActionId() : image->second);
    }
  }
}

ActionId Symmetry::Image(ActionId action) const {
  for (const Class& one : classes_) {
    const int member = one.member_of_action[action];
    if (member < 0 || one.place.empty()) continue;
    action = one.images[action][one.place[member]];
  }
  return action;
}

std::vector<std::vector<int>> Symmetry::Classes() const {
  std::vector<std::vector<int>> classes;
  for (const Class& one : classes_) classes.push_back(one.objects);
  return classes;
}

std::vector<symbolic::AtomPermutation> Symmetry::Exchanges() const {
  std::vector<symbolic::AtomPermutation> exchanges;
  for (const Class& one : classes_) {
    const size_t count = one.objects.size();
    for (const size_t moved : {size_t{2}, count}) {
      symbolic::AtomPermutation& exchange = exchanges.emplace_back(atoms_);
      std::iota(exchange.begin(), exchange.end(), 0);
      for (size_t k = 0; k < one.patterns; ++k) {
        const int* own = one.atoms.data() + k * count;
        for (size_t i = 0; i < moved; ++i) exchange[ToIndex(own[i])] = own[(i + 1) % moved];
      }
      if (count == 2) break;
    }
  }
  return exchanges;
}

/// The atoms that hold of each object of the class, as words of bits.
void Symmetry::ReadBits(const Class& one, symbolic::StateView state) {
  const size_t count = one.objects.size(), words = (one.patterns + 63) / 64;
  bits_.assign(count * words, 0);
  const int* atom = one.atoms.data();
  for (size_t k = 0; k < one.patterns; ++k) {
    for (size_t i = 0; i < count; ++i, ++atom) {
      const uint64_t bit = state[ToIndex(*atom) / 64] >> (*atom % 64) & 1;
      bits_[i * words + k / 64] |= bit << (k % 64);
    }
  }
}

double Symmetry::OrbitSize(symbolic::StateView state) {
  double size = 1;
  for (const Class& one : classes_) {
    ReadBits(one, state);
    const size_t count = one.objects.size(), words = (one.patterns + 63) / 64;
    std::map<std::vector<uint64_t>, int> alike;
    for (size_t i = 0; i < count; ++i) {
      const uint64_t* own = bits_.data() + i * words;
      // The i-th has i + 1 places to go, of which those among its equals make no difference.
      size *= static_cast<double>(i + 1) / ++alike[{own, own + words}];
    }
  }
  return size;
}

bool Symmetry::Canonicalize(std::span<uint64_t> state) {
  bool changed = false;
  for (Class& one : classes_) {
    const size_t count = one.objects.size(), words = (one.patterns + 63) / 64;
    one.place.clear();
    ReadBits(one, state);
    const auto less = [&](int a, int b) {
      const uint64_t* first = bits_.data() + ToIndex(a) * words;
      const uint64_t* second = bits_.data() + ToIndex(b) * words;
      return std::lexicographical_compare(first, first + words, second, second + words);
    };
    order_.resize(count);
    std::iota(order_.begin(), order_.end(), 0);
    if (std::is_sorted(order_.begin(), order_.end(), less)) continue;
    changed = true;
    std::stable_sort(order_.begin(), order_.end(), less);
    one.place.resize(count);
    for (size_t i = 0; i < count; ++i) one.place[order_[i]] = static_cast<int>(i);
    const int* atom = one.atoms.data();
    for (size_t k = 0; k < one.patterns; ++k) {
      for (size_t i = 0; i < count; ++i, ++atom) {
        const uint64_t mask = uint64_t{1} << (*atom % 64);
        uint64_t& word = state[ToIndex(*atom) / 64];
        const bool holds = (bits_[ToIndex(order_[i]) * words + k / 64] >> (k % 64) & 1) != 0;
        word = holds ? word | mask : word & ~mask;
      }
    }
  }
  return changed;
}

}  // namespace tether::task
