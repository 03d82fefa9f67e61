#include "mutate.h"

#include <algorithm>
#include <cctype>
#include <iterator>

namespace tether::fuzz {
namespace {

using namespace std::string_literals;

const std::string kNumbers[] = {"0",
                                "-0",
                                "1",
                                "-1",
                                "2",
                                "3",
                                "7",
                                "100",
                                "1000",
                                "99999",
                                "0.5",
                                "1e-9",
                                "1e-300",
                                "1e308",
                                "-1e308",
                                "1e309",
                                "1e9",
                                "1e5",
                                "10000",
                                "1e99",
                                ".nan",
                                "nan",
                                ".inf",
                                "-.inf",
                                "inf",
                                "0x10",
                                "1_000",
                                "1.",
                                ".5",
                                "2147483647",
                                "-2147483648",
                                "4294967296",
                                "1,5",
                                "٣",
                                "6.28",
                                "1.571",
                                "-1e-9",
                                "0.001",
                                "1e-320",
                                "9223372036854775808",
                                "-9223372036854775808",
                                "18446744073709551615",
                                "123456789012345678901234567890"};
const std::string kPieces[] = {"(",
                               ")",
                               "[",
                               "]",
                               "{",
                               "}",
                               ",",
                               ":",
                               "\"",
                               "'",
                               "\\",
                               "#",
                               "&a ",
                               "*a",
                               "!",
                               "!!",
                               "%",
                               "|",
                               ">",
                               "- ",
                               ": ",
                               "\n",
                               "\n\n",
                               "---\n",
                               "...\n",
                               "? ",
                               "@",
                               "`",
                               "\t",
                               "\r\n",
                               "\0"s,
                               "\xff",
                               "\xc3",
                               "\xef\xbb\xbf",
                               "é",
                               "\u2028",
                               "&a [*a]",
                               "[&a [1, 1], &b [*a, *a, *a, *a], &c [*b, *b, *b, *b]]",
                               "<<: *a",
                               "~",
                               "null",
                               "true",
                               "no",
                               "\\u0000",
                               "!!binary ",
                               "!!int ",
                               "[[[[",
                               "((((",
                               "{a: {a: {a: ",
                               "]]]]",
                               "))))",
                               "[]",
                               "{}",
                               "()",
                               "->",
                               "<->",
                               " U ",
                               " X ",
                               "not ",
                               "and ",
                               "?x",
                               "/",
                               "../",
                               "world",
                               "\x1b[31m"};

int Below(size_t count, Random& random) { return random.Index(static_cast<int>(std::max<size_t>(count, 1))); }

template <class List>
const std::string& Pick(const List& list, Random& random) {
  return list[static_cast<size_t>(Below(std::size(list), random))];
}

struct Range {
  size_t begin = 0, end = 0;
  size_t size() const { return end - begin; }
};

bool IsWord(char c) {
  return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_' || c == '-' || c == '.' || c == '+';
}

/// A word of the text, from a random place on: letters and digits, or a number with its sign and point.
Range FindWord(const std::string& text, bool number, Random& random) {
  const size_t start = static_cast<size_t>(Below(text.size(), random));
  for (size_t offset = 0; offset < text.size(); ++offset) {
    const size_t at = (start + offset) % text.size();
    if (!IsWord(text[at]) || (at > 0 && IsWord(text[at - 1]))) continue;
    size_t end = at;
    while (end < text.size() && IsWord(text[end])) ++end;
    const size_t first = text.find_first_not_of("+-.", at);
    const bool is_number = first < end && std::isdigit(static_cast<unsigned char>(text[first])) != 0;
    if (!number || is_number) return {at, end};
  }
  return {};
}

Range FindLines(const std::string& text, Random& random) {
  const size_t at = static_cast<size_t>(Below(text.size(), random));
  const size_t before = at == 0 ? std::string::npos : text.rfind('\n', at - 1);
  Range lines{before == std::string::npos ? 0 : before + 1, at};
  for (int more = random.Index(3) == 0 ? 1 + random.Index(6) : 1; more > 0 && lines.end < text.size(); --more)
    lines.end = std::min(text.find('\n', lines.end), text.size() - 1) + 1;
  return lines;
}

/// From an opening bracket to the one that closes it, or a few bytes where there is none.
Range FindGroup(const std::string& text, Random& random) {
  const size_t start = static_cast<size_t>(Below(text.size(), random));
  const size_t open = text.find_first_of("([{", start);
  if (open == std::string::npos)
    return {start, std::min(text.size(), start + 1 + static_cast<size_t>(random.Index(30)))};
  int depth = 0;
  for (size_t at = open; at < text.size(); ++at) {
    if (text[at] == '(' || text[at] == '[' || text[at] == '{') ++depth;
    if (text[at] == ')' || text[at] == ']' || text[at] == '}') --depth;
    if (depth == 0) return {open, at + 1};
  }
  return {open, text.size()};
}

std::string Repeat(const std::string& piece, int times) {
  std::string all;
  for (int i = 0; i < times && all.size() + piece.size() <= kMostBytes; ++i) all += piece;
  return all;
}

void MutateOnce(std::string& text, const std::vector<std::string>& corpus, Random& random) {
  if (text.empty()) text = Pick(corpus, random);
  if (text.empty()) text = Pick(kPieces, random);
  const size_t at = static_cast<size_t>(Below(text.size() + 1, random));
  const auto replace = [&](Range range, const std::string& by) {
    text.replace(range.begin, range.size(), by);
  };
  switch (random.Index(16)) {
    case 0:
    case 1:
    case 2:
      return replace(FindWord(text, true, random), Pick(kNumbers, random));
    case 3: {  // the digits of a number, or its sign
      const Range word = FindWord(text, true, random);
      if (word.size() > 0)
        text[word.begin + static_cast<size_t>(Below(word.size(), random))] =
            "0123456789.-e"[random.Index(13)];
      return;
    }
    case 4:
    case 5: {
      const std::string& other = random.Index(2) == 0 ? text : Pick(corpus, random);
      if (other.empty()) return;
      const Range from = FindWord(other, false, random);
      const std::string word = other.substr(from.begin, from.size());
      return replace(FindWord(text, false, random), word);
    }
    case 6:
      return replace(FindLines(text, random), "");
    case 7: {
      const Range lines = FindLines(text, random);
      text.insert(at, text.substr(lines.begin, lines.size()));
      return;
    }
    case 8: {
      const std::string& other = Pick(corpus, random);
      if (other.empty()) return;
      const Range lines = FindLines(other, random);
      const std::string piece = other.substr(lines.begin, lines.size());
      if (random.Index(2) == 0) {
        replace(FindLines(text, random), piece);
      } else {
        text.insert(at, piece);
      }
      return;
    }
    case 9: {  // a group in another's place
      const Range group = FindGroup(text, random);
      const std::string piece = text.substr(group.begin, group.size());
      return replace(FindGroup(text, random), piece);
    }
    case 10:
      return replace(FindGroup(text, random), random.Index(2) == 0 ? "" : "[]");
    case 11: {  // deeper, or longer
      const Range group = FindGroup(text, random);
      const std::string piece = text.substr(group.begin, group.size());
      const int times = random.Index(20) == 0 ? 3000 : 1 + random.Index(20);
      if (random.Index(2) == 0) return replace(group, Repeat(piece + " ", times));
      const std::string open = piece.empty() || IsWord(piece[0]) ? "[" : piece.substr(0, 1);
      return replace(group, Repeat(open, times) + piece +
                                Repeat(piece.empty() ? "]" : piece.substr(piece.size() - 1), times));
    }
    case 12:
      text.insert(at, Pick(kPieces, random));
      return;
    case 13:
      if (at < text.size()) text[at] = static_cast<char>(random.Index(256));
      return;
    case 14:
      if (at < text.size())
        text.erase(at, 1 + static_cast<size_t>(random.Index(random.Index(8) == 0 ? 200 : 4)));
      return;
    default:
      if (random.Index(4) == 0) {
        text.resize(at);
      } else {
        text.insert(at, Repeat(Pick(kPieces, random), 1 + random.Index(3)));
      }
  }
}

}  // namespace

std::string Mutate(const std::string& input, const std::vector<std::string>& corpus, Random& random) {
  std::string text = input;
  do {
    MutateOnce(text, corpus, random);
  } while (random.Index(2) == 0);
  if (text.size() > kMostBytes) text.resize(kMostBytes);
  return text;
}

}  // namespace tether::fuzz
