#pragma once

#include <cstdio>
#include <string>

namespace tether::app {

/// Where text for people goes: standard output, or standard error when standard output carries JSON. Colours
/// are used on a terminal only.
class Terminal {
 public:
  explicit Terminal(bool to_stderr = false);

  void Print(const std::string& text) const;  ///< With a newline; flushed.
  bool colour() const { return colour_; }
  std::string Bold(const std::string& text) const { return Wrap("1", text); }
  std::string Dim(const std::string& text) const { return Wrap("2", text); }
  std::string Green(const std::string& text) const { return Wrap("32", text); }
  std::string Red(const std::string& text) const { return Wrap("31", text); }
  std::string Yellow(const std::string& text) const { return Wrap("33", text); }

 private:
  std::string Wrap(const char* code, const std::string& text) const;

  std::FILE* file_;
  bool colour_ = false;
};

/// Throws InputError if text for standard output was lost: it is closed, or its disk is full.
void RequireStandardOutput();

/// Occupies closed standard streams with the null device: else the next file that is opened would become
/// standard output, and printed text would go into it. It is opened so that reading or writing fails.
void HoldClosedStreams();

}  // namespace tether::app
