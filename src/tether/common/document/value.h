#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "tether/common/error.h"

namespace tether {

/// A node of a YAML or JSON document, with its place in the file.
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
  /// The value of an unquoted scalar of YAML or a literal of JSON: true, false, a number, else text. Keeps
  /// `text`.
  static Value FromText(std::string text);
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
  /// A whole number from −2^63 to 2^63 − 1, which integer() gives exactly.
  bool is_integer() const { return whole_ == Whole::kSigned; }
  int64_t integer() const { return integer_; }
  /// A whole number from 0 to 2^64 − 1, exactly; none otherwise.
  std::optional<uint64_t> natural() const;

  const std::vector<Value>& items() const { return items_; }
  void Append(Value value) { items_.push_back(std::move(value)); }
  /// Adds a member whose key must be new.
  void AppendMember(std::string key, Location where, Value value);

  const std::vector<Member>& members() const;
  /// The member with this key, or null.
  const Value* Find(std::string_view key) const;
  /// Adds a member, or replaces the one that has the key. `where` is the key's place, if it has one. Returns
  /// *this, for chaining.
  Value& Set(std::string_view key, Value value, Location where = {});

 private:
  enum class Whole : uint8_t { kNo, kSigned, kUnsigned };  // How integer_ is to be read.
  explicit Value(Kind kind);

  Kind kind_ = Kind::kNull;
  Whole whole_ = Whole::kNo;
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

/// Bounds of a document. Beyond them it is refused: a few hundred bytes of aliases within aliases would
/// otherwise fill any memory.
inline constexpr int kMaxDepth = 200;                 ///< Lists and maps within each other.
inline constexpr size_t kMaxValues = 4'000'000;       ///< All together.
inline constexpr size_t kMaxAliasedValues = 100'000;  ///< Of those, copies made by aliases.

/// Parses YAML (JSON is a part of it): one document, in UTF-8. `file` names the text in errors. Throws
/// InputError, with the place, on malformed text, a second document, a key that is given twice or is no text,
/// an alias to an anchor that is not there or that it is part of, and beyond the bounds above.
Value ParseYaml(std::string_view text, const std::string& file);

/// Reads and parses a file. Throws InputError if it can't be read.
Value ReadYaml(const std::string& path);

/// The document as JSON. Numbers are written with the fewest digits that read back to the same double;
/// numbers that are not finite become null, since JSON has no word for them. ParseYaml() reads it back.
std::string WriteJson(const Value& value, int indent = 2);

}  // namespace tether
