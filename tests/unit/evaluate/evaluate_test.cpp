// SPDX-License-Identifier: Apache-2.0
// The parts of an evaluation that need no asset; the whole is tested through the command (tests/integration).
#include "evaluate/evaluate.h"

#include <gtest/gtest.h>

#include <limits>
#include <nlohmann/json.hpp>

namespace farfield {
namespace {

TEST(DefaultSamplesPerPixel, GrowWithFewerPixelsAndStayBounded) {
  int last = default_samples_per_pixel(0);
  EXPECT_EQ(last, 4096);
  for (uint64_t pixels = 1; pixels < uint64_t{1} << 40; pixels *= 3) {
    const int samples = default_samples_per_pixel(pixels);
    EXPECT_LE(samples, last);
    EXPECT_GE(samples, 8);
    EXPECT_EQ(samples % 4, 0);
    last = samples;
  }
  EXPECT_EQ(last, 8);
}

TEST(Evaluate, RefusesWhatCannotBe) {
  EvaluateOptions options;
  options.asset = "/nonexistent/oak.farfield";
  options.source = "/nonexistent/oak.obj";
  const auto missing = evaluate(options);
  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.error().code, ErrorCode::NotFound);
  options.views = 0;
  const auto no_views = evaluate(options);
  ASSERT_FALSE(no_views);
  EXPECT_EQ(no_views.error().code, ErrorCode::InvalidArgument);
}

TEST(EvaluationJson, HasTheKeysOfTheIssueAndStandardErrors) {
  Evaluation evaluation;
  evaluation.views = 12;
  evaluation.levels.resize(1);
  LevelEvaluation& level = evaluation.levels[0];
  level.entry.level = 4;
  level.entry.grid = 64;
  level.entry.resolution = 0.25;
  level.entry.triangles = 10;
  level.entry.voxels = 20;
  level.entry.file_bytes = 30;
  level.entry.resident_bytes = 40;
  level.errors.occlusion_error = {-0.01, 0.001};
  level.errors.occlusion_rms = {0.05, 0.002};
  level.errors.color_error = {0.07, 0.003};
  level.errors.color_bias = {Estimate{0.1, 0.01}, Estimate{0.2, 0.02}, Estimate{-0.3, 0.03}};

  const auto json = nlohmann::json::parse(to_json(evaluation));
  const auto& row = json["levels"][0];
  EXPECT_EQ(row["level"], 4);
  EXPECT_EQ(row["grid"], 64);
  EXPECT_EQ(row["resolution"], 0.25);
  EXPECT_EQ(row["occlusion_error"], -0.01);
  EXPECT_EQ(row["occlusion_rms"], 0.05);
  EXPECT_EQ(row["color_error"], 0.07);
  EXPECT_EQ(row["color_bias"], nlohmann::json({0.1, 0.2, -0.3}));
  EXPECT_EQ(row["triangles"], 10);
  EXPECT_EQ(row["voxels"], 20);
  EXPECT_EQ(row["bytes_disk"], 30);
  EXPECT_EQ(row["bytes_resident"], 40);
  EXPECT_EQ(row["standard_errors"]["color_bias"][2], 0.03);
}

TEST(EvaluationJson, StaysValidWithInfiniteErrors) {
  Evaluation evaluation;
  evaluation.levels.resize(1);
  evaluation.levels[0].errors.color_error.value = std::numeric_limits<double>::infinity();
  evaluation.warnings = {"name \xff"};
  EXPECT_TRUE(nlohmann::json::accept(to_json(evaluation)));
}

}  // namespace
}  // namespace farfield
