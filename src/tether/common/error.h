#pragma once

#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace tether {

/// A place in an input file. Lines and columns count from 1; 0 means unknown.
struct Location {
  std::string file;
  int line = 0;
  int column = 0;

  /// "file:line:column", as compilers print it; parts that are unknown are left out.
  std::string ToString() const;
};

/// One mistake in an input.
struct Diagnostic {
  Location where;
  std::string message;   ///< What is wrong, with the offending text.
  std::string accepted;  ///< What would be accepted; may be empty.

  std::string ToString() const;
};

/// Bad input: a mistake in a file or on the command line, never in Tether. Holds every mistake that was
/// found.
class InputError : public std::runtime_error {
 public:
  explicit InputError(std::vector<Diagnostic> diagnostics);
  /// One mistake without a place in a file.
  explicit InputError(const std::string& message, const std::string& accepted = "");

  const std::vector<Diagnostic>& diagnostics() const { return diagnostics_; }

 private:
  std::vector<Diagnostic> diagnostics_;
};

/// Gathers the mistakes of a file, so that its reader can report all of them at once.
class Diagnostics {
 public:
  /// Adds a mistake with its place; `accepted` is what would be accepted, or empty.
  void Add(const Location& where, std::string message, std::string accepted = "");
  /// Adds what `error` holds.
  void Add(const InputError& error);

  /// A warning about something odd that still has one meaning. The same one in one file is reported once.
  void Warn(const Location& where, std::string message, std::string accepted = "");

  bool empty() const { return list_.empty(); }
  const std::vector<Diagnostic>& list() const { return list_; }
  const std::vector<Diagnostic>& warnings() const { return warnings_; }

  /// Throws an InputError with everything gathered, sorted by file and line; returns if there is nothing.
  void ThrowIfAny() const;

 private:
  std::vector<Diagnostic> list_, warnings_;
};

/// The candidate nearest to `word` by edit distance; empty when none is near enough.
std::string NearestMatch(std::string_view word, const std::vector<std::string>& candidates);

/// "a, b or c".
std::string JoinAlternatives(const std::vector<std::string>& words);

/// "did you mean 'x'? accepted: x, y or z": the hint for a `word` that is none of `known`.
std::string SuggestFrom(std::string_view word, const std::vector<std::string>& known);

}  // namespace tether
