// SPDX-License-Identifier: Apache-2.0
// The glTF files of tests/data/import_cases that say something of materials or time, each with its right value.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "import/gltf_scene.h"
#include "import/read_source.h"

namespace farfield {
namespace {

SourceMesh read_case(const char* name) {
  auto mesh = read_source(std::filesystem::path(FARFIELD_TEST_DATA) / "import_cases" / name);
  EXPECT_TRUE(mesh) << mesh.error().message;
  if (!mesh) return {};
  EXPECT_TRUE(mesh->warnings.empty()) << fmt::format("{}", fmt::join(mesh->warnings, "\n"));
  return std::move(*mesh);
}

TEST(GltfCases, APaneIsSeenThrough) {
  const SourceMesh mesh = read_case("g06_blend_pane.glb");
  ASSERT_EQ(mesh.materials.size(), 2u);
  EXPECT_EQ(mesh.materials[0].alpha_mode, AlphaMode::Opaque);
  EXPECT_EQ(mesh.materials[1].name, "pane");
  EXPECT_EQ(mesh.materials[1].alpha_mode, AlphaMode::Blend);
  EXPECT_EQ(mesh.materials[1].alpha, 0.25f);
}

TEST(GltfCases, ASoftLeafKeepsTheAlphaOfItsTexture) {
  const SourceMesh mesh = read_case("g07_blend_soft_leaf.glb");
  ASSERT_EQ(mesh.materials.size(), 1u);
  EXPECT_EQ(mesh.materials[0].alpha_mode, AlphaMode::Blend);
  ASSERT_TRUE(mesh.materials[0].base_color_map);
  EXPECT_NEAR(mesh.materials[0].base_color_map.image->mean().w, 0.4f, 0.002f);
}

TEST(GltfCases, NormalMapsAreRead) {
  const SourceMesh mesh = read_case("g08_normal_map.glb");
  ASSERT_EQ(mesh.materials.size(), 1u);
  ASSERT_TRUE(mesh.materials[0].normal_map);
  EXPECT_NEAR(mesh.materials[0].roughness, 0.1f, 1e-6f);
  EXPECT_EQ(mesh.corner_uv.size(), mesh.corner_count());
  const Texture& map = *mesh.materials[0].normal_map.image;
  const vec4 first = map.texel(map.level(0), 0, 0);
  EXPECT_GT(glm::length(vec3(first) - vec3(0.5f, 0.5f, 1)), 0.1f) << "it is a strong one";
}

TEST(GltfCases, KeysAt30FramesPerSecondSaySo) {
  const auto scene = read_gltf_scene(std::filesystem::path(FARFIELD_TEST_DATA) / "import_cases" / "g26_30fps.glb");
  ASSERT_TRUE(scene) << scene.error().message;
  EXPECT_DOUBLE_EQ(scene->frames_per_second, 30);
  EXPECT_DOUBLE_EQ(scene->seconds_of_frame(15), 0.5);
}

}  // namespace
}  // namespace farfield
