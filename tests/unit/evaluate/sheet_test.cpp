// SPDX-License-Identifier: Apache-2.0
#include "evaluate/sheet.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "evaluate/label.h"

namespace farfield {
namespace {

Image constant(int width, int height, const vec4& value) {
  Image image(width, height, {"R", "G", "B", "A"});
  for (size_t i = 0; i < image.values.size(); ++i) image.values[i] = value[static_cast<int>(i % 4)];
  return image;
}

std::vector<float> drawn(std::string_view text) {
  Image image(40, 10, {"R", "G", "B"});
  draw_text(image, 1, 1, text, vec3(1.0f));
  return image.values;
}

TEST(DrawText, LettersDifferFromEachOtherAndFromBlanks) {
  std::set<std::vector<float>> seen = {drawn(" ")};
  const std::string letters = "ABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789.,-+%/|:()_=^";
  for (const char letter : letters) seen.insert(drawn(std::string(1, letter)));
  EXPECT_EQ(seen.size(), letters.size() + 1);
  EXPECT_EQ(drawn("level"), drawn("LEVEL"));
}

TEST(DrawText, NeverLeavesTheImage) {
  Image image(5, 5, {"R", "G", "B"});
  for (const int at : {-1000000, -3, 3, 1000000}) draw_text(image, at, at, "W%8\x80", vec3(1.0f));
  EXPECT_TRUE(std::all_of(image.values.begin(), image.values.end(), [](float v) { return v == 0.0f || v == 1.0f; }));
}

TEST(MakeSheet, HasARowPerLevelAndGreyDifferenceWhereEqual) {
  const Image small = constant(4, 3, {0.2f, 0.3f, 0.1f, 1.0f}), large = constant(600, 400, {0.2f, 0.3f, 0.1f, 1.0f});
  const std::vector<SheetRow> rows = {{large, large, {"level 1", "x"}}, {small, small, {"level 2"}}};
  const Image sheet = make_sheet(rows, 100);
  EXPECT_EQ(sheet.channels, (std::vector<std::string>{"R", "G", "B"}));
  EXPECT_EQ(make_sheet(std::span(rows).first(1), 100).width, sheet.width);
  EXPECT_LT(make_sheet(std::span(rows).first(1), 100).height, sheet.height);
  // The middle of the last cell of the first row.
  const float* difference = sheet.pixel(sheet.width - 8 - 50, 16 + 50);
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(difference[c], std::pow(0.5f, 2.2f), 1e-3f);
  EXPECT_TRUE(std::all_of(sheet.values.begin(), sheet.values.end(), [](float v) { return std::isfinite(v); }));
}

TEST(MakeSheet, ShowsTooBrightAsBrightAndTooDarkAsDark) {
  const Image source = constant(8, 8, {0.2f, 0.2f, 0.2f, 1.0f});
  const std::vector<SheetRow> brighter = {{source, constant(8, 8, {0.3f, 0.3f, 0.3f, 1.0f}), {}}};
  const std::vector<SheetRow> darker = {{source, constant(8, 8, {0.1f, 0.1f, 0.1f, 1.0f}), {}}};
  const Image bright = make_sheet(brighter, 64), dark = make_sheet(darker, 64);
  const float grey = std::pow(0.5f, 2.2f);
  EXPECT_GT(bright.pixel(bright.width - 8 - 32, 16 + 32)[0], grey + 0.05f);
  EXPECT_LT(dark.pixel(dark.width - 8 - 32, 16 + 32)[0], grey - 0.05f);
}

TEST(MakeSheet, BlackAndEmptyPicturesDoNoHarm) {
  EXPECT_TRUE(make_sheet({}).values.empty());
  const Image black = constant(3, 3, vec4(0.0f));
  const Image sheet = make_sheet(std::vector<SheetRow>{{black, black, {}}}, 32);
  EXPECT_TRUE(std::all_of(sheet.values.begin(), sheet.values.end(), [](float v) { return std::isfinite(v); }));
}

}  // namespace
}  // namespace farfield
