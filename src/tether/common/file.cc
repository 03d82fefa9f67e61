#include "tether/common/file.h"

#include <fcntl.h>
#include <sys/random.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <map>
#include <mutex>
#include <utility>

#include "tether/common/error.h"

namespace tether {
namespace {

namespace fs = std::filesystem;

constexpr int kMostLinks = 40;  // As Linux follows them.

std::atomic<int> writing{0}, reporting{0};
std::atomic<bool> reported{false};
std::atomic<uint64_t> progress{0};
constexpr size_t kPiece = size_t{1} << 16;
// Temporary files, for a signal handler. One that writes more at once than there are slots leaves them behind
// if it is ended meanwhile.
std::array<std::atomic<const char*>, 16> unfinished{};

std::string Reason(int error) { return std::strerror(error); }  // NOLINT: this thread's, in glibc

[[noreturn]] void Fail(const std::string& path, const std::string& doing, const std::string& reason,
                       const std::string& accepted) {
  throw InputError(
      {{Location{path.empty() ? "''" : path, 0, 0}, "cannot " + doing + " this file: " + reason, accepted}});
}
[[noreturn]] void FailToWrite(const std::string& path, const std::string& reason) {
  Fail(path, "write", reason, "a path in a writable folder, on a disk with room");
}

class Descriptor {
 public:
  explicit Descriptor(int fd) : fd_(fd) {}
  ~Descriptor() {
    if (fd_ >= 0) close(fd_);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  int get() const { return fd_; }
  /// Closes it; the error that this tells, or 0.
  int Close() { return close(std::exchange(fd_, -1)) == 0 ? 0 : errno; }

 private:
  int fd_;
};

/// The error, or 0.
int WriteAll(int fd, std::string_view text) {
  while (!text.empty()) {
    // In pieces, so that a signal handler that waits for it sees progress.
    const ssize_t written = write(fd, text.data(), std::min(text.size(), 16 * kPiece));
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return errno;
    NoteProgress();
    text.remove_prefix(written);
  }
  return 0;
}

using FileId = std::pair<dev_t, ino_t>;

struct ReadFiles {
  std::mutex mutex;
  std::map<FileId, std::string> paths;
};
ReadFiles& Read() {
  static ReadFiles files;
  return files;
}

/// Where an output goes.
struct Destination {
  int stream = -1;   ///< A descriptor of this process, to be written to; -1: none.
  std::string path;  ///< Without links in its last part.
  bool exists = false;
  struct stat status {};
  std::string problem;  ///< Why there is none.

  bool regular() const { return !exists || S_ISREG(status.st_mode); }
};

/// N if `path` is /proc/self/fd/N, which is where /dev/stdout leads to.
int OwnDescriptor(const fs::path& path) {
  std::error_code error;
  const fs::path folder = fs::canonical(path.parent_path().empty() ? "." : path.parent_path(), error);
  if (error || folder != fs::path("/proc") / std::to_string(getpid()) / "fd") return -1;
  const std::string name = path.filename().string();
  if (name.empty() || name.size() > 6 || name.find_first_not_of("0123456789") != std::string::npos) return -1;
  return std::stoi(name);
}

Destination FindDestination(const std::string& given) {
  Destination found;
  if (given.empty()) {
    found.problem = "its name is empty";
    return found;
  }
  fs::path path = given;
  for (int links = 0;; ++links) {
    found.stream = OwnDescriptor(path);
    if (found.stream >= 0) break;
    std::error_code error;
    if (!fs::is_symlink(fs::symlink_status(path, error))) break;
    const fs::path target = fs::read_symlink(path, error);
    if (error || links == kMostLinks) {
      found.problem = error ? error.message() : Reason(ELOOP);
      return found;
    }
    path = path.parent_path() / target;  // An absolute target replaces the whole.
  }
  found.path = path.string();
  if (found.stream >= 0) {
    found.exists = fstat(found.stream, &found.status) == 0;
    if (!found.exists) found.problem = Reason(errno);
    return found;
  }
  found.exists = stat(found.path.c_str(), &found.status) == 0;
  if (!found.exists && errno != ENOENT) found.problem = Reason(errno);
  if (!found.exists && found.path.ends_with('/')) found.problem = "it is a folder";
  if (found.exists && S_ISDIR(found.status.st_mode)) found.problem = "it is a folder";
  // A file that standard output is redirected to is written to, not replaced.
  for (const int fd : {STDOUT_FILENO, STDERR_FILENO}) {
    struct stat own {};
    if (found.exists && fstat(fd, &own) == 0 && own.st_dev == found.status.st_dev &&
        own.st_ino == found.status.st_ino)
      found.stream = fd;
  }
  return found;
}

fs::path FolderOf(const std::string& path) {
  const fs::path folder = fs::path(path).parent_path();
  return folder.empty() ? fs::path(".") : folder;
}

std::string RandomName() {
  std::array<unsigned char, 12> bytes{};
  size_t filled = 0;
  while (filled < bytes.size()) {
    const ssize_t got = getrandom(bytes.data() + filled, bytes.size() - filled, 0);
    if (got > 0)
      filled += static_cast<size_t>(got);
    else if (errno != EINTR)
      throw InputError("no random numbers: " + Reason(errno));
  }
  std::string name = ".tether-";
  for (const unsigned char byte : bytes) {
    name += "0123456789abcdef"[byte >> 4];
    name += "0123456789abcdef"[byte & 15];
  }
  return name;
}

/// The temporary beside an output. It is removed unless it was put in place.
class Temporary {
 public:
  Temporary(const std::string& folder, mode_t mode)
      : path_((fs::path(folder) / RandomName()).string()),
        file_(open(path_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, mode)),
        error_(file_.get() < 0 ? errno : 0) {
    if (error_ != 0) return;
    for (std::atomic<const char*>& slot : unfinished) {
      const char* none = nullptr;
      if (!slot.compare_exchange_strong(none, path_.c_str())) continue;
      slot_ = &slot;
      break;
    }
  }
  ~Temporary() {
    if (error_ == 0 && !placed_) unlink(path_.c_str());
    Forget();
  }
  Temporary(const Temporary&) = delete;
  Temporary& operator=(const Temporary&) = delete;

