// SPDX-License-Identifier: Apache-2.0
// What `farfield info` says of a source, held against sources whose areas and colours are known.
#include "evaluate/source_summary.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/support/files.h"
#include "tests/support/png_files.h"

namespace farfield {
namespace {

using Texts = std::vector<std::string>;

/// A square of side 3 and three triangles of area 1/2, far from the origin; sheet.png is not there.
const char* const kObj =
    "mtllib a.mtl\n"
    "v 1000 0 0\nv 1003 0 0\nv 1003 3 0\nv 1000 3 0\n"
    "v 1000 0 1\nv 1001 0 1\nv 1000 1 1\n"
    "v 1000 0 2\nv 1001 0 2\nv 1000 1 2\n"
    "v 1000 0 4\nv 1001 0 4\nv 1000 1 4\n"
    "vt 0 0\nvt 1 0\nvt 0 1\n"
    "usemtl soot\nf 5 6 7\n"
    "usemtl wall\nf 1 2 3 4\n"
    "usemtl glow\nf 8 9 10\n"
    "usemtl sheet\nf 11/1 12/2 13/3\n";
const char* const kMtl =
    "newmtl soot\nKd 0 0 0\n"
    "newmtl wall\nKd 0.5 0.25 0.125\n"
    "newmtl glow\nKd 0 0 0\nKe 2 1 0\n"
    "newmtl sheet\nKd 0.5 0.5 0.5\nmap_Kd sheet.png\n"
    "newmtl spare\nKd 1 1 1\n";

class SummaryOfAnObj : public testing::Test {
 protected:
  test::TemporaryFolder folder;

  void SetUp() override { folder.write("a.mtl", kMtl); }
  SourceSummary summary() {
    auto result = summarise_source(folder.write("a.obj", kObj));
    EXPECT_TRUE(result) << result.error().message;
    return result.value_or(SourceSummary{});
  }
  static MaterialSummary material(const SourceSummary& summary, const std::string& name) {
    const auto found =
        std::find_if(summary.materials.begin(), summary.materials.end(), [&](const auto& m) { return m.name == name; });
    EXPECT_NE(found, summary.materials.end()) << name;
    return found == summary.materials.end() ? MaterialSummary{} : *found;
  }
};

TEST_F(SummaryOfAnObj, CountsAndBoundsAreInTheSourcesSpace) {
  const SourceSummary all = summary();
  EXPECT_EQ(all.polygons, 4u);
  EXPECT_EQ(all.triangles, 5u);
  EXPECT_EQ(all.vertices, 13u);
  EXPECT_EQ(all.lower, dvec3(1000, 0, 0));
  EXPECT_EQ(all.upper, dvec3(1003, 3, 4));
  EXPECT_NEAR(all.area, 10.5, 1e-4);
}

TEST_F(SummaryOfAnObj, MaterialsComeByAreaAndTheirSharesAddUp) {
  const SourceSummary all = summary();
  ASSERT_EQ(all.materials.size(), 4u);
  EXPECT_EQ(all.materials[0].name, "wall");
  EXPECT_NEAR(all.materials[0].area_share, 9 / 10.5, 1e-5);
  EXPECT_EQ(all.materials[0].triangles, 2u);
  double sum = 0;
  for (const MaterialSummary& m : all.materials) sum += m.area_share;
  EXPECT_NEAR(sum, 1, 1e-12);
}

TEST_F(SummaryOfAnObj, ColoursAreTheFiles) {
  const SourceSummary all = summary();
  const MaterialSummary wall = material(all, "wall");
  EXPECT_NEAR(wall.albedo.x - wall.albedo.y, 0.25f, 0.02f);  // the specular lobe adds nearly the same to both
  EXPECT_EQ(wall.opacity, 1);
  EXPECT_EQ(wall.suspicions(), Texts{});
  EXPECT_EQ(material(all, "glow").emission, vec3(2, 1, 0));
}

TEST_F(SummaryOfAnObj, WhatLooksWrongIsSaid) {
  const SourceSummary all = summary();
  EXPECT_EQ(material(all, "soot").suspicions(), Texts{"black"});
  EXPECT_EQ(material(all, "glow").suspicions(), Texts{}) << "a lamp may be black";
  EXPECT_EQ(material(all, "sheet").suspicions(), Texts{"base colour map missing"});
  ASSERT_FALSE(all.warnings.empty());
  EXPECT_NE(all.warnings[0].find("sheet.png"), std::string::npos) << all.warnings[0];
}

TEST_F(SummaryOfAnObj, AMapThatIsThereHasItsSizeAndItsMean) {
  folder.write("sheet.png", test::png(2, 1, {{255, 255, 255, 255}, {255, 255, 255, 255}}));
  const MaterialSummary sheet = material(summary(), "sheet");
  ASSERT_EQ(sheet.maps.size(), 1u);
  EXPECT_EQ(sheet.maps[0].use, "base colour");
  EXPECT_EQ(sheet.maps[0].width, 2);
  EXPECT_EQ(sheet.maps[0].height, 1);
  EXPECT_EQ(sheet.suspicions(), Texts{});
}

TEST(MaterialSummary, WhatCannotBeSeenIsTransparentAndNotBlack) {
  MaterialSummary glass;
  glass.opacity = 0.5f * kTransparentOpacity;
  EXPECT_EQ(glass.suspicions(), Texts{"fully transparent"});
  glass.opacity = 2 * kTransparentOpacity;
  EXPECT_EQ(glass.suspicions(), Texts{"black"});
  glass.transmission = vec3(0, 0.5f, 0);  // a leaf that only lets light through
  EXPECT_EQ(glass.suspicions(), Texts{});
}

TEST(SourceSummary, OfAFileThatIsNotThereIsItsError) {
  const auto none = summarise_source("/nonexistent/oak.obj");
  ASSERT_FALSE(none);
  EXPECT_EQ(none.error().code, ErrorCode::NotFound);
}

}  // namespace
}  // namespace farfield
