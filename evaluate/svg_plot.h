// SPDX-License-Identifier: Apache-2.0
// Plots as SVG, for pages that need nothing else. Pure; any thread.
#pragma once

#include <array>
#include <string>
#include <string_view>
#include <vector>

namespace farfield {

struct PlotSeries {
  std::string name;
  size_t color = 0;  ///< of a palette; the same number is the same colour in all plots
  std::vector<std::array<double, 2>>
      points;  ///< those that are not finite (or not above 0, on a log axis) are left out
  bool is_dashed = false;
  bool has_line = true, has_dots = true;
};

struct Plot {
  std::string title, x_label, y_label;
  bool is_log_x = false, is_log_y = false;  ///< linear y axes begin at 0 unless something is below
  std::vector<PlotSeries> series;
};

/// An <svg> element, well-formed as XML; colours of text and axes are the page's (currentColor).
std::string svg_of(const Plot& plot);

/// The text with &, <, > and quotes as XML wants them; control characters become "?".
std::string xml_text(std::string_view text);

/// Round values within [low, high], `low` < `high`: some five, steps of 1, 2 or 5 times a power of ten.
std::vector<double> linear_ticks(double low, double high);
/// 0 < low < high: powers of ten; with their two- and fivefold where those are few; linear where those are few, too.
std::vector<double> log_ticks(double low, double high);

/// The colour of a number, "#1f77b4".
std::string_view plot_color(size_t color);

}  // namespace farfield
