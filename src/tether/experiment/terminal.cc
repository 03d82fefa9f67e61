#include "tether/experiment/terminal.h"

#include <cstdlib>
#include <string_view>

#include <unistd.h>

namespace tether::experiment {

Terminal::Terminal(bool to_stderr) : file_(to_stderr ? stderr : stdout) {
  const char* term = std::getenv("TERM");
  const bool plain =
      std::getenv("NO_COLOR") != nullptr || (term != nullptr && std::string_view(term) == "dumb");
  colour_ = !plain && isatty(fileno(file_)) != 0;
}

void Terminal::Print(const std::string& text) const {
  std::fputs((text + "\n").c_str(), file_);
  std::fflush(file_);
}

std::string Terminal::Wrap(const char* code, const std::string& text) const {
  return colour_ ? "\x1b[" + std::string(code) + "m" + text + "\x1b[0m" : text;
}

std::string Fixed(double value, int decimals) {
  char buffer[64];
  std::snprintf(buffer, sizeof buffer, "%.*f", decimals, value);
  return buffer;
}

}  // namespace tether::experiment
