#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace tether::evaluation {

/// Places in the text of a template: a number, in order, and the message's time as {"sec":…,"nsec":…}.
inline constexpr char kNumberSlot = '\x01', kTimeSlot = '\x02';

/// Appends a number as JSON, to 1e-6; what is not finite becomes null.
void AppendNumber(double value, std::string* out);
/// Appends a time (ns) as {"sec":…,"nsec":…}.
void AppendTime(uint64_t time, std::string* out);
/// Appends a text as JSON, with its quotes. Bytes that are no UTF-8 are left to WriteJson's care: names come
/// from files that were read as UTF-8.
void AppendQuoted(std::string_view text, std::string* out);

/// The JSON text of a message whose numbers alone change.
class MessageTemplate {
 public:
  explicit MessageTemplate(std::string_view text);
  size_t num_numbers() const { return num_numbers_; }
  /// Appends the message with these numbers; there must be num_numbers() of them.
  void Fill(uint64_t time, std::span<const double> numbers, std::string* out) const;

 private:
  struct Piece {
    std::string text;
    char slot;  ///< After the text; 0: none.
  };
  std::vector<Piece> pieces_;
  size_t num_numbers_ = 0;
};

}  // namespace tether::evaluation