  /// The error, or 0.
  int error() const { return error_; }
  int fd() const { return file_.get(); }
  int MoveTo(const std::string& path) {
    if (const int error = file_.Close()) return error;
    if (rename(path_.c_str(), path.c_str()) != 0) return errno;
    placed_ = true;
    Forget();
    return 0;
  }

 private:
  void Forget() {
    if (slot_ != nullptr) slot_->store(nullptr);
    slot_ = nullptr;
  }

  std::string path_;
  Descriptor file_;
  int error_;
  bool placed_ = false;
  std::atomic<const char*>* slot_ = nullptr;
};

/// Writes what `source` hands over to a descriptor, in pieces of some size.
void WriteFrom(const std::string& given, int fd, const TextSource& source) {
  std::string buffer;
  const auto flush = [&](std::string_view text) {
    if (const int error = WriteAll(fd, text)) FailToWrite(given, Reason(error));
  };
  source([&](std::string_view text) {
    if (buffer.size() + text.size() > kPiece) {
      flush(buffer);
      buffer.clear();
    }
    if (text.size() > kPiece) {
      flush(text);
    } else {
      buffer += text;
    }
  });
  flush(buffer);
}

void ReplaceFile(const std::string& given, const Destination& to, const TextSource& source) {
  const WritingScope scope;
  // Until it has the mode of the file that it replaces, nobody else may read it.
  Temporary temporary(FolderOf(to.path).string(), to.exists ? 0600 : 0666);
  if (temporary.error() != 0) FailToWrite(given, Reason(temporary.error()));
  WriteFrom(given, temporary.fd(), source);
  if (to.exists) {
    // Only root may give files away; then a group that is not ours goes, with what it was allowed.
    const bool owned = fchown(temporary.fd(), to.status.st_uid, to.status.st_gid) == 0;
    const mode_t mode = to.status.st_mode & (owned ? 07777 : 0777);
    if (fchmod(temporary.fd(), mode) != 0) FailToWrite(given, Reason(errno));
  }
  if (const int error = temporary.MoveTo(to.path)) FailToWrite(given, Reason(error));
}

}  // namespace

std::string ReadFile(const std::string& path) {
  const char* const accepted = "a path to a readable file";
  const Descriptor file(open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NOCTTY));
  struct stat status {};
  if (file.get() < 0 || fstat(file.get(), &status) != 0) Fail(path, "read", Reason(errno), accepted);
  std::string text;
  // A regular file has its size, and one byte more tells that it ended; others come in pieces.
  const size_t expected =
      S_ISREG(status.st_mode) ? std::min(static_cast<size_t>(status.st_size), kMaxFileBytes) + 1 : 0;
  for (;;) {
    const size_t before = text.size();
    if (before > kMaxFileBytes) {
      Fail(path, "read", "it is larger than " + std::to_string(kMaxFileBytes >> 20) + " MiB",
           "a smaller file");
    }
    text.resize(before < expected ? expected : before + kPiece);
    const ssize_t got = read(file.get(), text.data() + before, text.size() - before);
    const int error = errno;
    text.resize(before + static_cast<size_t>(std::max<ssize_t>(got, 0)));
    if (got == 0) break;
    if (got < 0 && error != EINTR) Fail(path, "read", Reason(error), accepted);
  }
  const std::lock_guard lock(Read().mutex);
  Read().paths.insert_or_assign(FileId(status.st_dev, status.st_ino), path);
  return text;
}

bool WasRead(const std::string& path) {
  struct stat status {};
  if (stat(path.c_str(), &status) != 0 || !S_ISREG(status.st_mode)) return false;
  const std::lock_guard lock(Read().mutex);
  const auto found = Read().paths.find({status.st_dev, status.st_ino});
  // The number of a file that is gone may be another's by now.
  struct stat same {};
  return found != Read().paths.end() && stat(found->second.c_str(), &same) == 0 &&
         same.st_dev == status.st_dev && same.st_ino == status.st_ino;
}

std::vector<std::string> FilesRead() {
  const std::lock_guard lock(Read().mutex);
  std::vector<std::string> paths;
  for (const auto& [id, path] : Read().paths) paths.push_back(path);
  std::sort(paths.begin(), paths.end());
  return paths;
}

void WriteFile(const std::string& path, std::string_view text) {
  WriteFile(path, [&](const TextSink& sink) { sink(text); });
}

void WriteFile(const std::string& path, const TextSource& source) {
  const std::string problem = WhyNotWritable(path);
  if (!problem.empty()) FailToWrite(path, problem);
  const Destination to = FindDestination(path);
  if (to.stream >= 0) {
    std::fflush(to.stream == STDERR_FILENO ? stderr : stdout);  // What was said before stands before.
    WriteFrom(path, to.stream, source);
  } else if (to.regular()) {
    ReplaceFile(path, to, source);
  } else {
    Descriptor file(open(to.path.c_str(), O_WRONLY | O_NOCTTY | O_CLOEXEC));
    if (file.get() < 0) FailToWrite(path, Reason(errno));
    WriteFrom(path, file.get(), source);
    if (const int error = file.Close()) FailToWrite(path, Reason(error));
  }
}

void WriteStandardOutput(std::string_view text) {
  WriteOutput("-", [&](const TextSink& sink) { sink(text); });
}

void WriteOutput(const std::string& path, std::string_view text) {
  WriteOutput(path, [&](const TextSink& sink) { sink(text); });
}

void WriteOutput(const std::string& path, const TextSource& source) {
  if (path != "-") {
    WriteFile(path, source);
    return;
  }
  const auto require = [](bool written) {
    if (!written) throw InputError("cannot write to standard output: " + Reason(errno));
    NoteProgress();
  };
  source([&](std::string_view text) {
    require(std::fwrite(text.data(), 1, text.size(), stdout) == text.size());
  });
  require(std::fflush(stdout) == 0 && std::ferror(stdout) == 0);
}

std::string WhyNotWritable(const std::string& path) {
  const Destination to = FindDestination(path);
  if (!to.problem.empty()) return to.problem;
  if (to.stream >= 0) return "";
  if (to.exists && access(to.path.c_str(), W_OK) != 0) return Reason(errno);
  if (!to.regular()) return "";
  const std::string folder = FolderOf(to.path).string();
  struct stat status {};
  if (stat(folder.c_str(), &status) != 0) return "its folder: " + Reason(errno);
  if (!S_ISDIR(status.st_mode)) return "its folder: " + Reason(ENOTDIR);
  return access(folder.c_str(), W_OK | X_OK) == 0 ? "" : "its folder: " + Reason(errno);
}

bool IsSameFile(const std::string& a, const std::string& b) {
  const Destination first = FindDestination(a), second = FindDestination(b);
  if (first.exists != second.exists || !first.regular() || !second.regular()) return false;
  if (first.exists)
    return first.status.st_dev == second.status.st_dev && first.status.st_ino == second.status.st_ino;
  // The folders must exist, so links and dots in them can be resolved.
  const auto place = [](const std::string& path) {
    std::error_code error;
    const fs::path folder = fs::weakly_canonical(fs::absolute(FolderOf(path), error), error);
    return folder / fs::path(path).filename();
  };
  return place(first.path) == place(second.path);
}

WritingScope::WritingScope() { ++writing; }
WritingScope::~WritingScope() { --writing; }

ReportingScope::ReportingScope() { ++reporting; }
ReportingScope::~ReportingScope() { --reporting; }
void ReportingScope::Done() { reported = true; }

void NoteProgress() noexcept { ++progress; }
uint64_t WritingProgress() noexcept { return progress.load(); }
bool IsReporting() noexcept { return reporting.load() > 0 && !IsReported(); }
bool IsReported() noexcept { return reported.load(); }

bool IsWriting() noexcept { return writing.load() > 0; }

void RemoveUnfinishedFiles() noexcept {
  for (const std::atomic<const char*>& slot : unfinished) {
    if (const char* path = slot.load()) unlink(path);
  }
}

}  // namespace tether
