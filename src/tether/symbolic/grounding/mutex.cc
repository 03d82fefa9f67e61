#include "tether/symbolic/grounding/mutex.h"

#include "tether/common/limits.h"

#include <algorithm>
#include <bit>
#include <set>

namespace tether::symbolic {
namespace {

using Bits = std::vector<uint64_t>;

void Set(Bits& bits, int i) { bits[static_cast<size_t>(i) / 64] |= uint64_t{1} << (i % 64); }
bool Has(const Bits& bits, int i) { return (bits[static_cast<size_t>(i) / 64] >> (i % 64) & 1) != 0; }

void Collect(const GroundFormula& formula, std::vector<int>& literals) {
  if (formula.kind == GroundFormula::Kind::kLiteral) {
    literals.push_back(Literal(formula.atom, formula.positive));
  } else if (formula.kind == GroundFormula::Kind::kAnd) {
    for (const GroundFormula& child : formula.children) Collect(child, literals);
  }
}

}  // namespace

std::vector<int> NecessaryLiterals(const Condition& condition) {
  std::vector<int> literals;
  Collect(condition.formula(), literals);
  return literals;
}

/// Iterates the set of pairs of literals that may hold together until nothing is added.
class MutexFinder {
 public:
  MutexFinder(const Task& task, const std::vector<AtomPermutation>& permutations, size_t max_work)
      : task_(task), permutations_(permutations), left_(max_work) {
    literals_ = 2 * task.atoms().size();
    mutexes_.words_ = (literals_ + 63) / 64;
  }

  std::optional<Mutexes> Run() {
    if (literals_ * mutexes_.words_ > left_) return std::nullopt;
    mutexes_.together_.assign(literals_ * mutexes_.words_, 0);
    Start();
    if (!Permute()) return std::nullopt;
    PrepareActions();
    while (changed_) {
      changed_ = false;
      for (const Step& step : steps_) {
        const size_t work = (step.needed.size() + step.made.size() + 2) * mutexes_.words_;
        if (work > left_) return std::nullopt;
        left_ -= work;
        PollLimits();
        Take(step);
      }
    }
    return std::move(mutexes_);
  }

 private:
  /// An action, or one of its conditional effects together with those that it always has.
  struct Step {
    std::vector<int> needed;  ///< Literals that must hold before.
    std::vector<int> made;    ///< Literals that hold after it, or may.
    Bits ended;               ///< Literals that don't hold after it.
    /// What other conditional effects of the action may make: it may hold beside `made`.
    std::vector<int> beside;
  };

  uint64_t* Row(int literal) {
    return mutexes_.together_.data() + static_cast<size_t>(literal) * mutexes_.words_;
  }

  void Allow(int a, const Bits& others) {
    uint64_t* row = Row(a);
    Set(reached_, a);
    for (size_t w = 0; w < mutexes_.words_; ++w) {
      for (uint64_t fresh = others[w] & ~row[w]; fresh != 0; fresh &= fresh - 1) {
        const int b = static_cast<int>(64 * w) + std::countr_zero(fresh);
        Row(b)[static_cast<size_t>(a) / 64] |= uint64_t{1} << (a % 64);
        changed_ = true;
      }
      row[w] |= others[w];
    }
  }

  void Start() {
    Bits start(mutexes_.words_, 0), derived(mutexes_.words_, 0), all(mutexes_.words_, 0);
    for (int atom = 0; atom < static_cast<int>(task_.atoms().size()); ++atom) {
      Set(start, Literal(atom, IsTrue(task_.initial_state(), atom)));
      for (const bool positive : {true, false}) {
        Set(all, Literal(atom, positive));
        if (task_.IsDerived(atom)) Set(derived, Literal(atom, positive));
      }
    }
    reached_.assign(mutexes_.words_, 0);
    for (int literal = 0; literal < static_cast<int>(literals_); ++literal) {
      if (Has(start, literal)) Allow(literal, start);
      if (Has(derived, literal)) Allow(literal, all);
    }
    changed_ = true;
  }

