// SPDX-License-Identifier: Apache-2.0
#include "evaluate/sheet.h"

#include <algorithm>
#include <cmath>

#include "evaluate/difference_image.h"
#include "evaluate/label.h"

namespace farfield {
namespace {

constexpr int kGap = 8;
const std::vector<std::string> kRgb = {"R", "G", "B"};

vec3 read_rgb(const Image& image, int x, int y) {
  const float* p = image.pixel(x, y);
  return {p[0], p[1], p[2]};
}

void write_rgb(Image& image, int x, int y, const vec3& rgb) {
  for (int c = 0; c < 3; ++c) image.pixel(x, y)[c] = rgb[c];
}

/// Exposure that puts the mean radiance of what is covered at a middle grey, the same for all rows.
float common_exposure(std::span<const SheetRow> rows) {
  double light = 0, coverage = 0;
  for (const SheetRow& row : rows) {
    double row_light = 0, row_coverage = 0;
    for (size_t i = 0; i + 3 < row.source.values.size(); i += 4) {
      row_light += row.source.values[i] + row.source.values[i + 1] + row.source.values[i + 2];
      row_coverage += row.source.values[i + 3];
    }
    const double pixels = std::max<double>(1.0, static_cast<double>(row.source.values.size()) / 4.0);
    light += row_light / (3.0 * pixels), coverage += row_coverage / pixels;
  }
  constexpr double kTarget = 0.3;  // linear; leaves room for sunlit leaves
  return light > 0 ? static_cast<float>(kTarget * coverage / light) : 1.0f;
}

/// Over the background, exposed.
Image compose(const Image& rgba, float exposure) {
  Image out(rgba.width, rgba.height, kRgb);
  for (int y = 0; y < rgba.height; ++y)
    for (int x = 0; x < rgba.width; ++x) {
      const float alpha = rgba.pixel(x, y)[3];
      write_rgb(out, x, y, exposure * read_rgb(rgba, x, y) + kSheetBackground * (1.0f - alpha));
    }
  return out;
}

/// Every pixel n x n times.
Image enlarge(const Image& image, int n) {
  Image out(image.width * n, image.height * n, image.channels);
  for (int y = 0; y < out.height; ++y)
    for (int x = 0; x < out.width; ++x) std::copy_n(image.pixel(x / n, y / n), image.channel_count(), out.pixel(x, y));
  return out;
}

Image fit(const Image& image, int cell_px) {
  const int longest = std::max({image.width, image.height, 1});
  return longest > cell_px ? downsample(image, (longest + cell_px - 1) / cell_px) : enlarge(image, cell_px / longest);
}

/// Copies `image` into the middle of the cell whose upper left corner is at (x, y).
void paste_centered(Image& sheet, const Image& image, int x, int y, int cell_px) {
  const int left = x + (cell_px - image.width) / 2, top = y + (cell_px - image.height) / 2;
  for (int j = 0; j < image.height; ++j)
    for (int i = 0; i < image.width; ++i) write_rgb(sheet, left + i, top + j, read_rgb(image, i, j));
}

}  // namespace

Image make_sheet(std::span<const SheetRow> rows, int cell_px) {
  if (rows.empty()) return {};
  size_t caption_lines = 0;
  for (const SheetRow& row : rows) caption_lines = std::max(caption_lines, row.captions.size());
  const int row_px = cell_px + static_cast<int>(caption_lines) * (kGlyphHeight + 2) + kGap;
  const int header_px = kGlyphHeight + kGap;

  Image sheet(3 * cell_px + 4 * kGap, header_px + static_cast<int>(rows.size()) * row_px + kGap, kRgb);
  std::fill(sheet.values.begin(), sheet.values.end(), kSheetBackground);
  const char* titles[] = {"source", "level", "difference (grey: none)"};
  for (int column = 0; column < 3; ++column)
    draw_text(sheet, kGap + column * (cell_px + kGap), kGap / 2, titles[column], vec3(1.0f));

  const float exposure = common_exposure(rows);
  int y = header_px;
  for (const SheetRow& row : rows) {
    const Image source = compose(row.source, exposure), level = compose(row.level, exposure);
    const Image cells[] = {source, level, difference_image(source, level)};
    for (int column = 0; column < 3; ++column)
      paste_centered(sheet, fit(cells[column], cell_px), kGap + column * (cell_px + kGap), y, cell_px);
    int text_y = y + cell_px + 2;
    for (const std::string& caption : row.captions) {
      draw_text(sheet, kGap, text_y, caption, vec3(1.0f));
      text_y += kGlyphHeight + 2;
    }
    y += row_px;
  }
  return sheet;
}

}  // namespace farfield
