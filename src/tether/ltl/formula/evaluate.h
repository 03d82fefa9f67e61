#pragma once

#include "tether/ltl/formula/formula.h"

namespace tether::ltl {

/// Whether `word` satisfies `formula`, straight from the definitions of De Giacomo and Vardi (IJCAI 2013):
/// the oracle of the automata's tests. Letters are in the order of formula.atoms().
///
/// With n positions, at position i ≤ n:  a: i < n and a ∈ letter i;  X[!] f: i + 1 < n and f at i + 1;
/// X f: i + 1 ≥ n or f at i + 1;  f U g: g at some j with i ≤ j < n, and f at all positions from i to j − 1.
/// The empty word has no position: atoms, X[!], F, U, M fail there; X, G, R, W hold.
///
/// kCosafe: X is X[!], and a negation is pushed down to the atoms first (through X as X: the word goes on); a
/// negated atom needs a position too. Then what holds of a word holds of every longer one. The formula must
/// be co-safe: RequireSemantics().
bool Evaluate(const Formula& formula, const Word& word, Semantics semantics);

}  // namespace tether::ltl
