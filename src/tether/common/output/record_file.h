#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "tether/common/document/value.h"

namespace tether {

/// A file with a line of JSON per record, after a header that identifies them. Writing continues where the
/// file ended, and one process at a time may write. A file of another kind is never changed.
class RecordFile {
 public:
  /// Opens or makes the file; an empty path is no file. Throws InputError if it can't be written, another
  /// process writes it, a line is no record, or its header is not `header`. Only an incomplete last line is
  /// cut off. A pipe or device is only written to.
  RecordFile(std::string path, const Value& header);
  ~RecordFile();
  RecordFile(const RecordFile&) = delete;
  RecordFile& operator=(const RecordFile&) = delete;

  /// What the file held, in its order.
  const std::vector<Value>& earlier() const { return earlier_; }
  /// Adds a line, all of it or nothing. Throws InputError if it can't be written.
  void Append(const Value& record);

 private:
  void TakeUp(const Value& header);
  Value ParseLine(std::string_view text, int number) const;
  void CheckHeader(const Value& line, const Value& header) const;
  [[noreturn]] void Fail(const std::string& problem, const std::string& accepted) const;

  std::string path_;
  int file_ = -1;
  bool regular_ = false;
  std::vector<Value> earlier_;
};

}  // namespace tether
