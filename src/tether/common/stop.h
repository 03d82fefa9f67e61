#pragma once

#include <atomic>

namespace tether {

/// Whether a request to stop was made; null: nobody can make one.
inline bool IsStopped(const std::atomic<bool>* stop) {
  return stop != nullptr && stop->load(std::memory_order_relaxed);
}

}  // namespace tether
