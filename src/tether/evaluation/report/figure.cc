#include "tether/evaluation/report/figure.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "tether/common/bounds.h"
#include "tether/common/text.h"
#include "tether/math/infinity.h"

namespace tether::evaluation {
namespace {

constexpr double kWidth = 960, kPanel = 210, kLeft = 70, kRight = 220, kTop = 34, kBottom = 34, kLegend = 16;
constexpr int kMostLines = 20;  // Of a grid.
constexpr std::array kColours = {"#1b6ca8", "#c8553d", "#588157", "#b08900", "#7b4b94",
                                 "#2a9d8f", "#8d5524", "#6c757d", "#d1495b", "#3a5a40"};

std::string Number(double value, const char* format = "%.4g") {
  char text[40];
  FormatInto(text, sizeof text, format, value);
  return text;
}

}  // namespace

std::string EscapeMarkup(const std::string& text) {
  std::string result;
  for (const char c : text) {
    if (c == '&')
      result += "&amp;";
    else if (c == '<')
      result += "&lt;";
    else if (c == '>')
      result += "&gt;";
    else if (c == '"')
      result += "&quot;";
    else if (c == '\'')
      result += "&#39;";
    else
      result += c;
  }
  return result;
}

namespace {

/// Values that were never measured are huge; they are not drawn.
bool IsDrawn(double value) { return std::isfinite(value) && std::abs(value) <= kGreatestNumber; }

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
  /// With its top at `y0`.
  Panel(const FigurePanel& panel, double y0)
      : panel_(panel),
        y0_(y0),
        height_(std::max(kPanel, kLegend * static_cast<double>(panel.series.size()) + 8)) {
    for (const LogSeries* series : panel.series) {
      for (const double value : series->values) Include(value);
      if (series->lower != series->upper) {
        Include(series->lower);
        Include(series->upper);
      }
      for (const double time : series->times) end_ = std::max(end_, IsDrawn(time) ? time : 0);
    }
    Include(0);
    if (!(low_ <= high_)) low_ = high_ = 0;  // Nothing is drawn.
    if (high_ - low_ < 1e-9) high_ = low_ + 1;
    const double room = 0.05 * (high_ - low_);
    low_ -= room;
    high_ += room;
  }

  double height() const { return height_; }

  std::string Draw() const {
    std::string svg = "<text x='" + Number(kLeft) + "' y='" + Number(y0_ - 8) + "' font-weight='bold'>" +
                      EscapeMarkup(panel_.title) +
                      (panel_.unit.empty() ? "" : " (" + EscapeMarkup(panel_.unit) + ")") + "</text>\n";
    svg += "<rect x='" + Number(kLeft) + "' y='" + Number(y0_) + "' width='" +
           Number(kWidth - kLeft - kRight) + "' height='" + Number(height_) +
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
      svg += "<text x='" + Number(X(time)) + "' y='" + Number(y0_ + height_ + 14) +
             "' text-anchor='middle'>" + Number(time) + " " + EscapeMarkup(panel_.axis) + "</text>\n";
    }
    for (const double time : panel_.marks) svg += Line(time, low_, time, high_, "#333", "2,3");
    for (size_t i = 0; i < panel_.series.size(); ++i) {
      const char* colour = kColours[i % kColours.size()];
      svg += DrawSeries(*panel_.series[i], colour);
      if (panel_.series[i]->lower != panel_.series[i]->upper) {
        svg += Line(0, panel_.series[i]->lower, end_, panel_.series[i]->lower, colour, "6,4");
        svg += Line(0, panel_.series[i]->upper, end_, panel_.series[i]->upper, colour, "6,4");
      }
      const double y = y0_ + 12 + kLegend * static_cast<double>(i);
      svg += "<text x='" + Number(kWidth - kRight + 10) + "' y='" + Number(y) + "' fill='" + colour + "'>" +
             EscapeMarkup(panel_.series[i]->name) + "</text>\n";
    }
    return svg;
  }

 private:
  void Include(double value) {
    if (!IsDrawn(value)) return;
    low_ = std::min(low_, value);
    high_ = std::max(high_, value);
  }
  double X(double time) const { return kLeft + (kWidth - kLeft - kRight) * time / end_; }
  double Y(double value) const { return y0_ + height_ * (high_ - value) / (high_ - low_); }

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
    for (size_t i = 0; i < std::min(series.values.size(), series.times.size()); ++i) {
      if (!IsDrawn(series.values[i]) || !IsDrawn(series.times[i])) {
        finish();
        continue;
      }
      points += Number(X(series.times[i]), "%.1f") + "," + Number(Y(series.values[i]), "%.1f") + " ";
    }
    finish();
    return svg;
  }

  const FigurePanel& panel_;
  double y0_, height_;
  double low_ = math::kInfinity, high_ = -math::kInfinity, end_ = 1e-3;
};

}  // namespace

std::string DrawFigure(const std::vector<FigurePanel>& panels, const std::string& caption) {
  std::string drawn;
  double y = kTop;
  for (const FigurePanel& one : panels) {
    const Panel panel(one, y);
    drawn += panel.Draw();
    y += panel.height() + kBottom;
  }
  const std::string width = Number(kWidth), height = Number(y + 20, "%.6g");
  return "<svg xmlns='http://www.w3.org/2000/svg' width='" + width + "' height='" + height +
         "' viewBox='0 0 " + width + " " + height +
         "' font-family='sans-serif' font-size='11'>\n<rect width='100%' height='100%' fill='white'/>\n" +
         drawn + "<text x='" + Number(kLeft) + "' y='" + Number(y + 12, "%.6g") + "' fill='#666'>" +
         EscapeMarkup(caption) + "</text>\n</svg>\n";
}

std::string DrawRunLog(const RunLog& log) {
  std::vector<FigurePanel> panels;
  for (const LogSeries& series : log.series) {
    auto panel = std::find_if(panels.begin(), panels.end(), [&](const FigurePanel& one) {
      return one.title == series.panel && one.unit == series.unit;
    });
    if (panel == panels.end()) panel = panels.insert(panels.end(), {series.panel, series.unit, "s", {}, {}});
    panel->series.push_back(&series);
  }
  for (FigurePanel& panel : panels) {
    for (const auto& [time, text] : log.marks) panel.marks.push_back(time);
  }
  return DrawFigure(panels, log.Metadata("scenario") + ", seed " + log.Metadata("seed") +
                                "; least value per interval; dotted: something is grasped or let go" +
                                (log.problem ? "; the log was cut off" : ""));
}

}  // namespace tether::evaluation
