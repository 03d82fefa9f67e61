#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tether/common/document/value.h"

namespace tether {

/// Reads a map key by key, gathers every mistake, and reports unknown keys.
///
/// Each getter returns its fallback after adding a diagnostic, so that reading goes on and a file's mistakes
/// are reported together. `what` names the map in messages: "object 'box'".
class ObjectReader {
 public:
  /// `value` and `diagnostics` must outlive the reader. A value that is not a map is reported at once.
  ObjectReader(const Value& value, std::string what, Diagnostics& diagnostics);

  /// The member, or null when it is absent. Marks the key as known.
  const Value* Optional(std::string_view key);
  /// The member, or null after reporting its absence. `accepted` says what it should hold.
  const Value* Required(std::string_view key, std::string_view accepted);

  /// The value under the key, read as by ReadNumber() and the like below; the fallback if it is absent, or
  /// after a diagnostic.
  double Number(std::string_view key, double fallback);
  int Integer(std::string_view key, int fallback);
  uint64_t Natural(std::string_view key, uint64_t fallback);
  bool Bool(std::string_view key, bool fallback);
  /// May be empty, which for a name is the same as leaving the key out.
  std::string Text(std::string_view key, std::string fallback);
  Eigen::VectorXd Vector(std::string_view key, const Eigen::VectorXd& fallback);
  std::vector<std::string> TextList(std::string_view key);

  /// Reports each key that no getter asked for, with the nearest known one. Call it last.
  void Finish();

  const Value& value() const { return value_; }
  const std::string& what() const { return what_; }
  Diagnostics& diagnostics() { return diagnostics_; }

 private:
  const Value& value_;
  std::string what_;
  Diagnostics& diagnostics_;
  std::vector<std::string> known_;
};

/// Single values, with the same manner of reporting, within the bounds of bounds.h. `what` names the value:
/// "mass of object 'box'".
double ReadNumber(const Value& value, const std::string& what, Diagnostics& diagnostics, double fallback = 0);
/// A finite number above zero.
double ReadPositive(const Value& value, const std::string& what, Diagnostics& diagnostics,
                    double fallback = 1);
/// A length above zero, m.
double ReadLength(const Value& value, const std::string& what, Diagnostics& diagnostics, double fallback = 1);
int ReadInteger(const Value& value, const std::string& what, Diagnostics& diagnostics, int fallback = 0);
/// A whole number from 0 to 2^64 − 1.
uint64_t ReadNatural(const Value& value, const std::string& what, Diagnostics& diagnostics,
                     uint64_t fallback = 0);
bool ReadBool(const Value& value, const std::string& what, Diagnostics& diagnostics, bool fallback = false);
/// A text that is not empty.
std::string ReadText(const Value& value, const std::string& what, Diagnostics& diagnostics);
/// A list of `size` finite numbers; any size if `size` is negative.
std::optional<Eigen::VectorXd> ReadVector(const Value& value, int size, const std::string& what,
                                          Diagnostics& diagnostics);

}  // namespace tether
