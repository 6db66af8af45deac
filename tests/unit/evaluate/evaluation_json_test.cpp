// SPDX-License-Identifier: Apache-2.0
#include "evaluate/evaluation_json.h"

#include <gtest/gtest.h>

#include <limits>
#include <nlohmann/json.hpp>

namespace farfield {
namespace {

/// One level, seen in daylight and from behind in two views.
Evaluation sample_evaluation() {
  Evaluation evaluation;
  evaluation.views = 2;
  evaluation.directions = {{1, 0, 0}, {0, 0, 1}};
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
  level.errors.occlusion_rms = {0.05, 0.044, 0.056, 0.002};
  level.errors.color_error = {0.07, 0.061, 0.079, 0.003};
  level.errors.color_bias = {Estimate{0.1, 0.01}, Estimate{0.2, 0.02}, Estimate{-0.3, 0.03}};
  level.views.resize(2);
  level.views[1].occlusion_error = {-0.04, 0.002};
  level.worst_view = 1;
  for (const Light light : {Light::Daylight, Light::Behind}) {
    level.lights.push_back({light, level.errors, {level.errors, level.errors}, 1});
    level.lights.back().errors.color_rms[2] = {0.5, 0.4, 0.6, 0.01};
  }
  level.depth.camera.mean = {0.003, 0.001};
  return evaluation;
}

nlohmann::json level_of(const Evaluation& evaluation) {
  return nlohmann::json::parse(to_json(evaluation))["levels"][0];
}

TEST(EvaluationJson, HasTheKeysOfTheIssueAndStandardErrors) {
  const auto row = level_of(sample_evaluation());
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
  EXPECT_EQ(row["bounds"]["color_error"], nlohmann::json({0.061, 0.079}));
  EXPECT_EQ(row["depth"]["camera_mean"], 0.003);
}

TEST(EvaluationJson, NamesLightsAndWorstViews) {
  const auto row = level_of(sample_evaluation());
  EXPECT_EQ(row["worst_view"]["view"], 1);
  EXPECT_EQ(row["worst_view"]["direction"], nlohmann::json({0.0, 0.0, 1.0}));
  EXPECT_EQ(row["worst_view"]["occlusion_error"], -0.04);
  ASSERT_EQ(row["lights"].size(), 2u);
  const auto& behind = row["lights"][1];
  EXPECT_EQ(behind["light"], "behind");
  EXPECT_EQ(behind["color_rms_4x4"], 0.5);
  EXPECT_EQ(behind["worst_view"]["view"], 1);
  ASSERT_EQ(behind["views"].size(), 2u);
  EXPECT_EQ(behind["views"][0]["direction"], nlohmann::json({1.0, 0.0, 0.0}));
  EXPECT_EQ(behind["views"][1]["color_bias"][1], 0.2);
}

TEST(EvaluationJson, IsNullWithBoundsWhereNoiseWins) {
  Evaluation evaluation = sample_evaluation();
  evaluation.levels[0].errors.color_error = {std::nullopt, 0.01, 0.2, 0.0};
  const auto row = level_of(evaluation);
  EXPECT_TRUE(row["color_error"].is_null());
  EXPECT_TRUE(row["standard_errors"]["color_error"].is_null());
  EXPECT_EQ(row["bounds"]["color_error"], nlohmann::json({0.01, 0.2}));
}

TEST(EvaluationJson, HasNoColorOfTheLevelWithoutDaylight) {
  Evaluation evaluation = sample_evaluation();
  evaluation.levels[0].lights.erase(evaluation.levels[0].lights.begin());
  const auto row = level_of(evaluation);
  EXPECT_FALSE(row.contains("color_error"));
  EXPECT_TRUE(row.contains("occlusion_error"));
  EXPECT_EQ(row["lights"][0]["color_error"], 0.07);
}

TEST(EvaluationJson, StaysValidWithInfiniteErrors) {
  Evaluation evaluation = sample_evaluation();
  evaluation.levels[0].errors.color_error.value = std::numeric_limits<double>::infinity();
  evaluation.warnings = {"name \xff"};
  EXPECT_TRUE(nlohmann::json::accept(to_json(evaluation)));
}

}  // namespace
}  // namespace farfield
