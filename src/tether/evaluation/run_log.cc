#include "tether/evaluation/run_log.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "tether/common/bounds.h"
#include "tether/common/document/reader.h"
#include "tether/common/output/output_header.h"
#include "tether/common/text.h"

namespace tether::evaluation {
namespace {

constexpr double kWidth = 960, kPanel = 210, kLeft = 70, kRight = 220, kTop = 34, kBottom = 34;
constexpr int kMostLines = 20;  // Of a grid.
constexpr std::array kColours = {"#1b6ca8", "#c8553d", "#588157", "#b08900", "#7b4b94",
                                 "#2a9d8f", "#8d5524", "#6c757d", "#d1495b", "#3a5a40"};

std::string Number(double value, const char* format = "%.4g") {
  char text[40];
  FormatInto(text, sizeof text, format, value);
  return text;
}

std::string Escaped(const std::string& text) {
  std::string result;
  for (const char c : text) {
    if (c == '&')
      result += "&amp;";
    else if (c == '<')
      result += "&lt;";
    else if (c == '>')
      result += "&gt;";
    else
      result += c;
  }
  return result;
}

/// A round step that divides `span` into about `parts`.
double RoundStep(double span, int parts) {
  const double rough = span / parts, power = std::pow(10.0, std::floor(std::log10(rough)));
  for (const double factor : {1.0, 2.0, 5.0, 10.0}) {
    if (factor * power >= rough) return factor * power;
  }
  return rough;
}

class Panel {
 public:
  Panel(const RunLog& log, std::string name, int index)
      : log_(log), name_(std::move(name)), y0_(kTop + index * (kPanel + kBottom)) {
    for (const LogSeries& series : log.series) {
      if (series.panel == name_) series_.push_back(&series);
    }
    for (const LogSeries* series : series_) {
      for (const double value : series->values) Include(value);
      if (series->lower != series->upper) {
        Include(series->lower);
        Include(series->upper);
      }
    }
    Include(0);
    if (high_ - low_ < 1e-9) high_ = low_ + 1;
    const double room = 0.05 * (high_ - low_);
    low_ -= room;
    high_ += room;
    if (!log.times.empty()) end_ = std::max(log.times.back(), 1e-3);
  }

  std::string Draw() const {
    std::string svg = "<text x='" + Number(kLeft) + "' y='" + Number(y0_ - 8) + "' font-weight='bold'>" +
                      Escaped(name_) + (series_.empty() ? "" : " (" + Escaped(series_[0]->unit) + ")") +
                      "</text>\n";
    svg += "<rect x='" + Number(kLeft) + "' y='" + Number(y0_) + "' width='" +
           Number(kWidth - kLeft - kRight) + "' height='" + Number(kPanel) +
           "' fill='none' stroke='#888'/>\n";
    const double step = RoundStep(high_ - low_, 5), time_step = RoundStep(end_, 8);
    // By number: added up, a step that is small beside the values would be lost to rounding.
    const double first = std::ceil(low_ / step);
    for (int i = 0; i <= kMostLines && (first + i) * step <= high_; ++i) {
      const double value = (first + i) * step;
      svg += Line(0, value, end_, value, std::abs(value) < 1e-9 * step ? "#444" : "#ddd", "");
      svg += "<text x='" + Number(kLeft - 6) + "' y='" + Number(Y(value) + 4) + "' text-anchor='end'>" +
             Number(std::abs(value) < 1e-9 * step ? 0 : value) + "</text>\n";
    }
    for (int i = 0; i <= kMostLines && i * time_step <= end_; ++i) {
      const double time = i * time_step;
      svg += "<text x='" + Number(X(time)) + "' y='" + Number(y0_ + kPanel + 14) + "' text-anchor='middle'>" +
             Number(time) + " s</text>\n";
    }
    for (const auto& [time, text] : log_.marks) svg += Line(time, low_, time, high_, "#333", "2,3");
    for (size_t i = 0; i < series_.size(); ++i) {
      const char* colour = kColours[i % kColours.size()];
      svg += DrawSeries(*series_[i], colour);
      if (series_[i]->lower != series_[i]->upper) {
        svg += Line(0, series_[i]->lower, end_, series_[i]->lower, colour, "6,4");
        svg += Line(0, series_[i]->upper, end_, series_[i]->upper, colour, "6,4");
      }
      const double y = y0_ + 12 + 16 * static_cast<double>(i);
      svg += "<text x='" + Number(kWidth - kRight + 10) + "' y='" + Number(y) + "' fill='" + colour + "'>" +
             Escaped(series_[i]->name) + "</text>\n";
    }
    return svg;
  }

 private:
  void Include(double value) {
    if (!std::isfinite(value)) return;
    low_ = std::min(low_, value);
    high_ = std::max(high_, value);
  }
  double X(double time) const { return kLeft + (kWidth - kLeft - kRight) * time / end_; }
  double Y(double value) const { return y0_ + kPanel * (high_ - value) / (high_ - low_); }

  std::string Line(double t0, double v0, double t1, double v1, const char* colour, const char* dashes) const {
    return "<line x1='" + Number(X(t0), "%.1f") + "' y1='" + Number(Y(v0), "%.1f") + "' x2='" +
           Number(X(t1), "%.1f") + "' y2='" + Number(Y(v1), "%.1f") + "' stroke='" + colour +
           (dashes[0] != '\0' ? std::string("' stroke-dasharray='") + dashes : "") + "'/>\n";
  }

