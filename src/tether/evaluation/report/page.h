#pragma once

#include <string>
#include <vector>

namespace tether::evaluation {

/// A page of HTML that stands alone (no script, no other file) and prints on paper.
class Page {
 public:
  explicit Page(const std::string& title);
  void AddHeading(const std::string& text);
  void AddParagraph(const std::string& text);
  /// Cells that begin with a digit or a sign are set to the right.
  void AddTable(const std::vector<std::string>& head, const std::vector<std::vector<std::string>>& rows);
  /// Markup as it is.
  void AddFigure(const std::string& svg);
  /// The whole page.
  std::string Text() const;

 private:
  std::string body_, title_;
};

}  // namespace tether::evaluation
