#include "tether/evaluation/log/message_template.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

#include "tether/common/document/value.h"

namespace tether::evaluation {
namespace {

constexpr int kDecimals = 6;
constexpr double kUnit = 1e6;
constexpr double kMostFixed = 9e15 / kUnit;  // Above, whole units are not exact.
constexpr uint64_t kSecond = 1'000'000'000;

void AppendWhole(uint64_t value, std::string* out) {
  std::array<char, 24> digits{};
  const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), value).ptr;
  out->append(digits.data(), end);
}

}  // namespace

void AppendNumber(double value, std::string* out) {
  if (!std::isfinite(value)) {
    *out += "null";
    return;
  }
  if (std::abs(value) > kMostFixed) {
    std::array<char, 40> digits{};
    const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), value).ptr;
    out->append(digits.data(), end);
    return;
  }
  const auto units = static_cast<uint64_t>(std::llround(std::abs(value) * kUnit));
  if (units != 0 && value < 0) *out += '-';
  const auto whole = static_cast<uint64_t>(kUnit);
  AppendWhole(units / whole, out);
  uint64_t rest = units % whole;
  if (rest == 0) return;
  std::array<char, kDecimals> decimals{};
  for (size_t i = kDecimals; i-- > 0; rest /= 10) decimals[i] = static_cast<char>('0' + rest % 10);
  size_t used = kDecimals;
  while (decimals[used - 1] == '0') --used;
  *out += '.';
  out->append(decimals.data(), used);
}

void AppendTime(uint64_t time, std::string* out) {
  *out += "{\"sec\":";
  AppendWhole(time / kSecond, out);
  *out += ",\"nsec\":";
  AppendWhole(time % kSecond, out);
  *out += '}';
}

void AppendQuoted(std::string_view text, std::string* out) { *out += WriteJson(Value(text), 0); }

MessageTemplate::MessageTemplate(std::string_view text) {
  pieces_.push_back({"", 0});
  for (const char c : text) {
    if (c != kNumberSlot && c != kTimeSlot) {
      pieces_.back().text += c;
      continue;
    }
    pieces_.back().slot = c;
    if (c == kNumberSlot) ++num_numbers_;
    pieces_.push_back({"", 0});
  }
}

void MessageTemplate::Fill(uint64_t time, std::span<const double> numbers, std::string* out) const {
  size_t next = 0;
  for (const Piece& piece : pieces_) {
    *out += piece.text;
    if (piece.slot == kNumberSlot) AppendNumber(numbers[next++], out);
    if (piece.slot == kTimeSlot) AppendTime(time, out);
  }
}

}  // namespace tether::evaluation
