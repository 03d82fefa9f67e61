#include "tether/evaluation/log/byte_queue.h"

#include <algorithm>
#include <cstdint>
#include <cstring>

namespace tether::evaluation {
namespace {

constexpr size_t kBlock = size_t{1} << 18;
constexpr size_t kLength = sizeof(uint32_t);

}  // namespace

struct ByteQueue::Block {
  explicit Block(size_t bytes)
      : data(std::make_unique_for_overwrite<char[]>(bytes)), size(bytes) {}  // NOLINT: not a string
  std::unique_ptr<char[]> data;                                              // NOLINT
  size_t size;
  std::atomic<size_t> written{0};     ///< Bytes that may be read.
  std::atomic<Block*> next{nullptr};  ///< Set once this one is full.
};

ByteQueue::ByteQueue() : write_(new Block(kBlock)), read_(write_) {}

ByteQueue::~ByteQueue() {
  while (read_ != nullptr) {
    Block* const next = read_->next.load();
    delete read_;
    read_ = next;
  }
}

void ByteQueue::Push(std::string_view head, std::string_view body) {
  const size_t length = head.size() + body.size(), needed = kLength + length;
  size_t at = write_->written.load(std::memory_order_relaxed);
  if (at + needed > write_->size) {
    auto* const next = new Block(std::max(kBlock, needed));
    write_->next.store(next, std::memory_order_release);
    write_ = next;
    at = 0;
  }
  char* const to = write_->data.get() + at;
  const auto stored = static_cast<uint32_t>(length);
  std::memcpy(to, &stored, kLength);
  if (!head.empty()) std::memcpy(to + kLength, head.data(), head.size());
  if (!body.empty()) std::memcpy(to + kLength + head.size(), body.data(), body.size());
  write_->written.store(at + needed, std::memory_order_release);
  pushed_.store(pushed_.load(std::memory_order_relaxed) + needed, std::memory_order_relaxed);
}

bool ByteQueue::Pop(std::string* entry) {
  for (;;) {
    // The next block before the end of this one: once there is a next, this one is complete.
    Block* const next = read_->next.load(std::memory_order_acquire);
    const size_t written = read_->written.load(std::memory_order_acquire);
    if (read_at_ < written) break;
    if (next == nullptr) return false;
    delete read_;
    read_ = next;
    read_at_ = 0;
  }
  const char* const from = read_->data.get() + read_at_;
  uint32_t length = 0;
  std::memcpy(&length, from, kLength);
  entry->assign(from + kLength, length);
  read_at_ += kLength + length;
  popped_.store(popped_.load(std::memory_order_relaxed) + kLength + length, std::memory_order_relaxed);
  return true;
}

}  // namespace tether::evaluation
