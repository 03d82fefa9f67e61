#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <utility>
#include <vector>

namespace tether::task {

/// A queue of facts by cost, for explorations in which costs come out in increasing order: one bucket per
/// cost while costs are small, a heap from then on.
class RelaxedQueue {
 public:
  void Push(int64_t cost, int fact) {
    if (cost >= kMostBuckets) {
      heap_.emplace_back(cost, fact);
      std::push_heap(heap_.begin(), heap_.end(), std::greater<>());
      return;
    }
    const auto bucket = static_cast<size_t>(cost);
    if (bucket >= buckets_.size()) buckets_.resize(bucket + 1);
    buckets_[bucket].push_back(fact);
    current_ = std::min(current_, bucket);
    ++in_buckets_;
  }

  bool empty() const { return in_buckets_ == 0 && heap_.empty(); }

  /// The cheapest fact with its cost.
  std::pair<int64_t, int> Pop() {
    if (in_buckets_ == 0) {
      std::pop_heap(heap_.begin(), heap_.end(), std::greater<>());
      const std::pair<int64_t, int> top = heap_.back();
      heap_.pop_back();
      return top;
    }
    while (buckets_[current_].empty()) ++current_;
    const int fact = buckets_[current_].back();
    buckets_[current_].pop_back();
    --in_buckets_;
    return {static_cast<int64_t>(current_), fact};
  }

  void Clear() {
    for (size_t i = current_; in_buckets_ > 0 && i < buckets_.size(); ++i) buckets_[i].clear();
    heap_.clear();
    current_ = 0;
    in_buckets_ = 0;
  }

 private:
  static constexpr int64_t kMostBuckets = 10'000;

  std::vector<std::vector<int>> buckets_;
  size_t current_ = 0;
  size_t in_buckets_ = 0;
  std::vector<std::pair<int64_t, int>> heap_;
};

}  // namespace tether::task
