#include "tether/common/output/record_file.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "tether/common/file.h"

namespace tether {
namespace {

constexpr const char* kAccepted = "the file of a campaign, or a new one";

std::string Reason() { return std::strerror(errno); }  // NOLINT: this thread's, in glibc

}  // namespace

RecordFile::RecordFile(std::string path, const Value& header) : path_(std::move(path)) {
  if (path_.empty()) return;
  file_ = open(path_.c_str(), O_RDWR | O_APPEND | O_CREAT | O_CLOEXEC | O_NOCTTY, 0666);
  // A pipe that is opened for reading too would never report that it has no reader.
  struct stat status {};
  if (file_ >= 0 && fstat(file_, &status) == 0 && !S_ISREG(status.st_mode)) {
    close(file_);
    file_ = open(path_.c_str(), O_WRONLY | O_CLOEXEC | O_NOCTTY);
  }
  if (file_ < 0 || fstat(file_, &status) != 0) Fail(Reason(), "a path in a writable folder");
  regular_ = S_ISREG(status.st_mode);
  try {
    if (regular_ && flock(file_, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK)
      Fail("another campaign writes to it", "another file, or that campaign's end");
    if (regular_) TakeUp(header);
    if (earlier_.empty()) {
      Append(header);
    } else {
      earlier_.erase(earlier_.begin());
    }
  } catch (...) {
    close(file_);
    throw;
  }
}

RecordFile::~RecordFile() {
  if (file_ >= 0) close(file_);
}

void RecordFile::Append(const Value& record) {
  if (file_ < 0) return;
  const std::string line = WriteJson(record, 0) + "\n";
  const off_t before = regular_ ? lseek(file_, 0, SEEK_END) : 0;
  for (size_t done = 0; done < line.size();) {
    const ssize_t written = write(file_, line.data() + done, line.size() - done);
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) {
      const std::string reason = Reason();
      if (regular_ && ftruncate(file_, before) != 0) {
      }  // Then a part of the line stays, which the next campaign cuts off.
      Fail(reason, "a disk with room");
    }
    done += static_cast<size_t>(written);
  }
}

void RecordFile::TakeUp(const Value& header) {
  const std::string text = ReadFile(path_);
  // A line that was being written when the program was killed is measured again.
  const size_t end = text.rfind('\n') + 1;
  int number = 0;
  for (size_t begin = 0; begin < end;) {
    const size_t line_end = text.find('\n', begin);
    ++number;
    earlier_.push_back(ParseLine(std::string_view(text).substr(begin, line_end - begin), number));
    if (number == 1) CheckHeader(earlier_.front(), header);
    begin = line_end + 1;
  }
  if (number == 0 && !(WriteJson(header, 0) + "\n").starts_with(text)) ParseLine("", 1);
  if (end < text.size() && ftruncate(file_, static_cast<off_t>(end)) != 0)
    Fail(Reason(), "a path in a writable folder");
}

Value RecordFile::ParseLine(std::string_view text, int number) const {
  try {
    Value line = ParseYaml(text, path_);
    if (line.is_object()) return line;
  } catch (const InputError&) {  // said below, with the right line
  }
  throw InputError({{Location{path_, number, 0}, "this is not a line of a campaign", kAccepted}});
}

void RecordFile::CheckHeader(const Value& line, const Value& header) const {
  Diagnostics diagnostics;
  for (const Value::Member& member : header.members()) {
    const Value* found = line.Find(member.key);
    const std::string before = found == nullptr ? "nothing" : found->AsText();
    if (before == member.value.AsText()) continue;
    diagnostics.Add({path_, 1, 0}, "this campaign has " + member.key + " '" + before + "'",
                    "'" + member.value.AsText() + "', as asked for now; or another file");
  }
  diagnostics.ThrowIfAny();
}

void RecordFile::Fail(const std::string& problem, const std::string& accepted) const {
  throw InputError("--output: cannot write '" + path_ + "': " + problem, accepted);
}

}  // namespace tether
