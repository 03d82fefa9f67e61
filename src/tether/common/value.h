#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "tether/common/error.h"

namespace tether {

/// A node of a document: what YAML and JSON files hold, with the place in the file where it stands.
///
/// One type serves reading and writing. Objects keep the order in which their keys were written. A scalar
/// read from a file keeps its text, so that an error can show what the user wrote.
class Value {
 public:
  enum class Kind { kNull, kBool, kNumber, kString, kArray, kObject };

  struct Member;

  // Defined where Member is complete: the members are a vector of it.
  Value();
  Value(const Value& other);
  Value(Value&& other) noexcept;
  Value& operator=(const Value& other);
  Value& operator=(Value&& other) noexcept;
  ~Value();

  Value(bool value);                    // NOLINT: conversions are the point
  Value(double value);                  // NOLINT
  Value(int value);                     // NOLINT
  Value(int64_t value);                 // NOLINT
  Value(uint64_t value);                // NOLINT
  Value(std::string value);             // NOLINT
  Value(std::string_view value);        // NOLINT
  Value(const char* value);             // NOLINT
  Value(const Eigen::VectorXd& value);  // NOLINT
  static Value Array() { return Value(Kind::kArray); }
  static Value Object() { return Value(Kind::kObject); }

  Kind kind() const { return kind_; }
  bool is_null() const { return kind_ == Kind::kNull; }
  bool is_object() const { return kind_ == Kind::kObject; }
  bool is_array() const { return kind_ == Kind::kArray; }
  bool is_scalar() const { return !is_object() && !is_array() && !is_null(); }
  /// "a map", "a list", "text" …, for error messages.
  std::string KindName() const;

  const Location& where() const { return where_; }
  void set_where(Location where) { where_ = std::move(where); }

  /// The scalar as written, or the value formatted; empty for arrays and objects.
  std::string AsText() const;
  double number() const { return number_; }
  bool boolean() const { return number_ != 0; }
  bool is_integer() const { return is_integer_; }
  int64_t integer() const { return integer_; }

  const std::vector<Value>& items() const { return items_; }
  void Append(Value value) { items_.push_back(std::move(value)); }

  const std::vector<Member>& members() const;
  /// The member with this key, or null.
  const Value* Find(std::string_view key) const;
  /// Adds a member, or replaces the one that has the key. `where` is the key's place, if it has one. Returns
  /// *this, for chaining.
  Value& Set(std::string_view key, Value value, Location where = {});

 private:
  friend class YamlReader;
  explicit Value(Kind kind);

  Kind kind_ = Kind::kNull;
  bool is_integer_ = false;
  int64_t integer_ = 0;
  double number_ = 0;
  std::string text_;
  std::vector<Value> items_;
  std::vector<Member> members_;
  Location where_;
};

struct Value::Member {
  std::string key;
  Location where;  ///< Of the key.
  Value value;
};

/// Parses YAML (JSON is a part of it). `file` names the text in errors. Throws InputError, with the place, on
/// malformed text, a key that is given twice, or an alias to an anchor that is not there.
Value ParseYaml(std::string_view text, const std::string& file);

/// Reads and parses a file. Throws InputError if it can't be read.
Value ReadYaml(const std::string& path);

/// The document as JSON. Numbers are written with the fewest digits that read back to the same double;
/// numbers that are not finite become null, since JSON has no word for them.
std::string WriteJson(const Value& value, int indent = 2);

/// The whole file as text. Throws InputError if it can't be read.
std::string ReadFile(const std::string& path);
/// Writes a file in one step (a temporary one, renamed). Throws InputError if it can't be written.
void WriteFile(const std::string& path, std::string_view text);

}  // namespace tether
