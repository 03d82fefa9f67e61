#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "tether/common/document/value.h"
#include "tether/common/file.h"

namespace tether {

/// The output files of a command: checked before its work begins, and written at its end. A path may be "-",
/// which is standard output, or empty, which is nothing.
class Outputs {
 public:
  /// `option` names it in messages; `path` must stay as it is.
  void Add(const std::string& path, const char* option);

  /// Throws InputError if one can't be written, two are the same, or one is among `inputs`.
  void Require(const std::vector<std::string>& inputs = {}) const;
  /// Throws InputError if one is a file that has been read by now: it would be lost.
  void RequireUnread() const;

  /// If one can't be written, the others still are; Finish() reports it.
  void WriteText(const std::string& path, std::string_view text);
  void WriteText(const std::string& path, const TextSource& source);
  void Write(const std::string& path, const Value& value);
  /// Throws InputError if one could not be written.
  void Finish() const { problems_.ThrowIfAny(); }

 private:
  struct Output {
    std::string path;
    std::string option;
  };
  std::vector<Output> outputs_;
  Diagnostics problems_;
};

}  // namespace tether
