#include <algorithm>
#include <cctype>
#include <regex>

#include "structure/source_tree.h"

namespace tether::structure {
namespace {

bool IsSource(const File& file) { return file.path.ends_with(".h") || file.path.ends_with(".cc"); }

/// The text with comments, literals and directives blanked; lines stay where they are.
std::string KeepCode(const std::string& text) {
  std::string code = text;
  const auto blank = [&](size_t from, size_t to) {
    for (size_t i = from; i < std::min(to, code.size()); ++i) {
      if (code[i] != '\n') code[i] = ' ';
    }
    return to;
  };
  bool line_begins = true;
  for (size_t i = 0; i < code.size();) {
    const char c = code[i];
    if (c == '#' && line_begins) {
      i = blank(i, text.find('\n', i));
    } else if (text.compare(i, 2, "//") == 0) {
      i = blank(i, text.find('\n', i));
    } else if (text.compare(i, 2, "/*") == 0) {
      i = blank(i, text.find("*/", i) + 2);
    } else if (text.compare(i, 2, "R\"") == 0) {
      const size_t open = text.find('(', i);
      const std::string close = ")" + text.substr(i + 2, open - i - 2) + "\"";
      i = blank(i, text.find(close, open) + close.size());
    } else if (c == '"' ||
               (c == '\'' && (i == 0 || std::isalnum(static_cast<unsigned char>(text[i - 1])) == 0))) {
      size_t end = i + 1;
      while (end < text.size() && text[end] != c) end += text[end] == '\\' ? 2 : 1;
      i = blank(i, end + 1);
    } else {
      line_begins = c == '\n' || (line_begins && c == ' ');
      ++i;
    }
  }
  return code;
}

/// Whether a statement that opens a brace, in a namespace or class, begins a function.
bool BeginsFunction(const std::string& statement) {
  static const std::regex kType(R"(^\s*(template\s*<.*>\s*)?(class|struct|enum|union)\b[^(]*$)");
  static const std::regex kInitializer(R"(=\s*$)");
  return statement.find('(') != std::string::npos && !std::regex_search(statement, kType) &&
         !std::regex_search(statement, kInitializer);
}

bool HoldsDeclarations(const std::string& statement) {
  static const std::regex kScope(
      R"(^\s*((inline\s+)?namespace\b|extern\b|(template\s*<.*>\s*)?(class|struct|union)\b))");
  return std::regex_search(statement, kScope);
}

}  // namespace

Findings CheckFileLengths(const std::vector<File>& files, int most) {
  Findings findings;
  for (const File& file : files) {
    if (!IsSource(file)) continue;
    const auto lines = static_cast<int>(std::count(file.text.begin(), file.text.end(), '\n'));
    if (lines <= most || file.text.starts_with("// Long: ")) continue;
    findings.push_back(file.path + " has " + std::to_string(lines) + " lines, more than " +
                       std::to_string(most) + ", and no reason on its first line: // Long: …");
  }
  return findings;
}

Findings CheckFunctionLengths(const std::vector<File>& files, int most) {
  Findings findings;
  for (const File& file : files) {
    if (!IsSource(file)) continue;
    struct Scope {
      bool function, declarations;
      int line;
    };
    std::vector<Scope> scopes;
    std::string statement;
    int line = 1, begin = 0;
    for (const char c : KeepCode(file.text)) {
      if (c == '\n') ++line;
      if (c == '{') {
        const bool outside =
            std::all_of(scopes.begin(), scopes.end(), [](const Scope& scope) { return scope.declarations; });
        const bool function = outside && BeginsFunction(statement);
        scopes.push_back({function, outside && !function && HoldsDeclarations(statement), begin});
      } else if (c == '}' && !scopes.empty()) {
        const int length = line - scopes.back().line + 1;
        if (scopes.back().function && length > most) {
          findings.push_back(file.path + ":" + std::to_string(scopes.back().line) + ": a function of " +
                             std::to_string(length) + " lines, more than " + std::to_string(most));
        }
        scopes.pop_back();
      }
      if (c == '{' || c == '}' || c == ';') {
        statement.clear();
      } else if (!statement.empty() || std::isspace(static_cast<unsigned char>(c)) == 0) {
        if (statement.empty()) begin = line;
        statement += c == '\n' ? ' ' : c;
      }
    }
  }
  return findings;
}

}  // namespace tether::structure
