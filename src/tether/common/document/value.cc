#include "tether/common/document/value.h"

#include <charconv>
#include <cmath>
#include <utility>

#include "tether/common/text.h"

namespace tether {

Value::Value() = default;
Value::Value(const Value& other) = default;
Value::Value(Value&& other) noexcept = default;
Value& Value::operator=(const Value& other) = default;
Value& Value::operator=(Value&& other) noexcept = default;
Value::~Value() = default;

Value::Value(Kind kind) : kind_(kind) {}
Value::Value(bool value) : kind_(Kind::kBool), number_(value ? 1 : 0) {}
Value::Value(double value) : kind_(Kind::kNumber), number_(value) {}
Value::Value(int64_t value)
    : kind_(Kind::kNumber), whole_(Whole::kSigned), integer_(value), number_(static_cast<double>(value)) {}
Value::Value(int value) : Value(static_cast<int64_t>(value)) {}
Value::Value(uint64_t value)
    : kind_(Kind::kNumber),
      whole_(value > static_cast<uint64_t>(INT64_MAX) ? Whole::kUnsigned : Whole::kSigned),
      integer_(static_cast<int64_t>(value)),
      number_(static_cast<double>(value)) {}
Value::Value(std::string value) : kind_(Kind::kString), text_(std::move(value)) {}
Value::Value(std::string_view value) : Value(std::string(value)) {}
Value::Value(const char* value) : Value(std::string(value)) {}
Value::Value(const Eigen::VectorXd& value) : kind_(Kind::kArray) {
  for (double entry : value) items_.emplace_back(entry);
}

std::string Value::KindName() const {
  switch (kind_) {
    case Kind::kNull:
      return "nothing";
    case Kind::kBool:
      return "true or false";
    case Kind::kNumber:
      return "a number";
    case Kind::kString:
      return "text";
    case Kind::kArray:
      return "a list";
    case Kind::kObject:
      return "a map";
  }
  return "nothing";
}

namespace {

std::string FormatNumber(double value) {
  char buffer[32];
  const auto [end, error] = std::to_chars(buffer, buffer + sizeof buffer, value);
  return error == std::errc() ? std::string(buffer, end) : std::string("0");
}

}  // namespace

std::string Value::AsText() const {
  if (!text_.empty() || kind_ == Kind::kString) return text_;
  switch (kind_) {
    case Kind::kBool:
      return boolean() ? "true" : "false";
    case Kind::kNumber:
      if (whole_ == Whole::kUnsigned) return std::to_string(static_cast<uint64_t>(integer_));
      return is_integer() ? std::to_string(integer_) : FormatNumber(number_);
    default:
      return "";
  }
}

const std::vector<Value::Member>& Value::members() const { return members_; }

const Value* Value::Find(std::string_view key) const {
  for (const Member& member : members_) {
    if (member.key == key) return &member.value;
  }
  return nullptr;
}

Value& Value::Set(std::string_view key, Value value, Location where) {
  for (Member& member : members_) {
    if (member.key == key) {
      member.value = std::move(value);
      member.where = std::move(where);
      return *this;
    }
  }
  members_.push_back({std::string(key), std::move(where), std::move(value)});
  return *this;
}

std::optional<uint64_t> Value::natural() const {
  if (whole_ == Whole::kUnsigned || (whole_ == Whole::kSigned && integer_ >= 0))
    return static_cast<uint64_t>(integer_);
  return std::nullopt;
}

void Value::AppendMember(std::string key, Location where, Value value) {
  members_.push_back({std::move(key), std::move(where), std::move(value)});
}

namespace {

/// As ParseNumber(), and YAML's words for what is not finite.
bool ParseYamlNumber(std::string_view text, double* number) {
  if (text == ".nan") {
    *number = NAN;
  } else if (text == ".inf" || text == "+.inf" || text == "-.inf") {
    *number = text[0] == '-' ? -INFINITY : INFINITY;
  } else {
    return ParseNumber(text, number);
  }
  return true;
}

}  // namespace

Value Value::FromText(std::string text) {
  Value value(std::move(text));
  const std::string& word = value.text_;
  if (word == "true" || word == "false") {
    value.kind_ = Kind::kBool;
    value.number_ = word == "true" ? 1 : 0;
    return value;
  }
  const char* begin = word.data() + (word.starts_with("+") && !word.starts_with("+-") ? 1 : 0);
  const char* end = word.data() + word.size();
  uint64_t natural = 0;
  // "-0" is a double's zero: an integer has no sign to keep.
  if (const auto result = std::from_chars(begin, end, value.integer_);
      result.ec == std::errc() && result.ptr == end && !(value.integer_ == 0 && word.starts_with("-"))) {
    value.kind_ = Kind::kNumber;
    value.whole_ = Whole::kSigned;
    value.number_ = static_cast<double>(value.integer_);
  } else if (const auto beyond = std::from_chars(begin, end, natural);
             beyond.ec == std::errc() && beyond.ptr == end) {
    value.kind_ = Kind::kNumber;
    value.whole_ = Whole::kUnsigned;
    value.integer_ = static_cast<int64_t>(natural);
    value.number_ = static_cast<double>(natural);
  } else if (ParseYamlNumber(word, &value.number_)) {
    value.kind_ = Kind::kNumber;
    value.integer_ = 0;
  }
  return value;
}

}  // namespace tether
