#include "tether/common/document/value_builder.h"

#include <algorithm>
#include <utility>

namespace tether {
namespace {

// Maps with more members than this look their keys up in a table.
constexpr size_t kFewKeys = 16;

[[noreturn]] void Fail(const Location& where, std::string message, std::string accepted) {
  throw InputError({{where, std::move(message), std::move(accepted)}});
}

}  // namespace

void ValueBuilder::Begin(Value::Kind kind, Location where, Anchor anchor) {
  if (ExpectsKey()) {
    Fail(where, std::string("a key is ") + (kind == Value::Kind::kArray ? "a list" : "a map"),
         "text as a key");
  }
  if (frames_.size() >= static_cast<size_t>(kMaxDepth)) {
    Fail(where, "lists and maps lie deeper than " + std::to_string(kMaxDepth) + " within each other",
         "a flatter document");
  }
  Count(1, where);
  Frame frame;
  frame.value = kind == Value::Kind::kArray ? Value::Array() : Value::Object();
  frame.value.set_where(std::move(where));
  frame.anchor = anchor;
  frames_.push_back(std::move(frame));
}

void ValueBuilder::End() {
  Frame frame = std::move(frames_.back());
  frames_.pop_back();
  Remember(frame.anchor, frame.value, frame.count, frame.depth);
  Put(std::move(frame.value), frame.count, frame.depth);
}

void ValueBuilder::Add(Value scalar, Anchor anchor) {
  if (ExpectsKey()) {
    Remember(anchor, scalar, 1, 0);
    SetKey(scalar);
    return;
  }
  Count(1, scalar.where());
  Remember(anchor, scalar, 1, 0);
  Put(std::move(scalar), 1, 0);
}

void ValueBuilder::Alias(Anchor anchor, const Location& where) {
  const auto found = anchored_.find(anchor);
  // An anchor is known to the parser, and here only once its value is complete.
  if (found == anchored_.end())
    Fail(where, "an alias inside its own anchor", "an alias after its anchor's value");
  const Anchored& earlier = found->second;
  if (ExpectsKey()) {
    SetKey(earlier.value);
    return;
  }
  CountAliased(earlier.count, where);
  Count(earlier.count, where);
  if (static_cast<int>(frames_.size()) + earlier.depth > kMaxDepth) {
    Fail(
        where,
        "with this alias, lists and maps lie deeper than " + std::to_string(kMaxDepth) + " within each other",
        "a flatter document");
  }
  Put(earlier.value, earlier.count, earlier.depth);
}

bool ValueBuilder::ExpectsKey() const {
  return !frames_.empty() && frames_.back().value.is_object() && !frames_.back().has_key;
}

void ValueBuilder::SetKey(const Value& key) {
  if (!key.is_scalar()) Fail(key.where(), "a key is " + key.KindName(), "text as a key");
  Frame& frame = frames_.back();
  frame.key = key.AsText();
  frame.key_where = key.where();
  frame.has_key = true;
  const std::vector<Value::Member>& members = frame.value.members();
  bool known = false;
  if (members.size() < kFewKeys) {
    known = frame.value.Find(frame.key) != nullptr;
  } else {
    if (frame.keys.empty()) {
      for (const Value::Member& member : members) frame.keys.insert(member.key);
    }
    known = !frame.keys.insert(frame.key).second;
  }
  if (known) Fail(frame.key_where, "key '" + frame.key + "' is given twice", "each key once");
}

void ValueBuilder::Put(Value value, size_t count, int depth) {
  if (frames_.empty()) {
    root_ = std::move(value);
    return;
  }
  Frame& frame = frames_.back();
  frame.count += count;
  frame.depth = std::max(frame.depth, depth + 1);
  if (frame.value.is_array()) {
    frame.value.Append(std::move(value));
    return;
  }
  frame.value.AppendMember(std::move(frame.key), std::move(frame.key_where), std::move(value));
  frame.has_key = false;
}

void ValueBuilder::Remember(Anchor anchor, const Value& value, size_t count, int depth) {
  if (anchor == 0) return;
  CountAliased(count, value.where());
  anchored_[anchor] = {value, count, depth};
}

void ValueBuilder::Count(size_t count, const Location& where) {
  count_ += count;
  if (count_ <= kMaxValues) return;
  Fail(where, "there are more than " + std::to_string(kMaxValues) + " values", "a smaller document");
}

void ValueBuilder::CountAliased(size_t count, const Location& where) {
  aliased_ += count;
  if (aliased_ <= kMaxAliasedValues) return;
  Fail(where, "anchors and aliases repeat more than " + std::to_string(kMaxAliasedValues) + " values",
       "fewer aliases within aliases");
}

}  // namespace tether
