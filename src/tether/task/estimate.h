#pragma once

#include <cstdint>
#include <limits>
#include <memory>
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

  int64_t Evaluate(symbolic::StateView state);

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