  std::string DrawSeries(const LogSeries& series, const char* colour) const {
    std::string svg, points;
    const auto finish = [&] {
      if (!points.empty())
        svg += "<polyline fill='none' stroke-width='1.3' stroke='" + std::string(colour) + "' points='" +
               points + "'/>\n";
      points.clear();
    };
    for (size_t i = 0; i < std::min(series.values.size(), log_.times.size()); ++i) {
      if (!std::isfinite(series.values[i])) {
        finish();
        continue;
      }
      points += Number(X(log_.times[i]), "%.1f") + "," + Number(Y(series.values[i]), "%.1f") + " ";
    }
    finish();
    return svg;
  }

  const RunLog& log_;
  std::string name_;
  double y0_;
  std::vector<const LogSeries*> series_;
  double low_ = 1e300, high_ = -1e300, end_ = 1;
};

std::vector<double> ReadNumbers(const Value& list, const std::string& what, Diagnostics& diagnostics) {
  std::vector<double> numbers;
  if (!list.is_array()) {
    diagnostics.Add(list.where(), what + " is " + list.KindName(), "a list of numbers");
    return numbers;
  }
  for (const Value& item : list.items()) {
    // Values that were never measured are huge; they are not drawn.
    const bool drawn = item.kind() == Value::Kind::kNumber && std::abs(item.number()) <= kGreatestNumber;
    if (!item.is_null() && item.kind() != Value::Kind::kNumber) ReadNumber(item, what, diagnostics);
    numbers.push_back(drawn ? item.number() : std::nan(""));
  }
  return numbers;
}

}  // namespace

Value WriteRunLog(const RunLog& log) {
  const auto list = [](const std::vector<double>& numbers) {
    Value values = Value::Array();
    for (const double number : numbers)
      values.Append(std::isfinite(number) ? Value(std::round(1e6 * number) / 1e6 + 0.0) : Value());  // no −0
    return values;
  };
  Value series = Value::Array(), marks = Value::Array();
  for (const LogSeries& one : log.series) {
    series.Append(Value::Object()
                      .Set("name", one.name)
                      .Set("unit", one.unit)
                      .Set("panel", one.panel)
                      .Set("lower", one.lower)
                      .Set("upper", one.upper)
                      .Set("values", list(one.values)));
  }
  for (const auto& [time, text] : log.marks)
    marks.Append(Value::Object().Set("time_s", time).Set("text", text));
  return OutputHeader(kLogFormat, log.seed)
      .Set("scenario", log.scenario)
      .Set("time_s", list(log.times))
      .Set("series", series)
      .Set("marks", marks);
}

RunLog ReadRunLog(const Value& document) {
  Diagnostics diagnostics;
  RunLog log;
  const Value* format = document.Find("format");
  if (format == nullptr || format->AsText() != kLogFormat) {
    diagnostics.Add(
        format ? format->where() : document.where(),
        format ? "format is '" + format->AsText() + "'" : "this is not a log of a run: it lacks 'format'",
        std::string(kLogFormat) + ", as tether run --log writes it");
    diagnostics.ThrowIfAny();
  }
  ObjectReader reader(document, "the log", diagnostics);
  for (const char* known : {"format", "tether", "seed"}) reader.Optional(known);
  if (const Value* seed = document.Find("seed")) log.seed = seed->natural().value_or(0);
  log.scenario = reader.Text("scenario", "");
  if (const Value* times = reader.Required("time_s", "a list of times in s")) {
    log.times = ReadNumbers(*times, "'time_s' of the log", diagnostics);
  }
  if (const Value* series = reader.Required("series", "a list")) {
    for (const Value& item : series->items()) {
      ObjectReader one(item, "a series", diagnostics);
      LogSeries read;
      read.name = one.Text("name", "");
      read.unit = one.Text("unit", "");
      read.panel = one.Text("panel", "");
      read.lower = one.Number("lower", 0);
      read.upper = one.Number("upper", 0);
      if (const Value* values = one.Required("values", "a list of numbers"))
        read.values = ReadNumbers(*values, "'values' of series '" + read.name + "'", diagnostics);
      one.Finish();
      log.series.push_back(std::move(read));
    }
  }
  if (const Value* marks = reader.Optional("marks")) {
    for (const Value& item : marks->items()) {
      ObjectReader one(item, "a mark", diagnostics);
      const double time = one.Number("time_s", 0);
      log.marks.emplace_back(time, one.Text("text", ""));
      one.Finish();
    }
  }
  reader.Finish();
  diagnostics.ThrowIfAny();
  return log;
}

std::string DrawRunLog(const RunLog& log) {
  std::vector<std::string> panels;
  for (const LogSeries& series : log.series) {
    if (std::find(panels.begin(), panels.end(), series.panel) == panels.end()) panels.push_back(series.panel);
  }
  const double height = kTop + static_cast<double>(panels.size()) * (kPanel + kBottom) + 20;
  std::string svg =
      "<svg xmlns='http://www.w3.org/2000/svg' width='" + Number(kWidth) + "' height='" + Number(height) +
      "' font-family='sans-serif' font-size='11'>\n<rect width='100%' height='100%' fill='white'/>\n";
  for (size_t i = 0; i < panels.size(); ++i) svg += Panel(log, panels[i], static_cast<int>(i)).Draw();
  svg += "<text x='" + Number(kLeft) + "' y='" + Number(height - 8) + "' fill='#666'>" +
         Escaped(log.scenario) + ", seed " + std::to_string(log.seed) +
         "; dotted: something is grasped or let go</text>\n</svg>\n";
  return svg;
}

}  // namespace tether::evaluation
