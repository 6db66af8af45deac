// SPDX-License-Identifier: Apache-2.0
#include "tools/info_text.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>

namespace farfield::tool {
namespace {

Manifest two_levels() {
  Manifest manifest;
  manifest.generator = "farfield 0.1.0";
  manifest.source = "oak.obj";
  manifest.bounds = {vec3(0.0f), vec3(8.0f, 4.0f, 4.0f)};
  manifest.base_resolution = 0.5;
  LevelEntry fine;
  fine.level = 1;
  fine.resolution = 1.0;
  fine.grid = 8;
  fine.file = "level_1.ffl";
  fine.file_bytes = 4096;
  fine.triangles = 1234;
  fine.voxels = 32;
  fine.bricks = 1;
  fine.resident_bytes = 6 << 20;
  LevelEntry root = fine;
  root.level = 2;
  root.resolution = 2.0;
  root.grid = 4;
  root.voxels = 0;
  root.errors = LevelErrors{-0.0123, 0.045, 0.067};
  manifest.levels = {fine, root};
  return manifest;
}

TEST(Sparsity, IsTheEmptyPartOfTheBoundingGrid) {
  const Manifest manifest = two_levels();
  EXPECT_DOUBLE_EQ(sparsity(manifest, manifest.levels[0]), 1.0 - 32.0 / (8 * 4 * 4));
  EXPECT_DOUBLE_EQ(sparsity(manifest, manifest.levels[1]), 1.0);
}

TEST(Sparsity, StaysInRangeForFlatAndOverfullGrids) {
  Manifest manifest = two_levels();
  manifest.bounds = {vec3(0.0f), vec3(0.0f)};
  EXPECT_DOUBLE_EQ(sparsity(manifest, manifest.levels[0]), 0.0);
  manifest.bounds = Box3{};
  EXPECT_DOUBLE_EQ(sparsity(manifest, manifest.levels[0]), 0.0);
}

TEST(InfoTable, HasARowPerLevelWithItsErrorsIfKnown) {
  const std::string text = info_table("oak.farfield", two_levels());
  for (const char* expected : {"oak.farfield: 2 levels, 8.00 KiB", "oak.obj", "1234", "75.00 %", "6.00 MiB", "8^3",
                               "-1.23 %", "4.50 %", "6.70 %", "sparsity"})
    EXPECT_NE(text.find(expected), std::string::npos) << expected << "\n" << text;
  EXPECT_EQ(text.find("not evaluated"), std::string::npos);
}

TEST(InfoTable, SaysWhenNothingWasEvaluated) {
  Manifest manifest = two_levels();
  manifest.levels[1].errors.reset();
  EXPECT_NE(info_table("oak.farfield", manifest).find("not evaluated"), std::string::npos);
}

TEST(InfoTable, SaysHowOftenPartsStand) {
  Manifest manifest = two_levels();
  EXPECT_EQ(info_table("oak.farfield", manifest).find("places"), std::string::npos);
  manifest.levels[0].placements = 18150;
  EXPECT_NE(info_table("oak.farfield", manifest).find("stands in 18150 places"), std::string::npos);
  EXPECT_EQ(nlohmann::json::parse(info_json("oak.farfield", manifest))["levels"][0]["placements"], 18150);
}

TEST(InfoTable, SaysWhatNoiseHidesInWords) {
  Manifest manifest = two_levels();
  manifest.levels[1].errors->color_error = ErrorSize::unknown(0.0, 0.0123);
  const std::string text = info_table("oak.farfield", manifest);
  EXPECT_NE(text.find("unknown, at most 1.23 %"), std::string::npos) << text;
  EXPECT_EQ(text.find("0.00 %"), std::string::npos) << text;
  const auto level = nlohmann::json::parse(info_json("oak.farfield", manifest))["levels"][1];
  EXPECT_TRUE(level["color_error"].is_null());
  EXPECT_EQ(level["bounds"]["color_error"], nlohmann::json({0.0, 0.0123}));
}

TEST(InfoTable, ShowsHostileNamesOnOneLineEach) {
  Manifest manifest = two_levels();
  manifest.source = "evil\n\x1b[2Jname";
  const std::string text = info_table("oak.farfield", manifest), clean = info_table("oak.farfield", two_levels());
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), std::count(clean.begin(), clean.end(), '\n'));
  EXPECT_EQ(text.find('\x1b'), std::string::npos);
}

TEST(InfoJson, UsesTheKeysOfEvaluate) {
  const auto json = nlohmann::json::parse(info_json("oak.farfield", two_levels()));
  ASSERT_EQ(json["levels"].size(), 2u);
  const auto& fine = json["levels"][0];
  EXPECT_EQ(fine["level"], 1);
  EXPECT_EQ(fine["grid"], 8);
  EXPECT_EQ(fine["resolution"], 1.0);
  EXPECT_EQ(fine["triangles"], 1234);
  EXPECT_EQ(fine["voxels"], 32);
  EXPECT_EQ(fine["bytes_disk"], 4096);
  EXPECT_EQ(fine["bytes_resident"], 6 << 20);
  EXPECT_FALSE(fine.contains("color_error"));
  EXPECT_DOUBLE_EQ(json["levels"][1]["occlusion_error"], -0.0123);
  EXPECT_DOUBLE_EQ(json["levels"][1]["color_error"], 0.067);
}

TEST(InfoJson, StaysValidWithNamesThatAreNotText) {
  Manifest manifest = two_levels();
  manifest.source = "\xff\xfe\"quote";
  EXPECT_TRUE(nlohmann::json::accept(info_json("a\xc3", manifest)));
}

}  // namespace
}  // namespace farfield::tool
