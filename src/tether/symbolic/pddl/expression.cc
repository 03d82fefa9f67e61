#include "tether/symbolic/pddl/expression.h"

#include <algorithm>
#include <array>
#include <optional>
#include <utility>

namespace tether::symbolic {
namespace {

constexpr size_t kMaxNesting = 256;

constexpr std::array kSections = {":requirements", ":types",  ":constants", ":predicates",
                                  ":functions",    ":action", ":derived",   ":domain",
                                  ":objects",      ":init",   ":goal",      ":metric"};

bool IsSpace(char c) { return c == ' ' || c == '\t' || c == '\n' || c == '\r' || c == '\f' || c == '\v'; }

bool IsWordCharacter(char c) {
  const auto u = static_cast<unsigned char>(c);
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || u >= 0x80 ||
         std::string_view("-_?:=.+*/<>!#@&%$^~|").find(c) != std::string_view::npos;
}

std::string Describe(char c) {
  const auto u = static_cast<unsigned char>(c);
  if (u >= 0x20 && u < 0x7f) return std::string("'") + c + "'";
  return "byte " + std::to_string(u);
}

/// Walks through the text, counting lines and columns (one column per character, also in UTF-8).
class Scanner {
 public:
  Scanner(std::string_view text, const std::string& file) : text_(text), where_{file, 1, 1} {}

  /// Some editors write it at the beginning of a file; it is not part of the text.
  void SkipByteOrderMark() {
    if (text_.starts_with("\xEF\xBB\xBF")) at_ = 3;
  }

  bool done() const { return at_ >= text_.size(); }
  char peek() const { return text_[at_]; }
  const Location& where() const { return where_; }

  void Advance() {
    if (text_[at_] == '\n') {
      ++where_.line;
      where_.column = 1;
    } else if (at_ + 1 >= text_.size() || (static_cast<unsigned char>(text_[at_ + 1]) & 0xC0) != 0x80) {
      ++where_.column;
    }
    ++at_;
  }

  void SkipSpaceAndComments() {
    while (!done()) {
      if (peek() == ';') {
        while (!done() && peek() != '\n') Advance();
      } else if (IsSpace(peek())) {
        Advance();
      } else {
        return;
      }
    }
  }

 private:
  std::string_view text_;
  size_t at_ = 0;
  Location where_;
};

}  // namespace

std::string_view Expression::head() const {
  return is_list && !items.empty() && !items.front().is_list ? std::string_view(items.front().word)
                                                             : std::string_view();
}

std::string LowerCase(std::string_view text) {
  std::string lower(text);
  for (char& c : lower) {
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  }
  return lower;
}

namespace {

/// The message for a ')' after the last list of `done`, which ended at `last_close`, if there is one.
std::string DescribeExtraClose(const std::vector<Expression>& done, const Location& last_close) {
  std::string message = "one ')' too many";
  if (!done.empty() && done.back().is_list) {
    message += ": '(" + std::string(done.back().head()) + "' of " + done.back().where.ToString() +
               " is already closed by the ')' of " + last_close.ToString();
  }
  return message;
}

/// The message for lists that are still open where the text ends.
std::string DescribeMissingCloses(const std::vector<Expression>& open) {
  const Expression& unclosed = open.back();
  const std::string count = open.size() == 1 ? "a ')' is" : std::to_string(open.size()) + " ')' are";
  return count + " missing at the end: '(" + std::string(unclosed.head()) + "' of " +
         unclosed.where.ToString() + " is not closed";
}

}  // namespace

std::vector<Expression> ParseExpressions(std::string_view text, const std::string& file,
                                         Diagnostics& diagnostics) {
  Scanner scanner(text, file);
  std::vector<Expression> done;
  std::vector<Expression> open;
  std::optional<Diagnostic> suspect;  // A section inside a section: there a ')' was forgotten.
  Location last_close;
  bool readable = true;
  if (text.starts_with("\xFF\xFE") || text.starts_with("\xFE\xFF")) {
    diagnostics.Add(scanner.where(), "the file is in UTF-16", "accepted: UTF-8");
    return {};
  }
  scanner.SkipByteOrderMark();
  auto finish = [&](Expression expression) {
    (open.empty() ? done : open.back().items).push_back(std::move(expression));
  };

  for (scanner.SkipSpaceAndComments(); !scanner.done(); scanner.SkipSpaceAndComments()) {
    const Location where = scanner.where();
    const char c = scanner.peek();
    if (c == '(') {
      scanner.Advance();
      if (open.size() >= kMaxNesting) {
        diagnostics.Add(where, "parentheses are nested more than " + std::to_string(kMaxNesting) + " deep");
        return {};
      }
      open.push_back({true, "", {}, where});
    } else if (c == ')') {
      scanner.Advance();
      if (open.empty()) {
        diagnostics.Add(where, DescribeExtraClose(done, last_close));
        continue;
      }
      Expression list = std::move(open.back());
      open.pop_back();
      if (open.empty()) last_close = where;
      finish(std::move(list));
    } else if (IsWordCharacter(c)) {
      std::string word;
      // A '?' can't stand within a name, so that it begins a variable.
      while (!scanner.done() && IsWordCharacter(scanner.peek()) && (word.empty() || scanner.peek() != '?')) {
        word += scanner.peek();
        scanner.Advance();
      }
      if (!scanner.done() && scanner.peek() == '?')
        diagnostics.Warn(scanner.where(),
                         "a space is missing between '" + word + "' and the variable after it");
      const bool is_section =
          std::find(kSections.begin(), kSections.end(), LowerCase(word)) != kSections.end();
      if (!suspect && is_section && open.size() > 2 && open.back().items.empty()) {
        const Expression& unclosed = open[open.size() - 2];
        suspect = Diagnostic{open.back().where,
                             "a ')' is missing before '(" + word + "': '(" + std::string(unclosed.head()) +
                                 "' of " + unclosed.where.ToString() + " is not closed",
                             ""};
      }
      finish({false, std::move(word), {}, where});
    } else {
      diagnostics.Add(where, "unexpected " + Describe(c),
                      "accepted: names of letters, digits, '-' and '_', parentheses, and comments after ';'");
      readable = false;
      scanner.Advance();
    }
  }
  if (!open.empty()) {
    if (suspect) {
      diagnostics.Add(suspect->where, suspect->message);
    } else {
      diagnostics.Add(scanner.where(), DescribeMissingCloses(open));
    }
    readable = false;
  }
  return readable ? done : std::vector<Expression>{};
}

}  // namespace tether::symbolic
