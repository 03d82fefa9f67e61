#pragma once

#include <string>

#include "tether/common/error.h"

namespace tether {

/// Looks at the numbers of an options struct and gathers what is wrong with them: "'gain' of the velocity
/// controller is -1", with what is accepted.
class OptionCheck {
 public:
  /// `of`: whose options they are, "the velocity controller".
  OptionCheck(const char* of, Diagnostics* diagnostics) : of_(of), diagnostics_(diagnostics) {}

  /// Finite and above zero.
  void Positive(const char* name, double value) const;
  /// Finite, and zero or more.
  void NotNegative(const char* name, double value) const;
  /// Above zero, at most 1.
  void Share(const char* name, double value) const;

 private:
  void Require(bool good, const char* name, double value, const char* accepted) const;

  const char* of_;
  Diagnostics* diagnostics_;
};

}  // namespace tether
