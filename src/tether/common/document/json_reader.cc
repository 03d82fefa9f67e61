#include <cstdint>
#include <utility>

#include "tether/common/document/value_builder.h"

namespace tether {
namespace {

/// A recursive descent; ValueBuilder bounds its depth.
class JsonReader {
 public:
  JsonReader(std::string_view text, const std::string& file) : text_(text), file_(file) {}

  bool Read(Value* value) {
    SkipSpace();
    // Anything else is left to YAML, whose reader has better messages.
    if (!Sees('{') && !Sees('[')) return false;
    if (!ReadValue()) return false;
    SkipSpace();
    if (at_ != text_.size()) return false;
    *value = builder_.Take();
    return true;
  }

 private:
  bool Sees(char c) const { return at_ < text_.size() && text_[at_] == c; }
  bool Skip(char c) {
    if (!Sees(c)) return false;
    ++at_;
    return true;
  }
  void SkipSpace() {
    for (; at_ < text_.size(); ++at_) {
      const char c = text_[at_];
      if (c == '\n') {
        ++line_;
        line_begin_ = at_ + 1;
      } else if (c != ' ' && c != '\t' && c != '\r') {
        return;
      }
    }
  }
  Location Here() const { return {file_, line_, static_cast<int>(at_ - line_begin_) + 1}; }

  bool ReadValue() {
    SkipSpace();
    if (Sees('{')) return ReadContainer(Value::Kind::kObject, '}');
    if (Sees('[')) return ReadContainer(Value::Kind::kArray, ']');
    if (Sees('"')) return ReadString();
    const Location where = Here();
    const size_t begin = at_;
    while (at_ < text_.size() &&
           std::string_view(",]}: \t\r\n\"[{").find(text_[at_]) == std::string_view::npos)
      ++at_;
    const std::string_view word = text_.substr(begin, at_ - begin);
    if (word != "null" && word != "true" && word != "false" && !IsNumber(word)) return false;
    Value value = word == "null" ? Value() : Value::FromText(std::string(word));
    value.set_where(where);
    builder_.Add(std::move(value));
    return true;
  }

  bool ReadContainer(Value::Kind kind, char end) {
    builder_.Begin(kind, Here());
    ++at_;
    SkipSpace();
    if (!Sees(end)) {
      do {
        if (kind == Value::Kind::kObject) {
          SkipSpace();
          if (!ReadString()) return false;
          SkipSpace();
          if (!Skip(':')) return false;
        }
        if (!ReadValue()) return false;
        SkipSpace();
      } while (Skip(','));
    }
    if (!Skip(end)) return false;
    builder_.End();
    return true;
  }

  static bool IsNumber(std::string_view word) {
    size_t i = 0;
    const auto digits = [&] {
      const size_t begin = i;
      while (i < word.size() && word[i] >= '0' && word[i] <= '9') ++i;
      return i - begin;
    };
    if (i < word.size() && word[i] == '-') ++i;
    const bool zero = i < word.size() && word[i] == '0';
    const size_t whole = digits();
    if (whole == 0 || (zero && whole > 1)) return false;
    if (i < word.size() && word[i] == '.') {
      ++i;
      if (digits() == 0) return false;
    }
    if (i < word.size() && (word[i] == 'e' || word[i] == 'E')) {
      ++i;
      if (i < word.size() && (word[i] == '+' || word[i] == '-')) ++i;
      if (digits() == 0) return false;
    }
    return i == word.size();
  }

  /// A value, or a key where one is expected.
  bool ReadString() {
    const Location where = Here();
    if (!Skip('"')) return false;
    std::string text;
    while (!Sees('"')) {
      if (at_ >= text_.size() || static_cast<unsigned char>(text_[at_]) < 0x20) return false;
      if (text_[at_] != '\\') {
        text += text_[at_++];
      } else if (!ReadEscape(text)) {
        return false;
      }
    }
    ++at_;
    Value value(std::move(text));
    value.set_where(where);
    builder_.Add(std::move(value));
    return true;
  }

  bool ReadEscape(std::string& text) {
    if (++at_ >= text_.size()) return false;
    const char c = text_[at_++];
    constexpr std::string_view kNames = "\"\\/bfnrt", kMeanings = "\"\\/\b\f\n\r\t";
    if (const size_t found = kNames.find(c); found != std::string_view::npos) {
      text += kMeanings[found];
      return true;
    }
    uint32_t code = 0, low = 0;
    if (c != 'u' || !ReadHex(&code)) return false;
    if (code >= 0xd800 && code < 0xe000) {
      // Characters beyond 16 bits are written as two of these.
      if (code >= 0xdc00 || !Skip('\\') || !Skip('u') || !ReadHex(&low) || low < 0xdc00 || low >= 0xe000)
        return false;
      code = 0x10000 + ((code - 0xd800) << 10) + (low - 0xdc00);
    }
    AppendUtf8(code, text);
    return true;
  }

  bool ReadHex(uint32_t* code) {
    if (text_.size() - at_ < 4) return false;
    for (int i = 0; i < 4; ++i) {
      const char c = text_[at_++];
      const int digit = c >= '0' && c <= '9'   ? c - '0'
                        : c >= 'a' && c <= 'f' ? c - 'a' + 10
                        : c >= 'A' && c <= 'F' ? c - 'A' + 10
                                               : -1;
      if (digit < 0) return false;
      *code = *code * 16 + static_cast<uint32_t>(digit);
    }
    return true;
  }

  static void AppendUtf8(uint32_t code, std::string& text) {
    const auto append = [&](uint32_t byte) { text += static_cast<char>(byte); };
    if (code < 0x80) {
      append(code);
      return;
    }
    if (code < 0x800) {
      append(0xc0 | (code >> 6));
    } else {
      if (code < 0x10000) {
        append(0xe0 | (code >> 12));
      } else {
        append(0xf0 | (code >> 18));
        append(0x80 | ((code >> 12) & 0x3f));
      }
      append(0x80 | ((code >> 6) & 0x3f));
    }
    append(0x80 | (code & 0x3f));
  }

  std::string_view text_;
  const std::string& file_;
  ValueBuilder builder_;
  size_t at_ = 0, line_begin_ = 0;
  int line_ = 1;
};

}  // namespace

bool ParseStrictJson(std::string_view text, const std::string& file, Value* value) {
  return JsonReader(text, file).Read(value);
}

}  // namespace tether
