// SPDX-License-Identifier: Apache-2.0
#include "evaluate/trade_page.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "base/base64.h"
#include "base/bytes.h"
#include "base/file_io.h"
#include "base/result.h"
#include "base/temporary_file.h"
#include "evaluate/difference_image.h"
#include "evaluate/figure_text.h"
#include "evaluate/svg_plot.h"
#include "evaluate/trade_advice.h"

namespace farfield {
namespace {

namespace fs = std::filesystem;

// ---- pictures ----

constexpr int kPictureWidth = 480;  ///< pixels, at most
constexpr uint64_t kMostPngBytes = 64 << 20;

Result<std::string> png_bytes(const Image& image) {
  FARFIELD_TRY_LET(const auto folder, TemporaryFolder::create());
  FARFIELD_TRY(write_png(folder.path() / "picture.png", image));
  return read_small_file(folder.path() / "picture.png", kMostPngBytes);
}

/// The mean of a frame's parts as it is shown: exposed, and small.
Result<Image> shown_frame(const Trade& trade, const fs::path& output, const TradeSetting& setting, TradeLight light,
                          int frame) {
  FARFIELD_TRY_LET(const auto parts, read_frame_parts(output, setting, light, frame));
  Image image = mean_image(parts);
  const float gain = std::exp2(trade.exposure_stops);
  for (float& value : image.values) value *= gain;
  return downsample(image, (image.width + kPictureWidth - 1) / kPictureWidth);
}

Result<TradePicture> make_picture(const Trade& trade, const fs::path& output, size_t row, size_t light) {
  const TradeUnderLight& figures = trade.rows[row].lights[light];
  TradePicture picture{row, light, trade.frames[figures.worst_frame], {}, {}, {}};
  FARFIELD_TRY_LET(const auto full,
                   shown_frame(trade, output, trade.full_detail().setting, figures.light, picture.frame));
  FARFIELD_TRY_LET(const auto level, shown_frame(trade, output, trade.rows[row].setting, figures.light, picture.frame));
  FARFIELD_TRY_LET(auto full_png, png_bytes(full));
  FARFIELD_TRY_LET(auto level_png, png_bytes(level));
  FARFIELD_TRY_LET(auto difference_png, png_bytes(difference_image(full, level)));
  picture.full = std::move(full_png), picture.setting = std::move(level_png);
  picture.difference = std::move(difference_png);
  return picture;
}

// ---- the page's parts ----

std::string label_of(const Trade& trade, size_t row) { return row == 1 ? "base" : trade.rows[row].setting.label; }

std::string_view text_of(TradeLight light) {
  return light == TradeLight::Own ? "the scene's light" : "the sun turned about";
}

std::string times_text(double ratio) { return fmt::format("{:.2f}", ratio); }

std::string time_text(const TimeRatio& time) {
  if (time.value) return std::isfinite(*time.value) ? times_text(*time.value) : "never";
  return std::isfinite(time.low) ? fmt::format("unknown, at least {:.2f}", time.low) : "unknown";
}

std::string pop_text(const ShotPop& pop) {
  if (pop.all.empty()) return "one frame";
  if (!pop.most.value) return fmt::format("unknown, {:+.2f} to {:+.2f} %", 100 * pop.most.low, 100 * pop.most.high);
  return fmt::format("{:+.2f} % ({} to {})", 100 * *pop.most.value, pop.at[0], pop.at[1]);
}

std::string bias_text(const std::array<Estimate, 3>& bias) {
  double deviation = 0;
  for (const Estimate& channel : bias) deviation = std::max(deviation, channel.standard_error);
  return fmt::format("{:+.2f} {:+.2f} {:+.2f} ±{:.2f}", 100 * bias[0].value, 100 * bias[1].value, 100 * bias[2].value,
                     100 * deviation);
}

std::string cells(const std::vector<std::string>& texts, std::string_view element) {
  std::string html = "<tr>";
  for (const std::string& text : texts) html += fmt::format("<{0}>{1}</{0}>", element, xml_text(text));
  return html + "</tr>\n";
}

std::vector<std::string> row_texts(const Trade& trade, size_t row, size_t light) {
  const TradeUnderLight& figures = trade.rows[row].lights[light];
  const TradeCost& cost = figures.cost;
  const double loading = ratio_or_zero(cost.load_seconds, cost.seconds);
  std::vector<std::string> texts = {label_of(trade, row)};
  if (row == 0)
    texts.insert(texts.end(), {"yardstick", "yardstick"});
  else
    texts.insert(texts.end(), {size_text(figures.errors.all.color_rms[0]), bias_text(figures.errors.all.color_bias)});
  texts.insert(texts.end(),
               {times_text(figures.errors.all.variance_ratio()),
                fmt::format("{:.2f} ({:.2f} s)", cpu_ratio(trade, row, light), cost.cpu_seconds),
                times_text(noise_at_equal_time(trade, row, light)), time_text(time_to_equal_error(trade, row, light)),
                format_bytes(cost.peak_accounted_bytes), format_bytes(cost.peak_rss_bytes),
                fmt::format("{:.1f} %", 100 * loading), row == 0 ? "yardstick" : pop_text(figures.pop)});
  return texts;
}

std::string table_of(const Trade& trade, size_t light) {
  std::string html =
      fmt::format("<h3>Under {}</h3>\n<div class=\"wide\"><table>\n", text_of(trade.full_detail().lights[light].light));
  html += cells({"setting", "error per pixel", "bias red green blue, %", "variance at equal samples, of full detail's",
                 "CPU time, of full detail's", "noise at equal time", "time to equal error", "memory, accounted",
                 "memory, RSS", "loading, of wall time", "shot pop"},
                "th");
  for (size_t row = 0; row < trade.rows.size(); ++row) html += cells(row_texts(trade, row, light), "td");
  return html + "</table></div>\n";
}

std::string advice_html(const Trade& trade) {
  std::string html = "<table class=\"advice\">\n";
  for (const TradeAdvice& advice : advise(trade))
    html += fmt::format("<tr><th>{}</th><td>{}</td></tr>\n", xml_text(advice.wish), xml_text(advice.text));
  return html + "</table>\n";
}

std::string legend_html() {
  return "<p class=\"note\">Error per pixel: root mean square of what differs from full detail, over touched pixels "
         "and "
         "red, green, blue, in shares of full detail's mean; noise is taken out by independent pairs of renders, and "
         "where it wins the error is unknown. Time to equal error: CPU time until noise and own error together are "
         "as large as full detail's noise at these samples; never, where the own error alone is larger. Loading is "
         "summed over loads, some beside rays: at least what rays wait. Shot pop: how much more, at the most, one "
         "frame differs from the next than at full detail, in shares of the light; it is of levels only where frames "
         "are close together. Plots leave out what is unknown, or never.</p>\n";
}

// ---- plots ----

/// Error against CPU time for any number of samples: own error and noise, whose variance falls with time.
PlotSeries error_over_time(const Trade& trade, size_t row, size_t light) {
  constexpr int kSteps = 48;
  const TradeUnderLight& figures = trade.rows[row].lights[light];
  const double own = figures.errors.all.color_rms[0].value.value_or(0.0);
  PlotSeries series{label_of(trade, row), row, {}, row == 0, true, false};
  for (int step = 0; step <= kSteps; ++step) {
    const double samples = std::exp2(-4.0 + 12.0 * step / kSteps);  // of those that were rendered
    const double error = std::sqrt(own * own + figures.errors.all.variance / samples);
    series.points.push_back({samples * figures.cost.cpu_seconds, 100 * error});
  }
  return series;
}

using Points = std::vector<std::array<double, 2>>;

Points error_over_memory(const Trade& trade, size_t row, size_t light) {
  const TradeUnderLight& figures = trade.rows[row].lights[light];
  const Bounded& error = figures.errors.all.color_rms[0];
  if (!error.value) return {};
  return {{static_cast<double>(figures.cost.peak_accounted_bytes) / (1 << 20), 100 * *error.value}};
}

Points error_of_frames(const Trade& trade, size_t row, size_t light) {
  const TradeUnderLight& figures = trade.rows[row].lights[light];
  Points points;
  for (size_t i = 0; i < trade.frames.size(); ++i)
    if (const auto& error = figures.errors.frames[i].color_rms[0]; error.value)
      points.push_back({static_cast<double>(trade.frames[i]), 100 * *error.value});
  return points;
}

Points time_of_frames(const Trade& trade, size_t row, size_t light) {
  const TradeUnderLight& figures = trade.rows[row].lights[light];
  Points points;
  for (size_t i = 0; i < trade.frames.size(); ++i)
    points.push_back({static_cast<double>(trade.frames[i]), figures.cost.frame_cpu_seconds[i]});
  return points;
}

Points equal_error_of_frames(const Trade& trade, size_t row, size_t light) {
  Points points;
  for (size_t i = 0; i < trade.frames.size(); ++i)
    if (const TimeRatio time = time_to_equal_error(trade, row, light, i); time.value)
      points.push_back({static_cast<double>(trade.frames[i]), *time.value});
  return points;
}

Points change_of_frames(const Trade& trade, size_t row, size_t light) {
  const TradeUnderLight& figures = trade.rows[row].lights[light];
  Points points;
  for (size_t i = 0; i < figures.changes.size(); ++i)
    if (const auto& change = figures.changes[i]; change.value)
      points.push_back({0.5 * (trade.frames[i] + trade.frames[i + 1]), 100 * *change.value});
  return points;
}

/// A plot with a series for each setting. What is unknown is not in it.
std::string plot_of(const Trade& trade, size_t light, Plot plot,
                    Points (*points)(const Trade& trade, size_t row, size_t light)) {
  for (size_t row = 0; row < trade.rows.size(); ++row)
    plot.series.push_back({label_of(trade, row), row, points(trade, row, light), row == 0, true, true});
  return svg_of(plot);
}

std::string plots_of(const Trade& trade, size_t light) {
  Plot over_time{
      "Error over CPU time", "CPU s of the shot, for more or fewer samples", "own error and noise, %", true, true, {}};
  for (size_t row = 0; row < trade.rows.size(); ++row) over_time.series.push_back(error_over_time(trade, row, light));
  std::string html = "<div class=\"plots\">\n" + svg_of(over_time);
  html += plot_of(trade, light, {"Error over memory", "MiB accounted, peak", "error per pixel, %", true, false, {}},
                  error_over_memory);
  html +=
      plot_of(trade, light, {"Error of each frame", "frame", "error per pixel, %", false, false, {}}, error_of_frames);
  html += plot_of(trade, light, {"CPU time of each frame", "frame", "CPU s", false, false, {}}, time_of_frames);
  html += plot_of(trade, light, {"Time to equal error in each frame", "frame", "of full detail's", false, true, {}},
                  equal_error_of_frames);
  if (trade.frames.size() > 1)
    html += plot_of(trade, light, {"Change from frame to frame", "frame", "of the light, %", false, false, {}},
                    change_of_frames);
  return html + "</div>\n";
}

std::string picture_html(const std::string& png, const std::string& caption) {
  return fmt::format("<figure><img src=\"data:image/png;base64,{}\" alt=\"{}\"/><figcaption>{}</figcaption></figure>\n",
                     base64(png), xml_text(caption), xml_text(caption));
}

std::string pictures_html(const Trade& trade, const std::vector<TradePicture>& pictures) {
  std::string html;
  for (const TradePicture& picture : pictures) {
    const TradeUnderLight& figures = trade.rows[picture.row].lights[picture.light];
    const std::string label = label_of(trade, picture.row);
    html += fmt::format("<h3>{}, {}, frame {}: error per pixel {}</h3>\n<div class=\"pictures\">\n", xml_text(label),
                        text_of(figures.light), picture.frame,
                        xml_text(size_text(figures.errors.frames[figures.worst_frame].color_rms[0])));
    html += picture_html(picture.setting, label);
    html += picture_html(picture.full, "full detail");
    html += picture_html(picture.difference, "difference, twofold (grey: none)") + "</div>\n";
  }
  return html;
}

std::string warnings_html(const Trade& trade) {
  if (trade.warnings.empty()) return "";
  std::string html = "<h2>Warnings</h2>\n<ul>\n";
  for (const std::string& warning : trade.warnings) html += "<li>" + xml_text(warning) + "</li>\n";
  return html + "</ul>\n";
}

constexpr std::string_view kStyle = R"(
:root { color-scheme: light dark; }
body { font: 15px/1.45 system-ui, sans-serif; margin: 2em auto; max-width: 1380px; padding: 0 1em; }
table { border-collapse: collapse; }
th, td { padding: 0.35em 0.7em; border-bottom: 1px solid #8884; text-align: right; vertical-align: top; }
th { font-weight: 600; }
th:first-child, td:first-child { text-align: left; white-space: nowrap; }
.advice th, .advice td { text-align: left; }
.wide { overflow-x: auto; }
.wide table { font-size: 13px; }
.note { max-width: 62em; opacity: 0.8; font-size: 13px; }
.plots { display: flex; flex-wrap: wrap; gap: 1em; }
.plots svg { max-width: 100%; }
.pictures { display: grid; grid-template-columns: repeat(3, 1fr); gap: 0.8em; }
figure { margin: 0; }
figure img { width: 100%; display: block; }
figcaption { font-size: 13px; opacity: 0.8; }
)";

}  // namespace

Result<std::vector<TradePicture>> trade_pictures(const Trade& trade, const fs::path& output) {
  std::vector<TradePicture> pictures;
  for (size_t row = 1; row < trade.rows.size(); ++row)
    for (size_t light = 0; light < trade.rows[row].lights.size(); ++light) {
      FARFIELD_TRY_LET(auto picture, make_picture(trade, output, row, light));
      pictures.push_back(std::move(picture));
    }
  return pictures;
}

std::string trade_page(const Trade& trade, const std::vector<TradePicture>& pictures) {
  const std::string title = "What each knob brings and costs: " + trade.scene;
  std::string html = fmt::format(
      "<!DOCTYPE html>\n<html xmlns=\"http://www.w3.org/1999/xhtml\" lang=\"en\">\n<head><meta charset=\"utf-8\"/>\n"
      "<title>{0}</title>\n<style>{1}</style></head>\n<body>\n<h1>{0}</h1>\n",
      xml_text(title), kStyle);
  html += fmt::format("<p>{} frames, {} to {}, {}x{}, {} x {} samples per pixel, {} threads.</p>\n",
                      trade.frames.size(), trade.frames.front(), trade.frames.back(), trade.width, trade.height, kParts,
                      trade.samples_per_pixel, trade.threads);
  html += fmt::format("<p>The base, at which each of the others turns one knob: {}.</p>\n",
                      xml_text(trade.base().setting.label));
  html += "<h2>Which knob for which wish</h2>\n" + advice_html(trade);
  html += "<h2>Figures</h2>\n";
  const size_t lights = trade.full_detail().lights.size();
  for (size_t light = 0; light < lights; ++light) html += table_of(trade, light);
  html += legend_html();
  for (size_t light = 0; light < lights; ++light)
    html += fmt::format("<h2>Plots under {}</h2>\n", text_of(trade.full_detail().lights[light].light)) +
            plots_of(trade, light);
  html += "<h2>Where each setting is farthest from full detail</h2>\n" + pictures_html(trade, pictures);
  return html + warnings_html(trade) + "</body>\n</html>\n";
}

}  // namespace farfield
