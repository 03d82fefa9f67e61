#pragma once

#include <atomic>
#include <cstddef>
#include <memory>
#include <string>
#include <string_view>

namespace tether::evaluation {

/// A queue of byte strings from one thread to one other. Neither ever waits: Push() copies into a block that
/// the reader does not touch beyond what is announced, and begins a new block when one is full.
class ByteQueue {
 public:
  ByteQueue();
  ~ByteQueue();
  ByteQueue(const ByteQueue&) = delete;
  ByteQueue& operator=(const ByteQueue&) = delete;

  /// Of the writing thread: adds head + body as one entry.
  void Push(std::string_view head, std::string_view body);
  /// Of the reading thread: the next entry, if there is one.
  bool Pop(std::string* entry);
  /// What was pushed and not popped, bytes, roughly.
  size_t backlog() const {
    return pushed_.load(std::memory_order_relaxed) - popped_.load(std::memory_order_relaxed);
  }

 private:
  struct Block;
  Block* write_;  // Of the writing thread.
  Block* read_;   // Of the reading thread, as the next.
  size_t read_at_ = 0;
  std::atomic<size_t> pushed_{0}, popped_{0};
};

}  // namespace tether::evaluation
