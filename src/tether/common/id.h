#pragma once

#include <compare>
#include <cstddef>
#include <functional>
#include <type_traits>
#include <utility>
#include <vector>

namespace tether {

/// The number of one of many things of a kind, in the order in which a file, or what is made from it, has
/// them. Names become ids when a file is read, and return in files and messages only. Ids of different kinds
/// don't mix. A default one names nothing.
template <typename Tag>
class Id {
 public:
  constexpr Id() = default;
  constexpr explicit Id(int value) : value_(value) {}
  constexpr explicit Id(size_t index) : value_(static_cast<int>(index)) {}

  /// It names something.
  constexpr bool valid() const { return value_ >= 0; }
  /// −1: it names nothing.
  constexpr int value() const { return value_; }
  /// Of one that names something.
  constexpr size_t index() const { return static_cast<size_t>(value_); }

  auto operator<=>(const Id&) const = default;

 private:
  int value_ = -1;
};

/// A ground action of a task.
using ActionId = Id<struct ActionTag>;
/// An object of a scene.
using ObjectId = Id<struct ObjectTag>;
/// A frame of a scene: see scene::Frames.
using FrameId = Id<struct FrameTag>;

/// An id, or a plain number that is not negative, as an index.
template <typename I>
constexpr size_t ToIndex(I i) {
  if constexpr (std::is_integral_v<I>) {
    return static_cast<size_t>(i);
  } else {
    return i.index();
  }
}

/// The ids from the first one to that before `size`, for loops.
template <typename I>
class IdRange {
 public:
  class Iterator {
   public:
    explicit Iterator(size_t at) : at_(at) {}
    I operator*() const { return static_cast<I>(at_); }
    Iterator& operator++() {
      ++at_;
      return *this;
    }
    bool operator==(const Iterator&) const = default;

   private:
    size_t at_;
  };

  explicit IdRange(size_t size) : size_(size) {}
  Iterator begin() const { return Iterator(0); }
  Iterator end() const { return Iterator(size_); }

 private:
  size_t size_;
};

/// A vector with something for each id of a kind: only these are its indices. `I` may be `int`, for numbers
/// that are counted on and compared.
template <typename I, typename T>
class IndexedVector {
 public:
  IndexedVector() = default;
  explicit IndexedVector(size_t size) : values_(size) {}
  IndexedVector(size_t size, const T& value) : values_(size, value) {}
  explicit IndexedVector(std::vector<T> values) : values_(std::move(values)) {}

  decltype(auto) operator[](I i) { return values_[ToIndex(i)]; }
  decltype(auto) operator[](I i) const { return values_[ToIndex(i)]; }

  size_t size() const { return values_.size(); }
  bool empty() const { return values_.empty(); }
  auto begin() { return values_.begin(); }
  auto end() { return values_.end(); }
  auto begin() const { return values_.begin(); }
  auto end() const { return values_.end(); }
  decltype(auto) back() { return values_.back(); }
  decltype(auto) back() const { return values_.back(); }
  /// Every id that has something here, in order.
  IdRange<I> ids() const { return IdRange<I>(values_.size()); }
  /// That of the next one to be added.
  I next_id() const { return static_cast<I>(values_.size()); }

  void push_back(T value) { values_.push_back(std::move(value)); }
  template <typename... Arguments>
  decltype(auto) emplace_back(Arguments&&... arguments) {
    return values_.emplace_back(std::forward<Arguments>(arguments)...);
  }
  void pop_back() { values_.pop_back(); }
  void reserve(size_t size) { values_.reserve(size); }
  void resize(size_t size) { values_.resize(size); }
  void resize(size_t size, const T& value) { values_.resize(size, value); }
  void assign(size_t size, const T& value) { values_.assign(size, value); }
  void clear() { values_.clear(); }

  /// The same without ids.
  const std::vector<T>& values() const { return values_; }
  std::vector<T>& values() { return values_; }

  bool operator==(const IndexedVector&) const = default;

 private:
  std::vector<T> values_;
};

}  // namespace tether

template <typename Tag>
struct std::hash<tether::Id<Tag>> {
  size_t operator()(tether::Id<Tag> id) const { return std::hash<int>()(id.value()); }
};
