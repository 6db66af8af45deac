// SPDX-License-Identifier: Apache-2.0
// The shared assets (assets/README.md), where they are there: counts, extents, materials, and that the same tree from
// three formats is the same tree.
#include <gtest/gtest.h>

#include <functional>

#include "prefilter/condition.h"
#include "tests/support/imported_surface.h"

namespace farfield {
namespace {

namespace fs = std::filesystem;

const fs::path kAssets = FARFIELD_SHARED_ASSETS;

#define SKIP_WITHOUT(file) \
  if (!fs::exists(file)) GTEST_SKIP() << (file) << " is not here"

dvec3 area_weighted_mean(const Surface& s, const std::function<vec3(const FaceMaterial&)>& of) {
  dvec3 sum(0.0);
  double total = 0;
  for (size_t i = 0; i < s.triangles.size(); ++i) {
    const dvec3 a(s.positions[s.triangles[i].x]), b(s.positions[s.triangles[i].y]), c(s.positions[s.triangles[i].z]);
    const double area = glm::length(glm::cross(b - a, c - a));
    sum += area * dvec3(of(s.materials[i]));
    total += area;
  }
  return sum / total;
}

TEST(SharedAssets, MeshesHaveTheTrianglesAndSizeOfTheReadme) {
  const struct {
    const char* file;
    size_t triangles;
    vec3 size;
  } expected[] = {
      {"trees/small_maple.obj.gz", 226552, {11, 11.9f, 11.5f}},
      {"trees/small_maple.glb.gz", 226552, {11, 11.9f, 11.5f}},
      {"trees/small_maple.ply.gz", 226552, {11, 11.5f, 11.9f}},
      {"meshes/stanford-bunny.obj.gz", 69451, {0.156f, 0.154f, 0.121f}},
      {"meshes/suzanne_cc2.obj.gz", 15744, {2.66f, 1.91f, 1.6f}},
      {"meshes/spot/spot_quadrangulated.obj", 5856, {0.943f, 1.69f, 1.72f}},
      {"meshes/spot/spot_control_mesh.obj", 372, {1.17f, 1.74f, 1.77f}},
  };
  SKIP_WITHOUT(kAssets / expected[0].file);
  for (const auto& e : expected) {
    const auto asset = test::import_surface(kAssets / e.file);
    ASSERT_TRUE(asset) << asset.error().message;
    EXPECT_EQ(asset->surface.triangles.size(), e.triangles) << e.file;
    EXPECT_EQ(asset->surface.materials.size(), e.triangles) << e.file;
    const vec3 size = asset->surface.bounds().size();
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(size[c], e.size[c], 0.006f * e.size[c]) << e.file;
  }
}

TEST(SharedAssets, MapleIsTheSameTreeFromObjGltfAndPly) {
  SKIP_WITHOUT(kAssets / "trees/small_maple.obj.gz");
  const auto obj = test::import_surface(kAssets / "trees/small_maple.obj.gz");
  const auto glb = test::import_surface(kAssets / "trees/small_maple.glb.gz");
  const auto ply = test::import_surface(kAssets / "trees/small_maple.ply.gz");
  ASSERT_TRUE(obj && glb && ply);
  // Six decimals of the OBJ keep some vertices apart, or join them, that floats do not.
  EXPECT_NEAR(static_cast<double>(obj->surface.positions.size()), static_cast<double>(glb->surface.positions.size()),
              100);
  EXPECT_NEAR(static_cast<double>(ply->surface.positions.size()), static_cast<double>(glb->surface.positions.size()),
              100);
  const auto diffuse = [](const FaceMaterial& m) { return m.diffuse; };
  const auto rest = [](const FaceMaterial& m) { return vec3(m.specular.x, m.roughness2, m.transmission.x); };
  const dvec3 a = area_weighted_mean(obj->surface, diffuse), b = area_weighted_mean(glb->surface, diffuse);
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(a[c] / b[c], 1, 0.01) << c;
  const dvec3 ra = area_weighted_mean(obj->surface, rest), rb = area_weighted_mean(glb->surface, rest);
  EXPECT_NEAR(ra.x, 0.024, 1e-4);  // Blender's specular 0.3: F0 = 0.08 * 0.3
  EXPECT_NEAR(rb.x, 0.024, 1e-4);
  EXPECT_NEAR(ra.y / rb.y, 1, 0.01);
  // The PLY has the albedo as 8-bit vertex colours and no highlight to share with.
  const dvec3 p = area_weighted_mean(ply->surface, diffuse);
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(p[c] * 0.976, a[c], 0.03 * a[c] + 0.005) << c;
}

TEST(SharedAssets, LeafCardsAreCutToTheShareOfTheirMask) {
  const fs::path file = kAssets / "trees/small_maple_cards.glb";
  SKIP_WITHOUT(file);
  const auto asset = test::import_surface(file);
  ASSERT_TRUE(asset) << asset.error().message;
  EXPECT_LT(asset->surface.triangles.size(), 1'200'000u);
  EXPECT_GT(asset->surface.triangles.size(), 8628u * 4 + 43000);
  // Mesh 1 is the bark; mesh 0 the cards, whose masks leave 21.18 % of their area (counted in the PNGs).
  const auto cards = test::import_surface(file, {0});
  ASSERT_TRUE(cards) << cards.error().message;
  const auto area = [](const Surface& s) {
    double sum = 0;
    for (const uvec3& t : s.triangles) {
      const dvec3 a(s.positions[t.x]), b(s.positions[t.y]), c(s.positions[t.z]);
      sum += 0.5 * glm::length(glm::cross(b - a, c - a));
    }
    return sum;
  };
  constexpr double kCardArea = 391.635;  // of the 8628 quads as stored
  EXPECT_NEAR(area(cards->surface) / kCardArea, 0.2118, 0.01 * 0.2118);
  const dvec3 green = area_weighted_mean(cards->surface, [](const FaceMaterial& m) { return m.diffuse; });
  EXPECT_GT(green.y, 1.2 * green.x);
  EXPECT_GT(green.y, 2 * green.z);
}

TEST(SharedAssets, ForestMeshesImportOneByOne) {
  const fs::path file = kAssets / "forest/forest_pullback.glb";
  SKIP_WITHOUT(file);
  const size_t triangles[] = {46218, 25188, 30902, 18432};
  for (int mesh = 0; mesh < 4; ++mesh) {
    const auto asset = test::import_surface(file, {mesh});
    ASSERT_TRUE(asset) << asset.error().message;
    EXPECT_EQ(asset->surface.triangles.size(), triangles[mesh]) << mesh;
  }
}

TEST(SharedAssets, GltfImportFilesLoadOrAreRefusedByName) {
  const fs::path root = kAssets / "gltf-import";
  SKIP_WITHOUT(root);
  const struct {
    const char* file;
    size_t triangles;  ///< 0: has to be refused
    const char* reason;
  } expected[] = {
      {"glTF-Transform/Box.glb", 12, ""},
      {"glTF-Transform/Box.gltf", 12, ""},
      {"glTF-Transform/BoxVertexColors.glb", 12, ""},
      {"glTF-Transform/TwoCubes.glb", 24, ""},
      {"glTF-Transform/ShapeCollection.glb", 3542, ""},
      {"glTF-Transform/BoxDraco.gltf", 0, "draco"},
      {"glTF-Transform/DracoSparseMesh.gltf", 0, "draco"},
      {"glTF-Transform/DenseSphere.glb", 0, "draco"},
      {"glTF-Transform/BoxMeshopt.glb", 0, "meshopt"},
      {"tinygltf/BoundsChecking/integer-out-of-bounds.gltf", 0, ""},
      {"tinygltf/BoundsChecking/invalid-buffer-index.gltf", 0, ""},
      {"tinygltf/BoundsChecking/invalid-buffer-view-index.gltf", 0, ""},
      {"tinygltf/BoundsChecking/invalid-primitive-indices.gltf", 0, ""},
      {"tinygltf/CubeImageUriSpaces/CubeImageUriSpaces.gltf", 12, ""},
      {"tinygltf/SparseMorphTargets-issue280/singleBlendshapeCube_sparse.glb", 12, ""},
      {"tinygltf/regression/unassigned-skeleton.gltf", 8, ""},
      {"tinygltf/regression/zero-sized-bin-chunk-issue-440.glb", 1, ""},
  };
  for (const auto& e : expected) {
    const auto asset = test::import_surface(root / e.file);
    if (e.triangles > 0) {
      ASSERT_TRUE(asset) << asset.error().message;
      EXPECT_EQ(asset->surface.triangles.size(), e.triangles) << e.file;
    } else {
      ASSERT_FALSE(asset) << e.file;
      EXPECT_NE(asset.error().message.find(fs::path(e.file).filename().string()), std::string::npos);
      EXPECT_NE(asset.error().message.find(e.reason), std::string::npos) << asset.error().message;
    }
  }
}

TEST(SharedAssets, TextureWithBlanksInItsNameIsFound) {
  const fs::path file = kAssets / "gltf-import/tinygltf/CubeImageUriSpaces/CubeImageUriSpaces.gltf";
  SKIP_WITHOUT(file);
  const auto asset = test::import_surface(file);
  ASSERT_TRUE(asset) << asset.error().message;
  EXPECT_TRUE(asset->warnings.empty());
}

TEST(SharedAssets, VolumesAreRefusedAsVolumes) {
  SKIP_WITHOUT(kAssets / "volumes");
  for (const char* name : {"cloud.vdb", "cloud.nvdb.gz", "cloud_fp8.nvdb", "cloud_half.vol.gz"}) {
    const auto asset = test::import_surface(kAssets / "volumes" / name);
    ASSERT_FALSE(asset);
    EXPECT_EQ(asset.error().code, ErrorCode::Unsupported);
    EXPECT_NE(asset.error().message.find("volume"), std::string::npos);
  }
}

}  // namespace
}  // namespace farfield
