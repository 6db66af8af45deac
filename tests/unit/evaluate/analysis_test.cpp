// SPDX-License-Identifier: Apache-2.0
#include "evaluate/analysis.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <nlohmann/json.hpp>

#include "base/parallel.h"
#include "evaluate/analysis_pictures.h"
#include "tests/support/files.h"
#include "tests/support/surfaces.h"

namespace farfield {
namespace {

std::string obj_text(const Surface& surface) {
  std::string text;
  for (const vec3& p : surface.positions) text += fmt::format("v {} {} {}\n", p.x, p.y, p.z);
  for (const uvec3& t : surface.triangles) text += fmt::format("f {} {} {}\n", t.x + 1, t.y + 1, t.z + 1);
  return text;
}

/// A square of side 1, and above it ten strips of length 1 and width 0.002, two triangles each.
Surface square_and_strips() {
  Surface surface = test::make_plane(16, 16, 1.0f, 1.0f);
  for (int i = 0; i < 10; ++i) {
    Surface strip = test::make_plane(1, 1, 1.0f, 0.002f);
    for (vec3& p : strip.positions) p += vec3(0.0f, 0.09f * static_cast<float>(i), 0.5f);
    surface = test::join(surface, strip);
  }
  return surface;
}

AnalyseOptions options_for(const std::filesystem::path& source, uint32_t finest, uint32_t coarsest) {
  AnalyseOptions options;
  options.source = source;
  options.bake.finest_grid = finest;
  options.bake.coarsest_grid = coarsest;
  return options;
}

TEST(NormalRoughness, IsTheAlphaOfTheEllipsoid) {
  FaceMaterial face;
  face.sggx = SymMat3::outer(vec3(0, 0, 1));
  EXPECT_EQ(normal_roughness(face, vec3(0, 0, 1)), 0.0f);
  face.sggx = {0.04f, 0.04f, 1, 0, 0, 0};
  EXPECT_FLOAT_EQ(normal_roughness(face, vec3(0, 0, 1)), 0.2f);
  face.sggx = SymMat3::identity();
  EXPECT_FLOAT_EQ(normal_roughness(face, vec3(1, 0, 0)), 1.0f);
  EXPECT_EQ(normal_roughness(FaceMaterial{}, vec3(1, 0, 0)), 0.0f);
}

TEST(Analyse, SharesAreThoseOfTheAreas) {
  const test::TemporaryFolder folder;
  const auto source = folder.write("strips.obj", obj_text(square_and_strips()));
  const auto analysis = analyse(options_for(source, 16, 8));
  ASSERT_TRUE(analysis) << analysis.error().message;
  ASSERT_FALSE(analysis->levels.empty());
  for (const LevelAnalysis& level : analysis->levels) {
    EXPECT_NEAR(level.macrosurface_share, 1 / 1.02, 1e-5) << level.grid;
    EXPECT_EQ(level.sub_resolution, 20u);
    EXPECT_LE(level.face_size.median, level.face_size.most);
    EXPECT_LT(level.normal_roughness, 1e-3);  // it is plane
  }
  EXPECT_EQ(folder.names(), std::vector<std::string>{"strips.obj"});  // nothing is left beside it
}

TEST(Analyse, CoarserLevelsOfASphereAreRougherAndSmaller) {
  const test::TemporaryFolder folder;
  const auto source = folder.write("ball.obj", obj_text(test::make_sphere(200, 100, 1.0f)));
  AnalyseOptions options = options_for(source, 32, 8);
  options.compare = true;
  options.cell_px = 64;
  const auto analysis = analyse(options);
  ASSERT_TRUE(analysis) << analysis.error().message;
  ASSERT_EQ(analysis->levels.size(), 3u);
  double roughness = 0;
  for (const LevelAnalysis& level : analysis->levels) {
    EXPECT_GT(level.normal_roughness, roughness);
    roughness = level.normal_roughness;
    EXPECT_EQ(level.macrosurface_share, 1);
    EXPECT_LE(level.face_size.most, 1.01);
    ASSERT_EQ(level.simplifiers.size(), has_quadrics() ? 4u : 3u);
    for (const SimplifierFigures& figures : level.simplifiers) {
      EXPECT_GT(figures.rms, 0);
      EXPECT_LT(figures.farthest, 0.3) << figures.name;
      ASSERT_TRUE(figures.volume_change);
    }
    EXPECT_EQ(level.simplifiers[0].faces, level.faces);
    // What each placement keeps is what its name says.
    EXPECT_LT(std::abs(level.simplifiers[0].area_change), std::abs(level.simplifiers[2].area_change));
    EXPECT_LT(std::abs(*level.simplifiers[1].volume_change), std::abs(*level.simplifiers[2].volume_change));
    ASSERT_EQ(level.pictures.size(), 3u);
    const float* middle = level.pictures[0].pixel(level.pictures[0].width / 2, level.pictures[0].height / 2);
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(middle[c], kMacrosurfaceColor[c], 0.05f * kMacrosurfaceColor[c] + 1e-3f);
  }
  const Image sheet = analysis_sheet(*analysis);
  EXPECT_GT(sheet.width, 3 * 64);
  EXPECT_GT(sheet.height, 3 * 60);
  const auto json = nlohmann::json::parse(to_json(*analysis));
  EXPECT_EQ(json["levels"][2]["simplified_faces"], analysis->levels[2].faces);
  EXPECT_EQ(json["levels"][0]["simplifiers"].size(), analysis->levels[0].simplifiers.size());
}

TEST(Analyse, DoesNotDependOnThreads) {
  const test::TemporaryFolder folder;
  const auto source = folder.write("strips.obj", obj_text(square_and_strips()));
  AnalyseOptions options = options_for(source, 16, 8);
  options.cell_px = 48;
  const auto with_threads = [&](int threads) {
    const ThreadLimit limit(threads);
    return analyse(options);
  };
  const auto one = with_threads(1), two = with_threads(2);
  ASSERT_TRUE(one && two);
  EXPECT_EQ(to_json(*one), to_json(*two));
  EXPECT_EQ(analysis_sheet(*one).values, analysis_sheet(*two).values);
}

TEST(Analyse, SaysWhatItCannotDo) {
  const test::TemporaryFolder folder;
  const auto source = folder.write("ball.obj", obj_text(test::make_sphere(40, 20, 1.0f)));
  AnalyseOptions options = options_for(source, 16, 8);
  options.view = 12;
  EXPECT_EQ(analyse(options).error().code, ErrorCode::InvalidArgument);
  options = options_for(folder.path() / "none.obj", 16, 8);
  EXPECT_NE(analyse(options).error().message.find("none.obj"), std::string::npos);
  options = options_for(folder.write("fog.vdb", "x"), 16, 8);
  EXPECT_EQ(analyse(options).error().code, ErrorCode::Unsupported);
  const std::atomic<bool> cancel = true;
  options = options_for(source, 16, 8);
  options.bake.job.cancel = &cancel;
  EXPECT_EQ(analyse(options).error().code, ErrorCode::Cancelled);
}

TEST(AnalysisSheet, OfNoLevelsIsEmpty) { EXPECT_TRUE(analysis_sheet({}).values.empty()); }

}  // namespace
}  // namespace farfield
