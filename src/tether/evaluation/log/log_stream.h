#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "tether/evaluation/mcap/mcap_format.h"

namespace tether::evaluation {

/// A channel as it is declared: its topic, and the name and JSON text of its messages' schema.
struct LogChannel {
  std::string topic, schema_name, schema;
};

/// What stands in the file before the first message.
struct LogPreamble {
  std::string library;
  std::string metadata_name;
  std::map<std::string, std::string> metadata;
  std::map<std::string, std::string> files;  ///< Attached, by name.
  std::vector<LogChannel> channels;
};

/// An MCAP file that is written while its run goes on. The thread of the run hands over messages without ever
/// waiting, neither for a lock nor for the disk; a thread of the stream formats, compresses and writes them.
/// A message is in the file 30 ms after it was handed over, as far as the machine lets the thread run: what
/// is killed has lost no more than the last 100 ms.
///
/// When writing fails, as on a full disk, that is said once (LogWarning); the file keeps the whole records
/// that it has, and what comes after them is kept in memory, up to a bound, and tried again.
class LogStream {
 public:
  /// Opens the file and writes the preamble. A path of "-" is standard output. Throws InputError if it can't
  /// be written or is being written by another process.
  LogStream(const std::string& path, const LogPreamble& preamble);
  ~LogStream();
  LogStream(const LogStream&) = delete;
  LogStream& operator=(const LogStream&) = delete;

  /// Declares the text of messages of a channel (by its place in the preamble), with slots as in
  /// message_template.h; gives the template's number.
  int AddTemplate(int channel, std::string_view text);
  /// A message by a template, at a time in s.
  void Write(int message_template, double time, std::span<const double> numbers);
  /// A message as it is.
  void WriteText(int channel, double time, std::string_view json);

  /// Writes what is left, and the index. Why the file is not whole; empty if it is.
  std::string Close();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tether::evaluation
