#include "tether/constraints/core/words.h"

#include <cmath>

#include "tether/common/text.h"

namespace tether::constraints {
namespace {

std::string Text(const char* format, double number) {
  char text[48];
  FormatInto(text, sizeof text, format, number);
  return text;
}

}  // namespace

std::string InMillimetres(double metres) { return Text("%.1f mm", 1e3 * std::abs(metres)); }
std::string InDegrees(double radians) { return Text("%.1f degrees", std::abs(radians) * 180 / M_PI); }

}  // namespace tether::constraints
