// SPDX-License-Identifier: Apache-2.0
#include "evaluate/svg_plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace farfield {
namespace {

constexpr double kWidth = 640, kHeight = 330;
constexpr double kLeft = 64, kRight = 200, kTop = 30, kBottom = 46;  // margins; the legend is at the right
constexpr double kLegendLine = 18;

/// From values to pixels, along one side.
struct Axis {
  bool is_log = false;
  double low = 0, high = 1;  ///< values
  double begin_px = 0, end_px = 1;

  bool shows(double value) const { return std::isfinite(value) && (!is_log || value > 0); }
  double at(double value) const {
    const double share = is_log ? std::log(value / low) / std::log(high / low) : (value - low) / (high - low);
    return begin_px + share * (end_px - begin_px);
  }
  std::vector<double> ticks() const { return is_log ? log_ticks(low, high) : linear_ticks(low, high); }
};

/// Fits the values of one coordinate of all points that both axes can show.
void fit(Axis& axis, const Plot& plot, size_t coordinate, bool from_zero) {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const PlotSeries& series : plot.series)
    for (const auto& point : series.points) {
      if (!axis.shows(point[coordinate])) continue;
      low = std::min(low, point[coordinate]), high = std::max(high, point[coordinate]);
    }
  if (!(low <= high)) low = high = 1;
  if (axis.is_log) {
    axis.low = low / 1.15, axis.high = high * 1.15;
  } else {
    if (from_zero) low = std::min(low, 0.0), high = std::max(high, 0.0);
    const double room = high > low ? 0.05 * (high - low) : std::max(1e-3, 0.1 * std::abs(high));
    axis.low = from_zero && low == 0 ? 0 : low - room, axis.high = high + room;
  }
}

std::string text_at(double x, double y, std::string_view anchor, std::string_view text, std::string_view more = "") {
  return fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"{}\"{}>{}</text>\n", x, y, anchor, more,
                     xml_text(text));
}

std::string line(double x0, double y0, double x1, double y1, double opacity) {
  return fmt::format(
      "<line x1=\"{:.1f}\" y1=\"{:.1f}\" x2=\"{:.1f}\" y2=\"{:.1f}\" stroke=\"currentColor\" "
      "stroke-opacity=\"{}\"/>\n",
      x0, y0, x1, y1, opacity);
}

std::string axes_of(const Plot& plot, const Axis& x, const Axis& y) {
  constexpr double kGrid = 0.12, kFrame = 0.6;
  std::string svg;
  for (const double tick : x.ticks()) {
    svg += line(x.at(tick), y.begin_px, x.at(tick), y.end_px, kGrid);
    svg += text_at(x.at(tick), y.begin_px + 16, "middle", fmt::format("{:g}", tick));
  }
  for (const double tick : y.ticks()) {
    svg += line(x.begin_px, y.at(tick), x.end_px, y.at(tick), kGrid);
    svg += text_at(x.begin_px - 6, y.at(tick) + 4, "end", fmt::format("{:g}", tick));
  }
  svg += line(x.begin_px, y.begin_px, x.end_px, y.begin_px, kFrame);
  svg += line(x.begin_px, y.begin_px, x.begin_px, y.end_px, kFrame);
  svg += text_at(0.5 * (x.begin_px + x.end_px), kHeight - 10, "middle", plot.x_label);
  svg += text_at(kLeft - 48, 0.5 * (y.begin_px + y.end_px), "middle", plot.y_label,
                 fmt::format(" transform=\"rotate(-90 {:.1f} {:.1f})\"", kLeft - 48, 0.5 * (y.begin_px + y.end_px)));
  return svg + text_at(kLeft, 18, "start", plot.title, " font-weight=\"bold\"");
}

