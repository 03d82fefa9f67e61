#include "tether/evaluation/report/page.h"

#include "tether/evaluation/report/figure.h"

namespace tether::evaluation {
namespace {

constexpr const char* kStyle =
    "body{font:14px/1.4 sans-serif;max-width:1000px;margin:2em auto;padding:0 1em;color:#222}"
    "h1{font-size:1.5em}h2{font-size:1.15em;margin-top:1.6em}"
    "table{border-collapse:collapse;margin:.5em 0}"
    "td,th{border-bottom:1px solid #ddd;padding:.2em .7em .2em 0;text-align:left;vertical-align:top}"
    "td.n{text-align:right;font-variant-numeric:tabular-nums}"
    "svg{max-width:100%;height:auto}"
    "@media "
    "print{body{margin:0;max-width:none;font-size:10pt}h2{break-after:avoid}tr,svg{break-inside:avoid}}"
    "@page{margin:15mm}";

bool IsNumeric(const std::string& cell) {
  const size_t sign = !cell.empty() && (cell[0] == '-' || cell[0] == '+') ? 1 : 0;
  return cell.size() > sign && cell[sign] >= '0' && cell[sign] <= '9';
}

}  // namespace

Page::Page(const std::string& title) : title_(title) { body_ = "<h1>" + EscapeMarkup(title) + "</h1>\n"; }

void Page::AddHeading(const std::string& text) { body_ += "<h2>" + EscapeMarkup(text) + "</h2>\n"; }
void Page::AddParagraph(const std::string& text) { body_ += "<p>" + EscapeMarkup(text) + "</p>\n"; }
void Page::AddFigure(const std::string& svg) { body_ += "<figure style='margin:0'>" + svg + "</figure>\n"; }

void Page::AddTable(const std::vector<std::string>& head, const std::vector<std::vector<std::string>>& rows) {
  body_ += "<table>\n";
  if (!head.empty()) {
    body_ += "<tr>";
    for (const std::string& cell : head) body_ += "<th>" + EscapeMarkup(cell) + "</th>";
    body_ += "</tr>\n";
  }
  for (const std::vector<std::string>& row : rows) {
    body_ += "<tr>";
    for (const std::string& cell : row)
      body_ += (IsNumeric(cell) ? "<td class='n'>" : "<td>") + EscapeMarkup(cell) + "</td>";
    body_ += "</tr>\n";
  }
  body_ += "</table>\n";
}

std::string Page::Text() const {
  return "<!DOCTYPE html>\n<html lang='en'><head><meta charset='utf-8'><title>" + EscapeMarkup(title_) +
         "</title><style>" + kStyle + "</style></head><body>\n" + body_ + "</body></html>\n";
}

}  // namespace tether::evaluation
