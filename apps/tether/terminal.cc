#include "apps/tether/terminal.h"

#include "tether/common/error.h"
#include "tether/common/file.h"

#include <atomic>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <string_view>

#include <fcntl.h>
#include <unistd.h>

namespace tether::app {
namespace {

std::atomic<int> lost{0};  // The error with which text for standard output was lost.

}  // namespace

Terminal::Terminal(bool to_stderr) : file_(to_stderr ? stderr : stdout) {
  const char* term = std::getenv("TERM");
  const bool plain =
      std::getenv("NO_COLOR") != nullptr || (term != nullptr && std::string_view(term) == "dumb");
  colour_ = !plain && isatty(fileno(file_)) != 0;
}

void Terminal::Print(const std::string& text) const {
  const bool written = std::fputs((text + "\n").c_str(), file_) >= 0 && std::fflush(file_) == 0;
  NoteProgress();
  // Not thrown: plans are printed while others are still searched for.
  if (!written && file_ == stdout) lost = errno;
}

void RequireStandardOutput() {
  const bool flushed = std::fflush(stdout) == 0;
  const int error = lost != 0 ? lost.load() : flushed ? 0 : errno;
  if (error != 0) throw InputError(std::string("cannot write to standard output: ") + std::strerror(error));
}

std::string Terminal::Wrap(const char* code, const std::string& text) const {
  return colour_ ? "\x1b[" + std::string(code) + "m" + text + "\x1b[0m" : text;
}

void HoldClosedStreams() {
  for (const int fd : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    if (fcntl(fd, F_GETFD) == -1 && errno == EBADF)
      open("/dev/null", fd == STDIN_FILENO ? O_WRONLY : O_RDONLY);
  }
}

}  // namespace tether::app