std::string series_svg(const PlotSeries& series, const Axis& x, const Axis& y) {
  std::string path, dots;
  for (const auto& [px, py] : series.points) {
    if (!x.shows(px) || !y.shows(py)) continue;
    path += fmt::format("{:.1f},{:.1f} ", x.at(px), y.at(py));
    dots += fmt::format("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"3\" fill=\"{}\"/>\n", x.at(px), y.at(py),
                        plot_color(series.color));
  }
  std::string svg;
  if (series.has_line && !path.empty())
    svg += fmt::format("<polyline fill=\"none\" stroke=\"{}\" stroke-width=\"1.8\"{} points=\"{}\"/>\n",
                       plot_color(series.color), series.is_dashed ? " stroke-dasharray=\"6 4\"" : "", path);
  return series.has_dots ? svg + dots : svg;
}

std::string legend_svg(const Plot& plot) {
  std::string svg;
  double y = kTop + 10;
  for (const PlotSeries& series : plot.series) {
    const double x = kWidth - kRight + 14;
    svg += fmt::format("<line x1=\"{}\" y1=\"{}\" x2=\"{}\" y2=\"{}\" stroke=\"{}\" stroke-width=\"3\"{}/>\n", x, y,
                       x + 18, y, plot_color(series.color), series.is_dashed ? " stroke-dasharray=\"6 3\"" : "");
    svg += text_at(x + 24, y + 4, "start", series.name);
    y += kLegendLine;
  }
  return svg;
}

}  // namespace

std::string_view plot_color(size_t color) {
  // Grey for what others are held against; six of Okabe and Ito, which colour-blind people tell apart; and three more.
  constexpr std::array<std::string_view, 10> kColors = {"#777777", "#0072b2", "#e69f00", "#009e73", "#d55e00",
                                                        "#cc79a7", "#56b4e9", "#7f3c8d", "#8c564b", "#aabb00"};
  return kColors[color % kColors.size()];
}

std::string xml_text(std::string_view text) {
  std::string safe;
  for (const char c : text) {
    if (c == '&')
      safe += "&amp;";
    else if (c == '<')
      safe += "&lt;";
    else if (c == '>')
      safe += "&gt;";
    else if (c == '"')
      safe += "&quot;";
    else
      safe += static_cast<unsigned char>(c) < 0x20 ? '?' : c;
  }
  return safe;
}

std::vector<double> linear_ticks(double low, double high) {
  const double rough = (high - low) / 5;
  const double power = std::pow(10.0, std::floor(std::log10(rough)));
  double step = 10 * power;
  for (const double factor : {5.0, 2.0, 1.0})
    if (factor * power >= rough) step = factor * power;
  std::vector<double> ticks;
  for (double i = std::ceil(low / step); i * step <= high; ++i) ticks.push_back(i == 0 ? 0.0 : i * step);  // never -0
  return ticks;
}

std::vector<double> log_ticks(double low, double high) {
  std::vector<double> tens, all;
  for (double power = std::floor(std::log10(low)); power <= std::ceil(std::log10(high)); ++power)
    for (const double factor : {1.0, 2.0, 5.0}) {
      const double tick = factor * std::pow(10.0, power);
      if (tick < low || tick > high) continue;
      all.push_back(tick);
      if (factor == 1.0) tens.push_back(tick);
    }
  if (all.size() < 3) return linear_ticks(low, high);
  return tens.size() >= 4 ? tens : all;
}

std::string svg_of(const Plot& plot) {
  Axis x{plot.is_log_x, 0, 1, kLeft, kWidth - kRight};
  Axis y{plot.is_log_y, 0, 1, kHeight - kBottom, kTop};
  fit(x, plot, 0, false);
  fit(y, plot, 1, true);
  const double height = std::max(kHeight, kTop + 20 + kLegendLine * static_cast<double>(plot.series.size()));
  std::string svg = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {} {}\" width=\"{}\" font-size=\"12\" "
      "fill=\"currentColor\" role=\"img\" aria-label=\"{}\">\n",
      kWidth, height, kWidth, xml_text(plot.title));
  svg += axes_of(plot, x, y);
  for (const PlotSeries& series : plot.series) svg += series_svg(series, x, y);
  return svg + legend_svg(plot) + "</svg>\n";
}

}  // namespace farfield
