#include <charconv>
#include <cmath>
#include <cstdio>

#include "tether/common/document/utf8.h"
#include "tether/common/document/value.h"

namespace tether {
namespace {

void AppendWhole(const Value& value, std::string& out) {
  out += value.is_integer() ? std::to_string(value.integer()) : std::to_string(*value.natural());
}

void AppendNumber(double value, std::string& out) {
  char buffer[32];
  if (std::isfinite(value)) {
    out.append(buffer, std::to_chars(buffer, buffer + sizeof buffer, value).ptr);
  } else {
    out += "null";
  }
}

void WriteString(std::string_view text, std::string& out) {
  out += '"';
  for (size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (static_cast<unsigned char>(c) >= 0x80) {
      const size_t length = Utf8Length(text.substr(i));
      // JSON is UTF-8: what is none can't be written.
      out += length == 0 ? std::string_view("\\ufffd") : text.substr(i, length);
      i += length == 0 ? 0 : length - 1;
      continue;
    }
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
    out.append(indent * level, ' ');
  };
  switch (value.kind()) {
    case Value::Kind::kNull:
      out += "null";
      break;
    case Value::Kind::kBool:
      out += value.boolean() ? "true" : "false";
      break;
    case Value::Kind::kNumber:
      if (value.is_integer() || value.natural()) {
        AppendWhole(value, out);
      } else {
        AppendNumber(value.number(), out);
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
