// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>

#include "evaluate/analysis.h"
#include "evaluate/analysis_pictures.h"
#include "evaluate/label.h"

namespace farfield {
namespace {

constexpr int kGap = 8, kLine = kGlyphHeight + 2;

void paste(Image& sheet, const Image& image, int x, int y) {
  for (int row = 0; row < image.height; ++row)
    for (int column = 0; column < image.width; ++column)
      std::copy_n(image.pixel(column, row), 3, sheet.pixel(x + column, y + row));
}

/// The colours from 0 on the left to 1 on the right.
void draw_scale(Image& sheet, int x, int y, int width) {
  for (int row = 0; row < kGlyphHeight - 1; ++row)
    for (int column = 0; column < width; ++column) {
      const vec3 color = scale_color((static_cast<float>(column) + 0.5f) / static_cast<float>(width));
      for (int c = 0; c < 3; ++c) sheet.pixel(x + column, y + row)[c] = color[c];
    }
}

void draw_header(Image& sheet, int column_px) {
  constexpr int kScale = 60;
  const auto left_of = [&](int column) { return kGap + column * (column_px + kGap); };
  draw_text(sheet, left_of(0), kGap, "macrosurface", kMacrosurfaceColor);
  draw_text(sheet, left_of(0) + 13 * kGlyphWidth, kGap, "sub-resolution", kSubResolutionColor);
  draw_text(sheet, left_of(0) + 28 * kGlyphWidth, kGap, "circle: r", vec3(1.0f));
  const char* titles[] = {"longest side: 0", "roughness of normals: 0"};
  const char* ends[] = {"r", "1"};
  for (int i = 0; i < 2; ++i) {
    const int x = left_of(i + 1), scale = x + kGlyphWidth * (static_cast<int>(std::string_view(titles[i]).size()) + 1);
    draw_text(sheet, x, kGap, titles[i], vec3(1.0f));
    draw_scale(sheet, scale, kGap, kScale);
    draw_text(sheet, scale + kScale + kGlyphWidth, kGap, ends[i], vec3(1.0f));
  }
}

void draw_captions(Image& sheet, const LevelAnalysis& level, int column_px, int y) {
  const std::string captions[] = {
      fmt::format("level {}  {}^3  surface {:.1f}%", level.level, level.grid, 100 * level.macrosurface_share),
      fmt::format("{} faces  median {:.2f} r", level.faces, level.face_size.median),
      fmt::format("mean {:.3f}", level.normal_roughness)};
  for (int column = 0; column < 3; ++column)
    draw_text(sheet, kGap + column * (column_px + kGap), y, captions[column], vec3(1.0f));
}

}  // namespace

Image analysis_sheet(const Analysis& analysis) {
  constexpr int kLeastColumn = 40 * kGlyphWidth;  // the header's words
  int column_px = kLeastColumn, height = 2 * kGap + kLine;
  for (const LevelAnalysis& level : analysis.levels) {
    if (level.pictures.size() != 3) return {};
    column_px = std::max(column_px, level.pictures[0].width);
    height += level.pictures[0].height + kLine + kGap;
  }
  if (analysis.levels.empty()) return {};
  Image sheet(3 * column_px + 4 * kGap, height, {"R", "G", "B"});
  std::fill(sheet.values.begin(), sheet.values.end(), kSheetBackground);
  draw_header(sheet, column_px);
  int y = 2 * kGap + kLine - 2;
  for (const LevelAnalysis& level : analysis.levels) {
    for (int column = 0; column < 3; ++column)
      paste(sheet, level.pictures[static_cast<size_t>(column)], kGap + column * (column_px + kGap), y);
    y += level.pictures[0].height + 2;
    draw_captions(sheet, level, column_px, y);
    y += kLine + kGap - 2;
  }
  return sheet;
}

}  // namespace farfield