  /// Allows the images of the pairs that are allowed at the start.
  bool Permute() {
    std::vector<std::pair<int, int>> pairs;
    const auto note = [&](int a, int b) {
      Row(a)[static_cast<size_t>(b) / 64] |= uint64_t{1} << (b % 64);
      if (a == b) Set(reached_, a);
      pairs.emplace_back(a, b);
    };
    if (permutations_.empty()) return true;
    for (int a = 0; a < static_cast<int>(literals_); ++a) {
      for (int b = 0; b < static_cast<int>(literals_); ++b) {
        if (!mutexes_.AreMutex(a, b)) pairs.emplace_back(a, b);
      }
    }
    while (!pairs.empty()) {
      const auto [a, b] = pairs.back();
      pairs.pop_back();
      PollLimits();
      if (permutations_.size() > left_) return false;
      left_ -= permutations_.size();
      for (const AtomPermutation& permutation : permutations_) {
        const int c = 2 * permutation[a / 2] + a % 2;
        const int d = 2 * permutation[b / 2] + b % 2;
        if (mutexes_.AreMutex(c, d)) note(c, d);
      }
    }
    return true;
  }

  static bool IsTrue(const State& state, int atom) {
    return (state[static_cast<size_t>(atom) / 64] >> (atom % 64) & 1) != 0;
  }

  std::vector<int> Known(const Condition& condition) const {
    std::vector<int> literals = NecessaryLiterals(condition);
    std::erase_if(literals, [&](int literal) { return task_.IsDerived(literal / 2); });
    return literals;
  }

  static void Make(const std::vector<int>& deletes, const std::vector<int>& adds, std::set<int>& made) {
    for (int atom : deletes) made.insert(Literal(atom, false));
    for (int atom : adds) {
      made.erase(Literal(atom, false));
      made.insert(Literal(atom, true));
    }
  }

  void PrepareActions() {
    for (const GroundAction& action : task_.actions()) {
      PollLimits();
      std::vector<int> deletes, adds;
      for (const GroundEffect& effect : action.effects) {
        if (!effect.condition.always()) continue;
        deletes.insert(deletes.end(), effect.deletes.begin(), effect.deletes.end());
        adds.insert(adds.end(), effect.adds.begin(), effect.adds.end());
      }
      std::set<int> may;
      for (const GroundEffect& effect : action.effects) {
        if (effect.condition.always()) continue;
        std::set<int> own;
        Make(effect.deletes, effect.adds, own);
        may.insert(own.begin(), own.end());
      }
      const std::vector<int> needed = Known(action.precondition);
      AddStep(needed, deletes, adds, may);
      for (const GroundEffect& effect : action.effects) {
        if (effect.condition.always()) continue;
        std::vector<int> all = needed, own_deletes = deletes, own_adds = adds;
        const std::vector<int> own = Known(effect.condition);
        all.insert(all.end(), own.begin(), own.end());
        own_deletes.insert(own_deletes.end(), effect.deletes.begin(), effect.deletes.end());
        own_adds.insert(own_adds.end(), effect.adds.begin(), effect.adds.end());
        AddStep(std::move(all), own_deletes, own_adds, may);
      }
    }
  }

  void AddStep(std::vector<int> needed, const std::vector<int>& deletes, const std::vector<int>& adds,
               const std::set<int>& may) {
    std::set<int> made;
    Make(deletes, adds, made);
    Step step{std::move(needed), {made.begin(), made.end()}, Bits(mutexes_.words_, 0), {}};
    for (int literal : made) {
      // Another effect may still add what this one deletes.
      if (may.count(literal ^ 1) == 0 || literal % 2 == 0) Set(step.ended, literal ^ 1);
    }
    for (int literal : may) {
      if (!Has(step.ended, literal)) step.beside.push_back(literal);
    }
    steps_.push_back(std::move(step));
  }

  void Take(const Step& step) {
    for (int literal : step.needed) {
      for (int other : step.needed) {
        if ((Row(literal)[static_cast<size_t>(other) / 64] >> (other % 64) & 1) == 0) return;
      }
    }
    // Literals that may hold before, and still hold after.
    Bits& rest = scratch_;
    rest = reached_;
    for (int literal : step.needed) {
      for (size_t w = 0; w < mutexes_.words_; ++w) rest[w] &= Row(literal)[w];
    }
    for (size_t w = 0; w < mutexes_.words_; ++w) rest[w] &= ~step.ended[w];
    for (int literal : step.made) Set(rest, literal);
    for (int literal : step.beside) Set(rest, literal);
    for (int literal : step.made) Allow(literal, rest);
  }

