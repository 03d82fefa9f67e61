#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace tether::ltl {

/// How a formula is read on finite words.
///
/// kCosafe: paper B's (section 2.1): the word is a prefix of an endless one, and an accepted word stays
/// accepted. X needs a next position. Only co-safe formulas (Kupferman and Vardi, 2001) can be read so.
///
/// kLtlf: the word is complete (De Giacomo and Vardi, IJCAI 2013). X is weak: it holds at the last position
/// whatever follows; X[!] is strong.
enum class Semantics { kCosafe, kLtlf };

/// "cosafe" or "ltlf".
std::string ToString(Semantics semantics);

enum class Operator : uint8_t {
  kFalse,
  kTrue,
  kAtom,
  kNot,
  kNext,           ///< X
  kStrongNext,     ///< X[!]
  kEventually,     ///< F
  kAlways,         ///< G
  kUntil,          ///< U
  kRelease,        ///< R
  kWeakUntil,      ///< W
  kStrongRelease,  ///< M
  kAnd,            ///< Two operands or more.
  kXor,
  kOr,  ///< Two operands or more.
  kImplies,
  kEquivalent,
};

/// The operator as it is written: "X[!]", "<->". Empty for atoms.
std::string_view Symbol(Operator op);

/// A temporal formula as it was written: a tree whose nodes know their column. A value; cheap to move.
/// Conjunctions and disjunctions are flat: `a & (b & c)` is `a & b & c`. Nothing is simplified. (Equal
/// subformulas become one in Core, which automata are made from.)
class Formula {
 public:
  struct Node {
    Operator op = Operator::kTrue;
    int atom = -1;              ///< Index into atoms(), for kAtom.
    std::vector<int> operands;  ///< Indices into nodes(), each smaller than the node's own.
    int column = 0;             ///< Of the operator in the text, from 1; 0 if it was not parsed.
    bool quoted = false;        ///< An atom that was written in double quotes, so that it is no word of LTLf.
  };

  /// `true`.
  Formula();
  static Formula Constant(bool value, int column = 0);
  /// `name` may be any text; see AtomText() for how it prints.
  static Formula Atom(std::string_view name, int column = 0);
  /// Applies `op` to its operands, as many as it has.
  static Formula Make(Operator op, std::span<const Formula> operands, int column = 0);
  static Formula Make(Operator op, std::initializer_list<Formula> operands, int column = 0);

  /// Operands come before their operator; the root is the last.
  const std::vector<Node>& nodes() const { return nodes_; }
  const Node& node(int i) const { return nodes_[static_cast<size_t>(i)]; }
  int root() const { return static_cast<int>(nodes_.size()) - 1; }
  /// Names, in the order of their first occurrence. A word's letters are bit sets in this order.
  const std::vector<std::string>& atoms() const { return atoms_; }

  /// A formula from its parts; `nodes` in the order of nodes(), no conjunction directly below a conjunction,
  /// no disjunction directly below a disjunction.
  static Formula FromNodes(std::vector<Node> nodes, std::vector<std::string> atoms);

  /// The formula below one node.
  Formula Sub(int node) const;

  /// With no more parentheses than needed: "F(a & X[!] F b)". Parses back to an equal formula.
  std::string ToString() const;

  /// Same operators on same atoms; columns don't count.
  friend bool operator==(const Formula& a, const Formula& b);

 private:
  int Append(const Formula& operand);

  std::vector<Node> nodes_;
  std::vector<std::string> atoms_;
};

/// The atom as it must be written in a formula: bare if it reads back as the same name, else quoted.
std::string AtomText(std::string_view name);

/// 64-bit words of a letter with so many atoms; at least 1.
inline size_t LetterWords(size_t atoms) { return atoms == 0 ? 1 : (atoms + 63) / 64; }

/// A letter of a word: which atoms are true, bit i % 64 of word i / 64 for atom i.
using Letter = std::vector<uint64_t>;
using LetterView = std::span<const uint64_t>;
using Word = std::vector<Letter>;

inline bool IsTrue(LetterView letter, int atom) {
  return (letter[static_cast<size_t>(atom) / 64] >> (static_cast<unsigned>(atom) % 64) & 1) != 0;
}

/// The letter in which exactly `names` are true; names that are not among `atoms` are left out.
Letter MakeLetter(const std::vector<std::string>& atoms, const std::vector<std::string>& names);

}  // namespace tether::ltl
