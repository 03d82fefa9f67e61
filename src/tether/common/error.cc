#include "tether/common/error.h"

#include <algorithm>
#include <numeric>
#include <tuple>

namespace tether {
namespace {

/// Reading ends at this many mistakes: each is compared with all known names.
constexpr size_t kMostMistakes = 500;
/// Longer words are not compared.
constexpr size_t kLongestWord = 200;
/// The most alternatives that are listed.
constexpr size_t kMostAlternatives = 60;

/// The most characters that are printed of a message, and of what would be accepted.
constexpr size_t kLongestMessage = 400;
constexpr size_t kLongestAccepted = 4000;

/// `text`, without its middle if it is too long to be read: a value may be a whole file.
std::string WithoutMiddle(const std::string& text, size_t longest) {
  if (text.size() <= longest) return text;
  const auto is_inside = [&](size_t i) { return (static_cast<unsigned char>(text[i]) & 0xC0) == 0x80; };
  size_t head = longest / 2, tail = text.size() - longest / 4;
  while (head > 0 && is_inside(head)) --head;
  while (tail < text.size() && is_inside(tail)) ++tail;
  return text.substr(0, head) + " ... (" + std::to_string(tail - head) + " bytes) ... " + text.substr(tail);
}

std::string JoinDiagnostics(const std::vector<Diagnostic>& diagnostics) {
  std::string text;
  for (const Diagnostic& diagnostic : diagnostics) {
    if (!text.empty()) text += '\n';
    text += diagnostic.ToString();
  }
  return text;
}

/// Optimal string alignment distance: insertions, deletions, substitutions and swaps of neighbours.
int EditDistance(std::string_view a, std::string_view b) {
  const size_t rows = a.size() + 1, cols = b.size() + 1;
  std::vector<int> d(rows * cols);
  auto at = [&](size_t i, size_t j) -> int& { return d[i * cols + j]; };
  for (size_t i = 0; i < rows; ++i) at(i, 0) = static_cast<int>(i);
  for (size_t j = 0; j < cols; ++j) at(0, j) = static_cast<int>(j);
  for (size_t i = 1; i < rows; ++i) {
    for (size_t j = 1; j < cols; ++j) {
      const int substitution = a[i - 1] == b[j - 1] ? 0 : 1;
      at(i, j) = std::min({at(i - 1, j) + 1, at(i, j - 1) + 1, at(i - 1, j - 1) + substitution});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1]) {
        at(i, j) = std::min(at(i, j), at(i - 2, j - 2) + 1);
      }
    }
  }
  return d.back();
}

}  // namespace

std::string Location::ToString() const {
  std::string text = file;
  if (line > 0) text += (text.empty() ? "line " : ":") + std::to_string(line);
  if (line > 0 && column > 0) text += ":" + std::to_string(column);
  return text;
}

std::string Diagnostic::ToString() const {
  const std::string place = where.ToString();
  std::string text = place.empty() ? "" : place + ": ";
  text += WithoutMiddle(message, kLongestMessage);
  if (!accepted.empty()) text += " (" + WithoutMiddle(accepted, kLongestAccepted) + ")";
  return text;
}

InputError::InputError(std::vector<Diagnostic> diagnostics)
    : std::runtime_error(JoinDiagnostics(diagnostics)), diagnostics_(std::move(diagnostics)) {}

InputError::InputError(const std::string& message, const std::string& accepted)
    : InputError(std::vector<Diagnostic>{{Location{}, message, accepted}}) {}

void Diagnostics::Add(const Location& where, std::string message, std::string accepted) {
  list_.push_back({where, std::move(message), std::move(accepted)});
  if (list_.size() < kMostMistakes) return;
  list_.push_back({{where.file, 0, 0}, "there are too many mistakes to go on", ""});
  ThrowIfAny();
}

void Diagnostics::Warn(const Location& where, std::string message, std::string accepted) {
  for (const Diagnostic& known : warnings_) {
    if (known.message == message && known.where.file == where.file) return;
  }
  warnings_.push_back({where, std::move(message), std::move(accepted)});
}

void Diagnostics::Add(const InputError& error) {
  // Those of an error that ended the gathering are here already.
  if (list_.size() > kMostMistakes) throw InputError(error);
  list_.insert(list_.end(), error.diagnostics().begin(), error.diagnostics().end());
}

void Diagnostics::ThrowIfAny() const {
  if (list_.empty()) return;
  std::vector<Diagnostic> sorted = list_;
  std::stable_sort(sorted.begin(), sorted.end(), [](const Diagnostic& a, const Diagnostic& b) {
    return std::tie(a.where.file, a.where.line, a.where.column) <
           std::tie(b.where.file, b.where.line, b.where.column);
  });
  throw InputError(std::move(sorted));
}

std::string NearestMatch(std::string_view word, const std::vector<std::string>& candidates) {
  std::string best;
  if (word.size() > kLongestWord) return best;
  int best_distance = std::max(2, static_cast<int>(word.size()) / 3) + 1;
  for (const std::string& candidate : candidates) {
    const size_t more = std::max(word.size(), candidate.size()) - std::min(word.size(), candidate.size());
    if (more >= static_cast<size_t>(best_distance)) continue;
    const int distance = EditDistance(word, candidate);
    if (distance < best_distance && distance < static_cast<int>(std::max(word.size(), candidate.size()))) {
      best = candidate;
      best_distance = distance;
    }
  }
  return best;
}

std::string JoinAlternatives(const std::vector<std::string>& words) {
  std::string text;
  const size_t said = words.size() > kMostAlternatives ? kMostAlternatives : words.size();
  for (size_t i = 0; i < said; ++i) {
    if (i > 0) text += i + 1 == words.size() ? " or " : ", ";
    text += words[i];
  }
  if (said < words.size()) text += " or one of " + std::to_string(words.size() - said) + " more";
  return text;
}

std::string SuggestFrom(std::string_view word, const std::vector<std::string>& known) {
  if (known.empty()) return "accepted: none, since there is none";
  const std::string nearest = NearestMatch(word, known);
  return (nearest.empty() ? "" : "did you mean '" + nearest + "'? ") + "accepted: " + JoinAlternatives(known);
}

}  // namespace tether
