#pragma once

#include <map>
#include <memory>
#include <mutex>
#include <utility>

namespace tether::constraints {

/// Values that are made once, when they are first asked for, and never changed. Thread-safe.
template <typename Key, typename Value>
class Memo {
 public:
  /// The value of `key`, made by `make()` the first time. A key always stands for the same value: when two
  /// threads make it at once, either copy will do.
  template <typename Make>
  std::shared_ptr<const Value> Get(const Key& key, Make make) const {
    {
      const std::lock_guard lock(mutex_);
      const auto found = values_.find(key);
      if (found != values_.end()) return found->second;
    }
    auto value = std::make_shared<const Value>(make());
    const std::lock_guard lock(mutex_);
    return values_.try_emplace(key, std::move(value)).first->second;
  }

 private:
  mutable std::mutex mutex_;
  mutable std::map<Key, std::shared_ptr<const Value>> values_;
};

}  // namespace tether::constraints
