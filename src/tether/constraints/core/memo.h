#pragma once

#include <any>
#include <map>
#include <memory>
#include <mutex>
#include <string>

namespace tether::constraints {

/// Results that constraints compute once and use again. Thread-safe.
class Memo {
 public:
  /// The value kept under `key`, made by `make()` the first time. A key always stands for the same T and the
  /// same value: when two threads make it at once, either copy will do.
  template <typename T, typename Make>
  std::shared_ptr<const T> Get(const std::string& key, Make make) const {
    {
      const std::lock_guard lock(mutex_);
      const auto found = values_.find(key);
      if (found != values_.end()) return std::any_cast<std::shared_ptr<const T>>(found->second);
    }
    auto value = std::make_shared<const T>(make());
    const std::lock_guard lock(mutex_);
    return std::any_cast<std::shared_ptr<const T>>(values_.try_emplace(key, std::move(value)).first->second);
  }

 private:
  mutable std::mutex mutex_;
  mutable std::map<std::string, std::any> values_;
};

}  // namespace tether::constraints
