#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace tether {

/// Formats as printf does in the "C" locale: numbers look the same whatever locale a host program has set.
[[gnu::format(printf, 1, 2)]] std::string Format(const char* format, ...);
/// The same into a buffer of so many bytes, as std::snprintf does.
[[gnu::format(printf, 3, 4)]] int FormatInto(char* buffer, size_t size, const char* format, ...);

/// A number with `decimals` digits after the point.
std::string Fixed(double value, int decimals);

/// Parses the whole of `text` as a number, in any locale: as std::strtod in the "C" locale, without
/// hexadecimal numbers. False, and nothing set, if it is none.
bool ParseNumber(std::string_view text, double* number);

/// 'A' to 'Z' become 'a' to 'z', in any locale.
std::string LowerCase(std::string_view text);

/// While one exists, this thread is in the "C" locale. For libraries that read and write numbers.
class PlainLocale {
 public:
  PlainLocale();
  ~PlainLocale();
  PlainLocale(const PlainLocale&) = delete;
  PlainLocale& operator=(const PlainLocale&) = delete;

 private:
  void* before_;
};

}  // namespace tether
