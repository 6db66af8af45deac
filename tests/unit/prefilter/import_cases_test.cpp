// SPDX-License-Identifier: Apache-2.0
// Traits of exporters from public reports (tests/data/import_cases), each with its right value.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "prefilter/condition.h"
#include "tests/support/files.h"
#include "tests/support/imported_surface.h"

namespace farfield {
namespace {

using namespace test;

namespace fs = std::filesystem;

struct Seen {
  vec3 diffuse{0.0f};  ///< mean by area
  double area = 0;
  std::string warnings;
};

Seen see(const fs::path& file) {
  const auto asset = test::import_surface(file);
  EXPECT_TRUE(asset) << asset.error().message;
  Seen seen;
  if (!asset) return seen;
  const Surface& s = asset->surface;
  for (size_t i = 0; i < s.triangles.size(); ++i) {
    const vec3 a = s.positions[s.triangles[i].x];
    const float area =
        0.5f * glm::length(glm::cross(s.positions[s.triangles[i].y] - a, s.positions[s.triangles[i].z] - a));
    seen.diffuse += area * s.materials[i].diffuse;
    seen.area += area;
  }
  seen.diffuse /= static_cast<float>(seen.area);
  for (const std::string& warning : asset->warnings) seen.warnings += warning + "\n";
  return seen;
}

struct Case {
  const char* name;
  vec3 diffuse;
  double area;
  const char* warning;  ///< a part of what is said; empty: nothing may be said
};

const vec3 kHalves(0.5f, 0, 0.5f), kLeaf(0.0212f, 0.3515f, 0.0212f), kWood(0.2f, 0.5f, 0.1f);

/// Texels of the mask that are open, counted in the PNG; the cut keeps the area within 1 % of that.
constexpr double kMask = 448.0 / 1024;

class ImportCase : public ::testing::TestWithParam<Case> {};

TEST_P(ImportCase, HasItsRightValue) {
  const Case& c = GetParam();
  const Seen seen = see(fs::path(FARFIELD_TEST_DATA) / "import_cases" / (std::string(c.name) + ".obj"));
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(seen.diffuse[i], c.diffuse[i], 0.045f * c.diffuse[i] + 2e-3f) << i;
  EXPECT_NEAR(seen.area, c.area, 0.01 * c.area);
  EXPECT_NE(seen.warnings.find(c.warning), std::string::npos) << seen.warnings;
  if (!*c.warning) {
    EXPECT_EQ(seen.warnings, "");
  }
}

const Case kCases[] = {
    {"o02_empty_material", vec3(0.8f), 1, ""},
    {"o02_kd_missing", kHalves, 1, ""},
    {"o02_kd_missing_first", kHalves, 1, ""},
    {"o05_alpha_in_map_kd", kLeaf, kMask, "cut out by the alpha in leaf_rgba.png"},
    {"o05_same_file_map_d", kLeaf, kMask, ""},
    {"o08_lower_map_kd", kHalves, 1, ""},
    {"o09_pbr_maps", vec3(1.0f), 1, "map_Ks (line 9)"},
    {"o10_ks_half", kWood, 1, ""},
    {"o10_ks_illum0", kWood, 1, ""},
    {"o10_ks_one", kWood, 1, ""},
    {"o15_mtllib_after", vec3(1, 0, 0), 1, "o15_mtllib_after.obj.mtl cannot be read"},
    {"o16_bom", vec3(1, 0, 0), 1, ""},
    {"o16_bom_mtl_only", vec3(1, 0, 0), 1, ""},
    {"o16_bom_obj_only", vec3(1, 0, 0), 1, ""},
    {"o22_ke", vec3(0.0f), 1, ""},
    {"o23_clamp", vec3(0, 0, 1), 1, ""},
    {"o23_d_with_kd_alpha", kLeaf, kMask, ""},
    {"o23_map_D", kLeaf, kMask, ""},
    {"o23_map_tr", kLeaf, kMask, "line 4: map_Tr"},
    {"o25_photoscan", kHalves, 1, "taken for opaque"},
    {"o25_one_pane_of_two", vec3(0.4f, 0.1f, 0.3f), 2, "taken for opaque"},
    {"o27_kit_white_ks", vec3(0.52f, 0.42f, 0.33f), 1, ""},
    {"o29_lib_after_use", vec3(1, 0, 0), 1, ""},
};
INSTANTIATE_TEST_SUITE_P(All, ImportCase, ::testing::ValuesIn(kCases),
                         [](const auto& test) { return std::string(test.param.name); });

/// Further traits: an MTL of one material beside a quad whose texture is halves.png.
Seen see_mtl(const std::string& mtl) {
  const TemporaryFolder folder;
  fs::copy(fs::path(FARFIELD_TEST_DATA) / "import_cases/halves.png", folder.path() / "my halves.png");
  folder.write("m.mtl", mtl);
  return see(folder.write("a.obj",
                          "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n"
                          "usemtl m\nf 1/1 2/2 3/3 4/4\n"));
}

void expect_diffuse(const Seen& seen, const vec3& diffuse, const char* warning) {
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(seen.diffuse[c], diffuse[c], 2e-3f) << seen.warnings;
  EXPECT_NE(seen.warnings.find(warning), std::string::npos) << seen.warnings;
  if (!*warning) {
    EXPECT_EQ(seen.warnings, "");
  }
}

TEST(ImportTraits, FileNamesInQuotesAndFromOtherComputersAreFound) {
  expect_diffuse(see_mtl("newmtl m\nmap_Kd \"my halves.png\"\n"), kHalves, "");
  expect_diffuse(see_mtl("newmtl m\nmap_Kd C:\\scans\\my halves.png\n"), kHalves, "is taken");
}

TEST(ImportTraits, OptionsBeforeAndBehindTheNameAreReadOrNamed) {
  expect_diffuse(see_mtl("newmtl m\nmap_Kd -s 0.5 1 1 my halves.png\n"), vec3(1, 0, 0), "");
  expect_diffuse(see_mtl("newmtl m\nmap_Kd -s 0.5 1 -o 0.5 0 my halves.png\n"), vec3(0, 0, 1), "");
  expect_diffuse(see_mtl("newmtl m\nmap_Kd my halves.png -s 0.5 1 1\n"), vec3(1, 0, 0), "");
  expect_diffuse(see_mtl("newmtl m\nmap_Kd -mm 0 2 my halves.png\n"), kHalves, "map_Kd -mm (line 2)");
}

TEST(ImportTraits, BlackKdBesideATextureIsNotBlack) {
  expect_diffuse(see_mtl("newmtl m\nKd 0 0 0\nmap_Kd my halves.png\n"), kHalves, "Kd 0 beside map_Kd");
}

TEST(ImportTraits, OneNumberIsAGreyAndACommaIsNoNumber) {
  expect_diffuse(see_mtl("newmtl m\nKD 0.25\n"), vec3(0.25f), "");
  expect_diffuse(see_mtl("newmtl m\nKd 0,5 0,5 0,5\n"), vec3(0.8f), "line 2: Kd is not followed by");
}

TEST(ImportTraits, UnknownKeywordsAreNamedOnceWithTheirLine) {
  const Seen seen = see_mtl("newmtl m\nKd 0.5 0.5 0.5\nglow 1\nnewmtl n\nglow 1\n");
  expect_diffuse(seen, vec3(0.5f), "m.mtl: line 3: glow is not known");
  EXPECT_EQ(seen.warnings.find("line 5"), std::string::npos);
}

TEST(ImportTraits, AFileOfWhichNothingWouldBeLeftIsShown) {
  expect_diffuse(see_mtl("newmtl m\nKd 0.5 0.5 0.5\nd 0\n"), vec3(0.5f), "taken for opaque");
}

TEST(ImportTraits, MetallicMapSwitchesTheDiffuseColourOff) {
  // Red, 1 on the left half, is metal; the right half is white under its highlight.
  const std::string material = "newmtl m\nKd 1 1 1\nPr 0.5\nmap_Pm -s 0.5 1 ";
  expect_diffuse(see_mtl(material + "my halves.png\n"), vec3(0.0f), "");
  expect_diffuse(see_mtl(material + "-o 0.5 0 my halves.png\n"), vec3(1.0f), "");
}

TEST(ImportTraits, TheLastOfTwoDefinitionsHolds) {
  expect_diffuse(see_mtl("newmtl m\nKd 1 0 0\nnewmtl m\nKd 0 1 0\n"), vec3(0, 1, 0), "");
}

}  // namespace
}  // namespace farfield
