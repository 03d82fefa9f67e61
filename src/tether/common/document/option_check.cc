#include "tether/common/document/option_check.h"

#include <cmath>

#include "tether/common/document/value.h"

namespace tether {

void OptionCheck::Require(bool good, const char* name, double value, const char* accepted) const {
  if (good) return;
  diagnostics_->Add({}, "'" + std::string(name) + "' of " + of_ + " is " + Value(value).AsText(), accepted);
}

void OptionCheck::Positive(const char* name, double value) const {
  Require(std::isfinite(value) && value > 0, name, value, "a finite number above zero is accepted");
}

void OptionCheck::NotNegative(const char* name, double value) const {
  Require(std::isfinite(value) && value >= 0, name, value, "a finite number of at least zero is accepted");
}

void OptionCheck::Share(const char* name, double value) const {
  Require(value > 0 && value <= 1, name, value, "a number above 0, at most 1, is accepted");
}

}  // namespace tether
