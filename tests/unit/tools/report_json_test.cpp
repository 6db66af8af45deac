// SPDX-License-Identifier: Apache-2.0
#include "tools/report_json.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

namespace farfield::tool {
namespace {

TEST(BakeReportJson, HasLevelsSecondsAndWarnings) {
  BakeReport report;
  report.manifest.source = "oak.obj";
  report.manifest.levels.resize(2);
  report.manifest.levels[1].level = 3;
  report.manifest.levels[1].voxels = 77;
  LevelReport stages;
  stages.level = 3;
  stages.analysis_seconds = 1.5;
  stages.simplify_seconds = 2.5;
  stages.voxelize_seconds = 3.5;
  stages.write_seconds = 0.5;
  stages.voxelized_triangles = 12;
  stages.apart = {.walls = 7, .moved = 5, .crossing = 1};
  report.levels = {stages};
  report.warnings = {"dropped 3 faces"};
  report.total_seconds = 9.0;

  const auto json = nlohmann::json::parse(bake_report_json(report));
  EXPECT_EQ(json["warnings"][0], "dropped 3 faces");
  EXPECT_EQ(json["total_seconds"], 9.0);
  ASSERT_EQ(json["levels"].size(), 2u);
  EXPECT_FALSE(json["levels"][0].contains("seconds"));  // level 0 passes no stages
  EXPECT_EQ(json["levels"][1]["level"], 3);
  EXPECT_EQ(json["levels"][1]["voxels"], 77);
  EXPECT_EQ(json["levels"][1]["voxelized_triangles"], 12);
  EXPECT_EQ(json["levels"][1]["close_walls"], nlohmann::json({{"vertices", 7}, {"moved", 5}, {"crossing", 1}}));
  EXPECT_EQ(json["levels"][1]["seconds"]["voxelize"], 3.5);
}

TEST(BakeReportJson, IsValidForAnEmptyReportAndForTextThatIsNotUtf8) {
  BakeReport report;
  EXPECT_TRUE(nlohmann::json::accept(bake_report_json(report)));
  report.warnings = {"texture \xff\xfe missing"};
  EXPECT_TRUE(nlohmann::json::accept(bake_report_json(report)));
}

}  // namespace
}  // namespace farfield::tool
