#include "tether/evaluation/log/log_sink.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>

#include "tether/common/error.h"
#include "tether/common/file.h"

namespace tether::evaluation {
namespace {

[[noreturn]] void Fail(const std::string& path, const std::string& reason, const std::string& accepted) {
  throw InputError("--log: cannot write " + path + ": " + reason, accepted);
}

std::string Reason() { return std::strerror(errno); }  // NOLINT: this thread's, in glibc

}  // namespace

LogSink::LogSink(const std::string& path) : path_(path) {
  if (path == "-") {
    std::fflush(stdout);
    file_ = fcntl(STDOUT_FILENO, F_DUPFD_CLOEXEC, 0);
    if (file_ < 0) Fail("standard output", Reason(), "a stream that is open");
    return;
  }
  file_ = open(path.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC | O_NOCTTY, 0666);
  struct stat status {};
  if (file_ < 0 || fstat(file_, &status) != 0) Fail(path, Reason(), "a path in a writable folder");
  regular_ = S_ISREG(status.st_mode);
  if (!regular_) return;
  if (flock(file_, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK) {
    close(file_);
    Fail(path, "another run writes it", "another file, or that run's end");
  }
  if (ftruncate(file_, 0) != 0) {
    const std::string reason = Reason();
    close(file_);
    Fail(path, reason, "a path in a writable folder");
  }
}

LogSink::~LogSink() {
  if (file_ >= 0) close(file_);
}

int LogSink::Append(std::string_view piece) {
  const size_t whole = piece.size();
  while (!piece.empty()) {
    const ssize_t written = write(file_, piece.data(), piece.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) {
      const int error = errno;
      if (regular_) {
        if (ftruncate(file_, size_) != 0)
          return error;  // Then a part of a record stays, which readers pass over.
        lseek(file_, size_, SEEK_SET);
      }
      return error;
    }
    NoteProgress();
    piece.remove_prefix(written);
  }
  size_ += static_cast<long long>(whole);
  return 0;
}

}  // namespace tether::evaluation
