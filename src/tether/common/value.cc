#include "tether/common/value.h"

#include <charconv>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <sstream>

#include <yaml-cpp/yaml.h>

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
    : kind_(Kind::kNumber), is_integer_(true), integer_(value), number_(static_cast<double>(value)) {}
Value::Value(int value) : Value(static_cast<int64_t>(value)) {}
Value::Value(uint64_t value) : Value(static_cast<int64_t>(value)) {}
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
      return is_integer_ ? std::to_string(integer_) : FormatNumber(number_);
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

/// Turns yaml-cpp's nodes into values. A friend of Value, so that scalars keep their text.
class YamlReader {
 public:
  explicit YamlReader(std::string file) : file_(std::move(file)) {}

  Value Convert(const YAML::Node& node) const {
    Value value;
    if (node.IsMap()) {
      value = Value::Object();
      for (const auto& pair : node) {
        const std::string key = pair.first.IsScalar() ? pair.first.Scalar() : std::string("?");
        const Location where = Where(pair.first);
        if (value.Find(key) != nullptr) {
          throw InputError({{where, "key '" + key + "' is given twice", "each key once"}});
        }
        value.members_.push_back({key, where, Convert(pair.second)});
      }
    } else if (node.IsSequence()) {
      value = Value::Array();
      for (const auto& item : node) value.items_.push_back(Convert(item));
    } else if (node.IsScalar()) {
      value = ConvertScalar(node);
    }
    value.where_ = Where(node);
    return value;
  }

  Location Where(const YAML::Node& node) const { return Where(node.Mark()); }
  Location Where(const YAML::Mark& mark) const {
    if (mark.is_null()) return {file_, 0, 0};
    return {file_, mark.line + 1, mark.column + 1};
  }

 private:
  static Value ConvertScalar(const YAML::Node& node) {
    const std::string& text = node.Scalar();
    // yaml-cpp tags quoted scalars "!"; they are text whatever they look like.
    if (node.Tag() == "!") return Value(text);
    Value value(text);
    if (text == "true" || text == "false") {
      value.kind_ = Value::Kind::kBool;
      value.number_ = text == "true" ? 1 : 0;
      return value;
    }
    const char* begin = text.data() + (text.starts_with("+") ? 1 : 0);
    const char* end = text.data() + text.size();
    int64_t integer = 0;
    if (const auto result = std::from_chars(begin, end, integer);
        result.ec == std::errc() && result.ptr == end) {
      value.kind_ = Value::Kind::kNumber;
      value.is_integer_ = true;
      value.integer_ = integer;
      value.number_ = static_cast<double>(integer);
      return value;
    }
    double number = 0;
    if (text == ".inf" || text == "+.inf" || text == "-.inf" || text == ".nan") {
      value.kind_ = Value::Kind::kNumber;
      value.number_ = text == ".nan" ? NAN : (text[0] == '-' ? -INFINITY : INFINITY);
    } else if (const auto result = std::from_chars(begin, end, number); result.ptr == end && begin != end) {
      value.kind_ = Value::Kind::kNumber;
      value.number_ = result.ec == std::errc() ? number : INFINITY;
    }
    return value;
  }

  std::string file_;
};

Value ParseYaml(std::string_view text, const std::string& file) {
  const YamlReader reader(file);
  try {
    return reader.Convert(YAML::Load(std::string(text)));
  } catch (const YAML::Exception& error) {
    throw InputError({{reader.Where(error.mark), "not valid YAML: " + error.msg, ""}});
  }
}

Value ReadYaml(const std::string& path) { return ParseYaml(ReadFile(path), path); }

std::string ReadFile(const std::string& path) {
  std::ifstream stream(path, std::ios::binary);
  std::ostringstream text;
  if (!stream || !(text << stream.rdbuf())) {
    if (stream && stream.peek() == std::ifstream::traits_type::eof()) return "";
    throw InputError({{Location{path, 0, 0}, "cannot read this file", "a path to a readable file"}});
  }
  return text.str();
}

void WriteFile(const std::string& path, std::string_view text) {
  const std::string temporary = path + ".part";
  std::ofstream stream(temporary, std::ios::binary);
  stream << text;
  stream.close();
  if (!stream || std::rename(temporary.c_str(), path.c_str()) != 0) {
    throw InputError({{Location{path, 0, 0}, "cannot write this file", "a path in a writable folder"}});
  }
}

namespace {

void WriteString(std::string_view text, std::string& out) {
  out += '"';
  for (char c : text) {
    switch (c) {
      case '"':
        out += "\\\"";
        break;
      case '\\':
        out += "\\\\";
        break;
      case '\n':
        out += "\\n";
        break;
      case '\t':
        out += "\\t";
        break;
      case '\r':
        out += "\\r";
        break;
      default:
        if (static_cast<unsigned char>(c) < 0x20) {
          char buffer[8];
          std::snprintf(buffer, sizeof buffer, "\\u%04x", c);
          out += buffer;
        } else {
          out += c;
        }
    }
  }
  out += '"';
}

bool IsFlat(const Value& value) {
  for (const Value& item : value.items()) {
    if (!item.is_scalar() && !item.is_null()) return false;
  }
  return true;
}

void WriteJson(const Value& value, int indent, int depth, std::string& out) {
  const auto new_line = [&](int level) {
    if (indent <= 0) return;
    out += '\n';
    out.append(static_cast<size_t>(indent * level), ' ');
  };
  switch (value.kind()) {
    case Value::Kind::kNull:
      out += "null";
      break;
    case Value::Kind::kBool:
      out += value.boolean() ? "true" : "false";
      break;
    case Value::Kind::kNumber:
      if (value.is_integer()) {
        out += std::to_string(value.integer());
      } else {
        out += std::isfinite(value.number()) ? FormatNumber(value.number()) : std::string("null");
      }
      break;
    case Value::Kind::kString:
      WriteString(value.AsText(), out);
      break;
    case Value::Kind::kArray: {
      const bool flat = IsFlat(value);
      out += '[';
      for (size_t i = 0; i < value.items().size(); ++i) {
        if (i > 0) out += flat && indent > 0 ? ", " : ",";
        if (!flat) new_line(depth + 1);
        WriteJson(value.items()[i], indent, depth + 1, out);
      }
      if (!flat) new_line(depth);
      out += ']';
      break;
    }
    case Value::Kind::kObject: {
      out += '{';
      bool first = true;
      for (const Value::Member& member : value.members()) {
        if (!first) out += ',';
        first = false;
        new_line(depth + 1);
        WriteString(member.key, out);
        out += indent > 0 ? ": " : ":";
        WriteJson(member.value, indent, depth + 1, out);
      }
      if (!first) new_line(depth);
      out += '}';
      break;
    }
  }
}

}  // namespace

std::string WriteJson(const Value& value, int indent) {
  std::string out;
  WriteJson(value, indent, 0, out);
  if (indent > 0) out += '\n';
  return out;
}

}  // namespace tether
