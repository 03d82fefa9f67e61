#pragma once

#include <cstddef>
#include <string>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include "tether/common/document/value.h"

namespace tether {

/// Builds a document from a reader's events, in the order of the text, within kMaxDepth and kMaxValues.
/// Throws InputError beyond them, and for a key that is given twice.
class ValueBuilder {
 public:
  /// Names a value for Alias(); 0: none.
  using Anchor = size_t;

  /// Begins a list or map; the values up to the matching End() belong to it.
  void Begin(Value::Kind kind, Location where, Anchor anchor = 0);
  void End();
  /// A scalar or null, or the key of the next member where a map expects one.
  void Add(Value scalar, Anchor anchor = 0);
  /// A copy of an earlier value.
  void Alias(Anchor anchor, const Location& where);

  Value Take() { return std::move(root_); }

 private:
  struct Frame {
    Value value;
    Anchor anchor = 0;
    size_t count = 1;  ///< Values in it, itself included.
    int depth = 1;     ///< Levels in it, its own included.
    bool has_key = false;
    std::string key;
    Location key_where;
    std::unordered_set<std::string> keys;  ///< Of maps with many members.
  };
  struct Anchored {
    Value value;
    size_t count = 0;
    int depth = 0;
  };

  bool ExpectsKey() const;
  void SetKey(const Value& key);
  void Put(Value value, size_t count, int depth);
  void Remember(Anchor anchor, const Value& value, size_t count, int depth);
  void Count(size_t count, const Location& where);
  void CountAliased(size_t count, const Location& where);

  std::vector<Frame> frames_;
  std::unordered_map<Anchor, Anchored> anchored_;
  size_t count_ = 0, aliased_ = 0;
  Value root_;
};

/// Reads strict JSON, with keys of any length; false, without a message, if the text is none.
bool ParseStrictJson(std::string_view text, const std::string& file, Value* value);

}  // namespace tether
