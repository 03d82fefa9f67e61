#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "tether/symbolic/grounding/mutex.h"
#include "tether/task/goal/product.h"
#include "tether/task/heuristics/landmark_cut.h"
#include "tether/task/heuristics/potentials.h"

namespace tether::task {

/// An admissible estimate of the cost from a state of the product to its goal, kDeadEnd only where there is
/// no plan: the larger of the landmark cut, which sees the automaton's parts as facts, and the number of
/// letters that the automaton still needs times the cost of the cheapest action.
class Estimate {
 public:
  static constexpr int64_t kDeadEnd = LandmarkCut::kDeadEnd;

  /// `product` must outlive this. With `blind` it is 0 everywhere.
  Estimate(const Product& product, bool blind, bool unit_costs);

  int64_t Evaluate(symbolic::StateView state) { return Evaluate(state, {}, {}); }
  /// The same, computed faster from `before`, the landmarks of the state before `action`, of the same
  /// generation. The estimate may differ.
  int64_t Evaluate(symbolic::StateView state, std::span<const int> before, ActionId action);
  /// Of the last evaluation; empty if blind.
  std::span<const int> landmarks() const {
    return cut_ ? std::span<const int>(cut_->heuristic.landmarks()) : std::span<const int>();
  }

  /// Searches, in at most `max_evaluations`, for a merge of two variables, for parts of the automaton to be
  /// tracked and for potentials that raise the sum of the estimates of `samples`, and uses them from then on
  /// if they do. `exchanges` are those that may be applied to states before they are evaluated:
  /// Symmetry::Exchanges(). Depends on nothing but its arguments.
  bool Strengthen(std::span<const symbolic::State> samples,
                  const std::vector<symbolic::AtomPermutation>& exchanges, size_t max_evaluations);
  /// How often the estimate was strengthened. Landmarks of another generation are void.
  int generation() const { return generation_; }
  /// Landmarks are actions, so that exchanges of objects apply to them.
  bool landmarks_are_actions() const { return generation_ == 0; }

 private:
  struct Cut {
    Relaxation relaxation;
    LandmarkCut heuristic;
    std::unique_ptr<Potentials> potentials;

    Cut(const Product& product, bool unit_costs) : relaxation(product, unit_costs), heuristic(relaxation) {}
    Cut(const Product& product, bool unit_costs, const std::optional<Merge>& merge,
        const std::vector<Tracking>& trackings, const symbolic::Mutexes& mutexes)
        : relaxation(product, unit_costs, merge, trackings, mutexes), heuristic(relaxation) {}
  };

  std::vector<Merge> FindMerges() const;
  std::vector<Tracking> FindTrackings(const std::optional<Merge>& merge) const;
  std::unique_ptr<Cut> FindRefinement(std::span<const symbolic::State> samples);
  int64_t Evaluate(Cut& cut, symbolic::StateView state, std::span<const int> before, ActionId action);
  int64_t Sum(Cut& cut, std::span<const symbolic::State> samples);
  struct Shift {
    size_t direction = 0;  ///< Of Potentials::directions().
    int64_t change = 0;
  };
  int64_t Climb(Cut& cut, std::span<const symbolic::State> samples, int64_t sum, size_t max_evaluations,
                std::vector<Shift>& done);

  const Product& product_;
  bool unit_costs_;
  std::unique_ptr<Cut> cut_;
  struct Invariants {
    symbolic::Mutexes mutexes;
    std::vector<symbolic::Variable> variables;
  };
  std::unique_ptr<Invariants> invariants_;
  int64_t cheapest_ = 0;
  int generation_ = 0;
  std::vector<int> facts_;
};

}  // namespace tether::task
