#include <sstream>

#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/exceptions.h>
#include <yaml-cpp/mark.h>
#include <yaml-cpp/parser.h>

#include "tether/common/document/utf8.h"
#include "tether/common/document/value_builder.h"
#include "tether/common/file.h"

namespace tether {
namespace {

Location PlaceOf(const YAML::Mark& mark, const std::string& file) {
  if (mark.is_null()) return {file, 0, 0};
  return {file, mark.line + 1, mark.column + 1};
}

/// Turns yaml-cpp's events into values.
class Events : public YAML::EventHandler {
 public:
  explicit Events(std::string file) : file_(std::move(file)) {}

  Value Take() { return builder_.Take(); }

  void OnDocumentStart(const YAML::Mark& mark) override {
    if (begun_) {
      throw InputError({{PlaceOf(mark, file_), "a second document, or text after the end of the first",
                         "one document a file"}});
    }
    begun_ = true;
  }
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark& mark, YAML::anchor_t anchor) override {
    Value value;
    value.set_where(PlaceOf(mark, file_));
    builder_.Add(std::move(value), anchor);
  }
  void OnAlias(const YAML::Mark& mark, YAML::anchor_t anchor) override {
    builder_.Alias(anchor, PlaceOf(mark, file_));
  }
  void OnScalar(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                const std::string& text) override {
    // Quoted scalars have the tag "!"; they are text whatever they look like.
    const bool quoted = tag == "!" || tag == "tag:yaml.org,2002:str";
    Value value = quoted ? Value(text) : Value::FromText(text);
    value.set_where(PlaceOf(mark, file_));
    builder_.Add(std::move(value), anchor);
  }
  void OnSequenceStart(const YAML::Mark& mark, const std::string&, YAML::anchor_t anchor,
                       YAML::EmitterStyle::value) override {
    builder_.Begin(Value::Kind::kArray, PlaceOf(mark, file_), anchor);
  }
  void OnSequenceEnd() override { builder_.End(); }
  void OnMapStart(const YAML::Mark& mark, const std::string&, YAML::anchor_t anchor,
                  YAML::EmitterStyle::value) override {
    builder_.Begin(Value::Kind::kObject, PlaceOf(mark, file_), anchor);
  }
  void OnMapEnd() override { builder_.End(); }

 private:
  std::string file_;
  ValueBuilder builder_;
  bool begun_ = false;
};

void RequireText(std::string_view text, const std::string& file) {
  int line = 1;
  size_t line_begin = 0;
  for (size_t i = 0; i < text.size();) {
    const auto first = static_cast<unsigned char>(text[i]);
    // One of the control characters ends a document for yaml-cpp.
    const bool control = first < 0x20 && (first < '\t' || first > '\r');
    const size_t length = control ? 0 : Utf8Length(text.substr(i));
    if (length == 0) {
      constexpr const char* kDigits = "0123456789abcdef";
      throw InputError(
          {{Location{file, line, static_cast<int>(i - line_begin) + 1},
            std::string("the byte 0x") + kDigits[first >> 4] + kDigits[first & 15] + " is no part of a text",
            "text in UTF-8"}});
    }
    if (text[i] == '\n') {
      ++line;
      line_begin = i + 1;
    }
    i += length;
  }
}

}  // namespace

Value ParseYaml(std::string_view text, const std::string& file) {
  RequireText(text, file);
  // JSON is YAML, but yaml-cpp accepts no key of more than 1,024 characters.
  Value value;
  if (ParseStrictJson(text, file, &value)) return value;
  Events events(file);
  std::istringstream stream{std::string(text)};
  try {
    YAML::Parser parser(stream);
    while (parser.HandleNextDocument(events)) {
    }
  } catch (const YAML::Exception& error) {
    throw InputError({{PlaceOf(error.mark, file), "not valid YAML: " + error.msg, ""}});
  }
  return events.Take();
}

Value ReadYaml(const std::string& path) { return ParseYaml(ReadFile(path), path); }

}  // namespace tether
