#pragma once

#include <string>
#include <string_view>

namespace tether::evaluation {

/// A file that grows by whole pieces: what could not be written whole leaves nothing of it behind.
class LogSink {
 public:
  /// Opens and empties a file, or takes what else the path names: a pipe, a device, "-" for standard output.
  /// Throws InputError if it can't be written, or another process writes it as a log.
  explicit LogSink(const std::string& path);
  ~LogSink();
  LogSink(const LogSink&) = delete;
  LogSink& operator=(const LogSink&) = delete;

  /// The error (of errno), or 0.
  int Append(std::string_view piece);
  const std::string& path() const { return path_; }

 private:
  std::string path_;
  int file_ = -1;
  bool regular_ = false;
  long long size_ = 0;  // Of whole pieces, bytes.
};

}  // namespace tether::evaluation
