#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

namespace tether {

/// The largest file that is read, bytes.
inline constexpr size_t kMaxFileBytes = size_t{256} << 20;

/// The whole file as text; pipes and devices are read to their end. Throws InputError if it can't be read, is
/// a folder, or is larger than kMaxFileBytes.
std::string ReadFile(const std::string& path);

/// Whether `path` is a file that ReadFile() has read in this process, by whatever name.
bool WasRead(const std::string& path);

/// The paths of the files that ReadFile() has read in this process, as they were given, sorted.
std::vector<std::string> FilesRead();

/// Writes an output. A regular file appears or is replaced atomically, and keeps its mode; the new content is
/// written to a temporary file beside it, with an unpredictable name and no link followed. Links are followed
/// first, so that a link stays one. Devices, pipes and the process's own streams are written to. When writing
/// fails, the old file stays and no temporary is left. Throws InputError with the system's reason.
void WriteFile(const std::string& path, std::string_view text);

/// Receives the next piece of a text that is written.
using TextSink = std::function<void(std::string_view)>;
/// Passes a text to a sink piece by piece, for texts too long to be kept in memory.
using TextSource = std::function<void(const TextSink&)>;

/// The same for the text of `source`, which is called once; an exception of it is passed on, as if writing
/// had failed.
void WriteFile(const std::string& path, const TextSource& source);

/// Writes to standard output and flushes it. Throws InputError if that fails.
void WriteStandardOutput(std::string_view text);

/// To standard output if `path` is "-", else to the file.
void WriteOutput(const std::string& path, std::string_view text);
void WriteOutput(const std::string& path, const TextSource& source);

/// Why `path` can't be written, in the system's words; empty if it can. Writes nothing.
std::string WhyNotWritable(const std::string& path);

/// Whether two paths lead to the same file, which need not exist yet.
bool IsSameFile(const std::string& a, const std::string& b);

/// While one exists, regular files are being written: a program that has to end should wait until they are
/// complete.
class WritingScope {
 public:
  WritingScope();
  ~WritingScope();
  WritingScope(const WritingScope&) = delete;
  WritingScope& operator=(const WritingScope&) = delete;
};

/// While one exists, results are being composed and written, to regular files or not: a program that has to
/// end should wait as long as there is progress.
class ReportingScope {
 public:
  ReportingScope();
  ~ReportingScope();
  ReportingScope(const ReportingScope&) = delete;
  ReportingScope& operator=(const ReportingScope&) = delete;

  /// All results are written: the rest of the program may be cut off.
  void Done();
};

/// Tells that a piece of the results was written.
void NoteProgress() noexcept;

/// For a signal handler that ends the program: how many pieces were written so far; whether results are being
/// written; and whether all of them are.
uint64_t WritingProgress() noexcept;
bool IsReporting() noexcept;
bool IsReported() noexcept;

/// For a signal handler that ends the program: whether regular files are being written, and the removal of
/// incomplete ones.
bool IsWriting() noexcept;
void RemoveUnfinishedFiles() noexcept;

}  // namespace tether
