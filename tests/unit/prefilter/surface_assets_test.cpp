// SPDX-License-Identifier: Apache-2.0
// The surface half of the bake on real and on broken assets.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <vector>

#include "cache/level.h"
#include "prefilter/condition.h"
#include "prefilter/macrosurface.h"
#include "prefilter/simplify.h"
#include "tests/support/imported_surface.h"
#include "tests/support/surfaces.h"

namespace farfield {
namespace {

namespace fs = std::filesystem;
using namespace test;

fs::path shared_assets() { return FARFIELD_SHARED_ASSETS; }

/// The faces of one class, with the vertices that they use.
Surface faces_of_class(const Surface& surface, const std::vector<uint8_t>& classes, uint8_t wanted) {
  Surface part;
  part.positions = surface.positions;
  for (size_t face = 0; face < classes.size(); ++face) {
    if (classes[face] != wanted) continue;
    part.triangles.push_back(surface.triangles[face]);
    part.materials.push_back(surface.materials[face]);
  }
  return part;
}

void expect_sound(const Surface& input, const SimplifyResult& result) {
  ASSERT_EQ(result.vertex_map.size(), input.positions.size());
  ASSERT_EQ(result.face_map.size(), input.triangles.size());
  ASSERT_EQ(result.surface.materials.size(), result.surface.triangles.size());
  for (const vec3& p : result.surface.positions) ASSERT_TRUE(is_finite(p));
  for (const uvec3& t : result.surface.triangles) {
    for (int c = 0; c < 3; ++c) ASSERT_LT(t[c], result.surface.positions.size());
  }
  for (const FaceMaterial& material : result.surface.materials) {
    ASSERT_TRUE(is_finite(material.diffuse) && is_finite(material.specular) && is_finite(material.transmission));
    ASSERT_LE(max_component(material.diffuse + material.transmission), 1.0f + 1e-4f);
    ASSERT_TRUE(material.roughness2 >= 0.0f && material.roughness2 <= 1.0f + 1e-5f);
    ASSERT_NEAR(material.sggx.trace(), 1.0f, 1e-3f);
  }
}

/// Runs the cascade down to a few faces.
void expect_sound_cascade(const Surface& source) {
  Surface surface = source;
  const float side = max_component(source.bounds().size());
  for (float grid = 512.0f; grid >= 1.0f && !surface.triangles.empty(); grid *= 0.5f) {
    const auto classes = classify_macrosurface(surface, side / grid);
    ASSERT_EQ(classes.size(), surface.triangles.size());
    const Surface macrosurface = faces_of_class(surface, classes, 1);
    SimplifyResult result = simplify(macrosurface, {.resolution = side / grid});
    ASSERT_NO_FATAL_FAILURE(expect_sound(macrosurface, result));
    surface = std::move(result.surface);
  }
}

TEST(SurfaceAssets, EveryBrokenAssetThatImportsGoesThroughAllLevels) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(fs::path(FARFIELD_TEST_DATA) / "nasty"))
    files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  size_t imported = 0;
  for (const fs::path& file : files) {
    SCOPED_TRACE(file.string());
    const auto asset = test::import_surface(file);
    if (!asset) continue;  // import's own tests say which must
    ++imported;
    expect_sound_cascade(asset->surface);
  }
  EXPECT_GT(imported, 30u);
}

TEST(SurfaceAssets, RealMeshesKeepTheirAreaLevelByLevel) {
  size_t found = 0;
  for (const char* name :
       {"meshes/suzanne_cc2.obj.gz", "meshes/spot/spot_quadrangulated.obj", "meshes/stanford-bunny.obj.gz"}) {
    if (!fs::exists(shared_assets() / name)) continue;
    ++found;
    SCOPED_TRACE(name);
    const auto asset = test::import_surface(shared_assets() / name);
    ASSERT_TRUE(asset) << asset.error().message;
    Surface surface = asset->surface;
    const float side = max_component(surface.bounds().size());
    for (float grid = 64.0f; grid >= 8.0f; grid *= 0.5f) {
      const auto classes = classify_macrosurface(surface, side / grid);
      const Surface macrosurface = faces_of_class(surface, classes, 1);
      EXPECT_GT(total_area(macrosurface), 0.85 * total_area(surface));
      SimplifyResult result = simplify(macrosurface, {.resolution = side / grid});
      const double area = total_area(macrosurface);
      EXPECT_NEAR(total_area(result.surface), area, (grid > 8.0f ? 0.003 : 0.015) * area);
      surface = std::move(result.surface);
    }
    EXPECT_LT(surface.triangles.size(), 1500u);
  }
  if (found == 0)
    GTEST_SKIP() << shared_assets() / "meshes"
                 << " is absent";
}

TEST(SurfaceAssets, LeavesAndTwigsOfATreeLeaveTheSurfaceLevelByLevel) {
  const fs::path file = shared_assets() / "trees/small_maple.obj.gz";
  if (!fs::exists(file)) GTEST_SKIP() << file << " is absent";
  const auto asset = test::import_surface(file);
  ASSERT_TRUE(asset) << asset.error().message;
  Surface surface = asset->surface;
  const float side = max_component(surface.bounds().size());
  double part = 1.0;
  for (float grid = 512.0f; grid >= 16.0f; grid *= 0.5f) {
    const auto classes = classify_macrosurface(surface, side / grid);
    const Surface macrosurface = faces_of_class(surface, classes, 1);
    const double now = total_area(macrosurface) / total_area(asset->surface);
    EXPECT_LT(now, part);
    part = now;
    if (grid == 512.0f) {
      EXPECT_GT(part, 0.5);  // r = 23 mm: leaves of 14 cm are macrosurface
    }
    SimplifyResult result = simplify(macrosurface, {.resolution = side / grid});
    EXPECT_NEAR(total_area(result.surface), total_area(macrosurface), 0.01 * total_area(macrosurface));
    surface = std::move(result.surface);
  }
  EXPECT_LT(part, 0.01);  // r = 74 cm: nothing is
}

}  // namespace
}  // namespace farfield
