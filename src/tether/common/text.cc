#include "tether/common/text.h"

#include <locale.h>  // NOLINT: newlocale() is POSIX

#include <charconv>
#include <cmath>
#include <cstdarg>
#include <cstdio>

namespace tether {

PlainLocale::PlainLocale() {
  static const locale_t plain = newlocale(LC_ALL_MASK, "C", nullptr);
  before_ = uselocale(plain);
}
PlainLocale::~PlainLocale() { uselocale(static_cast<locale_t>(before_)); }

std::string Format(const char* format, ...) {
  const PlainLocale plain;
  std::va_list arguments, again;
  va_start(arguments, format);
  va_copy(again, arguments);
  const int length = std::vsnprintf(nullptr, 0, format, arguments);
  va_end(arguments);
  std::string text(length > 0 ? static_cast<size_t>(length) : 0, '\0');
  std::vsnprintf(text.data(), text.size() + 1, format, again);
  va_end(again);
  return text;
}

int FormatInto(char* buffer, size_t size, const char* format, ...) {
  const PlainLocale plain;
  std::va_list arguments;
  va_start(arguments, format);
  const int length = std::vsnprintf(buffer, size, format, arguments);
  va_end(arguments);
  return length;
}

bool ParseNumber(std::string_view text, double* number) {
  if (text.starts_with("+-")) return false;
  if (text.starts_with('+')) text.remove_prefix(1);
  double read = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), read);
  if (text.empty() || end != text.data() + text.size()) return false;
  if (error == std::errc()) {
    *number = read;
    return true;
  }
  // Out of range: too small if the power of ten of the first digit that counts is negative.
  const size_t mark = text.find_first_of("eE");
  const std::string_view digits = text.substr(0, mark);
  const bool small = mark == std::string_view::npos ? digits.find_first_of("123456789") > digits.find('.')
                                                    : text.substr(mark).find('-') != std::string_view::npos;
  const double size = small ? 0 : INFINITY;
  *number = text.starts_with('-') ? -size : size;
  return true;
}

std::string LowerCase(std::string_view text) {
  std::string lower(text);
  for (char& c : lower) {
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  }
  return lower;
}

std::string Fixed(double value, int decimals) {
  char buffer[64];
  FormatInto(buffer, sizeof buffer, "%.*f", decimals, value);
  return buffer;
}

}  // namespace tether
