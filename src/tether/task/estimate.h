#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <vector>

#include "tether/task/landmark_cut.h"
#include "tether/task/product.h"

namespace tether::task {

/// Never more than the cost from a state of the product to its goal, and kDeadEnd only where there is no way:
/// the larger of the landmark cut, which sees the automaton's parts as facts, and the letters that the
/// automaton still needs at the price of the cheapest action.
class Estimate {
 public:
  static constexpr int64_t kDeadEnd = LandmarkCut::kDeadEnd;

  /// `product` must outlive this. With `blind` it is 0 everywhere.
  Estimate(const Product& product, bool blind, bool unit_costs);

  int64_t Evaluate(symbolic::StateView state) { return Evaluate(state, {}, -1); }
  /// The same, sooner, where `before` are the landmarks of the state before `action`. The number may be
  /// another.
  int64_t Evaluate(symbolic::StateView state, std::span<const int> before, int action);
  /// Of the last evaluation; empty if blind.
  std::span<const int> landmarks() const {
    return cut_ ? std::span<const int>(cut_->heuristic.landmarks()) : std::span<const int>();
  }

 private:
  struct Cut {
    Relaxation relaxation;
    LandmarkCut heuristic;
    Cut(const Product& product, bool unit_costs) : relaxation(product, unit_costs), heuristic(relaxation) {}
  };

  const Product& product_;
  std::unique_ptr<Cut> cut_;
  int64_t cheapest_ = 0;
  std::vector<int> facts_;
};

}  // namespace tether::task
