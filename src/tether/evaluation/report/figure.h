#pragma once

#include <string>
#include <utility>
#include <vector>

#include "tether/evaluation/log/run_log.h"

namespace tether::evaluation {

/// One panel of a figure: lines over a common axis.
struct FigurePanel {
  std::string title, unit;  ///< Of the values.
  std::string axis = "s";   ///< Unit of what they are drawn over.
  std::vector<const LogSeries*> series;
  std::vector<double> marks;  ///< Dotted lines.
};

/// Panels under each other as SVG, which scales to the page it is printed on.
std::string DrawFigure(const std::vector<FigurePanel>& panels, const std::string& caption);

/// The log's margins and joints as a figure, as in paper B, figures 9–11; dotted lines where something is
/// grasped or released.
std::string DrawRunLog(const RunLog& log);

/// Text in SVG and HTML.
std::string EscapeMarkup(const std::string& text);

}  // namespace tether::evaluation