  const Task& task_;
  const std::vector<AtomPermutation>& permutations_;
  size_t literals_ = 0, left_;
  Mutexes mutexes_;
  std::vector<Step> steps_;
  Bits reached_, scratch_;
  bool changed_ = true;
};

std::optional<Mutexes> Mutexes::Find(const Task& task, const std::vector<AtomPermutation>& permutations,
                                     size_t max_work) {
  return MutexFinder(task, permutations, max_work).Run();
}

namespace {

/// The start and all that permutations make of it have one of the atoms.
bool IsInhabited(const Task& task, const std::vector<int>& atoms,
                 const std::vector<AtomPermutation>& permutations) {
  constexpr size_t kMostImages = 200;
  std::set<std::vector<int>> seen = {atoms};
  std::vector<std::vector<int>> images = {atoms};
  for (size_t i = 0; i < images.size(); ++i) {
    if (images.size() > kMostImages) return false;
    const std::vector<int> one = images[i];
    if (std::none_of(one.begin(), one.end(), [&](int atom) { return Has(task.initial_state(), atom); }))
      return false;
    for (const AtomPermutation& permutation : permutations) {
      std::vector<int> image = one;
      for (int& atom : image) atom = permutation[atom];
      std::sort(image.begin(), image.end());
      if (seen.insert(image).second) images.push_back(std::move(image));
    }
  }
  return true;
}

/// Each action that may end one of the variable's atoms makes one true.
bool StaysInhabited(const Task& task, const Bits& own) {
  const auto in = [&](int atom) { return Has(own, atom); };
  return std::all_of(task.actions().begin(), task.actions().end(), [&](const GroundAction& action) {
    const auto makes = [&](const GroundEffect& effect) {
      return std::any_of(effect.adds.begin(), effect.adds.end(), in);
    };
    const bool always =
        std::any_of(action.effects.begin(), action.effects.end(),
                    [&](const GroundEffect& effect) { return effect.condition.always() && makes(effect); });
    return always ||
           std::all_of(action.effects.begin(), action.effects.end(), [&](const GroundEffect& effect) {
             return makes(effect) || std::none_of(effect.deletes.begin(), effect.deletes.end(), in);
           });
  });
}

}  // namespace

std::vector<Variable> FindVariables(const Task& task, const Mutexes& mutexes,
                                    const std::vector<AtomPermutation>& permutations) {
  const int atoms = static_cast<int>(task.atoms().size());
  std::set<std::vector<int>> known;
  std::vector<Variable> variables;
  const auto add = [&](std::vector<int> chosen) {
    std::sort(chosen.begin(), chosen.end());
    if (chosen.size() < 2 || !known.insert(chosen).second) return;
    Bits own((static_cast<size_t>(atoms) + 63) / 64, 0);
    for (int atom : chosen) Set(own, atom);
    const bool exactly_one = IsInhabited(task, chosen, permutations) && StaysInhabited(task, own);
    variables.push_back({std::move(chosen), exactly_one});
  };
  for (int seed = 0; seed < atoms; ++seed) {
    if (task.IsDerived(seed)) continue;
    const Atom& start = task.atoms()[seed];
    std::vector<int> candidates;
    for (int atom = 0; atom < atoms; ++atom) {
      if (atom != seed && !task.IsDerived(atom) && mutexes.AreMutex(Literal(seed, true), Literal(atom, true)))
        candidates.push_back(atom);
    }
    // First the atoms about one of its arguments: where this object is, what is in this place.
    for (size_t k = 0; k == 0 || k < start.arguments.size(); ++k) {
      const auto rank = [&](int index) {
        const Atom& atom = task.atoms()[index];
        const bool alike = atom.predicate == start.predicate;
        if (start.arguments.empty()) return alike ? 0 : 1;
        const int object = start.arguments[k];
        if (alike) return atom.arguments[k] == object ? 0 : 2;
        return std::count(atom.arguments.begin(), atom.arguments.end(), object) > 0 ? 1 : 3;
      };
      std::stable_sort(candidates.begin(), candidates.end(), [&](int a, int b) { return rank(a) < rank(b); });
      std::vector<int> chosen = {seed};
      for (int atom : candidates) {
        if (std::all_of(chosen.begin(), chosen.end(), [&](int other) {
              return mutexes.AreMutex(Literal(other, true), Literal(atom, true));
            }))
          chosen.push_back(atom);
      }
      add(std::move(chosen));
    }
  }
  return variables;
}

}  // namespace tether::symbolic
