#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "tether/common/id.h"
#include "tether/symbolic/grounding/mutex.h"
#include "tether/task/goal/product.h"

namespace tether::task {

/// A state with two interchangeable objects exchanged in every atom; what follows the atoms, such as the
/// state of a goal's automaton, stays as it is.
symbolic::State ExchangeObjects(const symbolic::Task& task, symbolic::StateView state, int a, int b);

/// Objects of a product that are interchangeable: exchanging two of them everywhere maps the task onto
/// itself, its goal included, whatever their initial state. States that differ only by such an exchange have
/// the same distance to the goal, so that only one of them needs to be searched (Pochter, Zohar and
/// Rosenschein, AAAI 2011; Domshlak, Katz and Shleyfman, ICAPS 2012).
///
/// An exchange must map each ground action to one with the image of its condition, effects and cost, each
/// axiom to one, the goal to itself, and, of a temporal goal, each subformula without temporal operators to
/// itself: so the automaton's state stays as it is.
///
/// As many classes of interchangeable objects are used as leave at most one such object in each atom: then
/// sorting the objects of a class by what is true of them gives each state the same representative as all its
/// images.
class Symmetry {
 public:
  /// `product` must outlive this.
  explicit Symmetry(const Product& product);

  /// No exchange is used.
  bool trivial() const { return classes_.empty(); }
  /// The classes that are used, as indices into Problem::objects.
  std::vector<std::vector<int>> Classes() const;

  /// Replaces a state by the representative of its orbit; true if that is another state.
  bool Canonicalize(std::span<uint64_t> state);
  /// How many states, itself included, have the representative of `state`.
  double OrbitSize(symbolic::StateView state);

  /// Generators of all exchanges, as permutations of atoms: per class, the exchange of the first two objects,
  /// and the cyclic shift of all.
  std::vector<symbolic::AtomPermutation> Exchanges() const;

  /// Image() is available.
  bool maps_actions() const { return maps_actions_; }
  /// The action that `action` becomes by the exchange that the last Canonicalize() made.
  ActionId Image(ActionId action) const;

 private:
  /// Interchangeable objects, and the atoms about them: atoms[k * objects + i] is the k-th of object i.
  struct Class {
    std::vector<int> objects;
    std::vector<int> atoms;
    size_t patterns = 0;  ///< Atoms per object.
    /// The member that an action is about, -1 if none, and its images with each member in that one's place.
    IndexedVector<ActionId, int> member_of_action;
    IndexedVector<ActionId, IndexedVector<int, ActionId>> images;
    IndexedVector<int, int>
        place;  ///< Per member, whose place it got by the last Canonicalize(); empty: its own.
  };

  size_t atoms_ = 0;

  void ReadBits(const Class& one, symbolic::StateView state);
  void MapActions(const symbolic::Task& task, Class& one);

  std::vector<Class> classes_;
  bool maps_actions_ = true;
  // Scratch of Canonicalize().
  std::vector<uint64_t> bits_;
  std::vector<int> order_;
};

}  // namespace tether::task
