// SPDX-License-Identifier: Apache-2.0
#include "import/gltf_volumes.h"

#include <gtest/gtest.h>

#include "import/read_scene.h"
#include "tests/support/files.h"
#include "tests/support/gltf_files.h"
#include "tests/support/vdb_files.h"

namespace farfield {
namespace {

namespace fs = std::filesystem;

/// A folder with clouds/cloud.vdb, 2 x 1 x 1 voxels of 0.5 from (0, 0, 0) on, and scenes whose nodes are given.
class GltfVolumes : public testing::Test {
 protected:
  void SetUp() override {
    test::VdbGrid grid;
    grid.index_to_source = glm::dmat4(glm::dmat3(0.5));
    grid.index_to_source[3] = glm::dvec4(0.25, 0.25, 0.25, 1);
    grid.voxels = {{{0, 0, 0}, 1}, {{1, 0, 0}, 1}};
    fs::create_directory(folder_.path() / "clouds");
    test::write_vdb(folder_.path() / "clouds/cloud.vdb", {grid});
  }
  GltfScene read(const std::string& nodes) const {
    const fs::path path = folder_.write(
        "scene.glb",
        test::glb(
            R"({"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0, 1]}], "nodes": [)" + nodes + "]}",
            ""));
    const auto scene = read_scene(path);
    EXPECT_TRUE(scene) << scene.error().message;
    return scene.value_or(GltfScene());
  }

  const test::TemporaryFolder folder_;
};

TEST_F(GltfVolumes, NodesShowThemWhereTheyAre) {
  const GltfScene scene = read(R"({"name": "near", "extras": {"farfield_volume": "clouds/cloud.vdb"}},
    {"name": "far", "translation": [10, 0, 0], "scale": [2, 2, 2],
     "extras": {"farfield_volume": {"file": "clouds/cloud.vdb"}, "farfield_id": 7}})");
  EXPECT_TRUE(scene.warnings.empty());
  ASSERT_EQ(scene.meshes.size(), 1u);  // both name the same
  const GltfMesh& volume = scene.meshes[0];
  EXPECT_EQ(volume.volume, "clouds/cloud.vdb");
  EXPECT_EQ(volume.asset_name, "cloud");
  EXPECT_FALSE(volume.is_empty());
  EXPECT_EQ(volume.bounds.lower, vec3(0.0f));
  EXPECT_EQ(volume.bounds.upper, vec3(1, 0.5f, 0.5f));
  ASSERT_EQ(scene.instances.size(), 2u);
  EXPECT_EQ(scene.instances[1].data.id, 7u);
  EXPECT_EQ(scene.bounds_world().upper, vec3(12, 1, 1));
}

TEST_F(GltfVolumes, PropertiesAreReadAndMakeAnotherAsset) {
  const GltfScene scene = read(R"({"extras": {"farfield_volume": {"file": "clouds/cloud.vdb", "density_scale": 3,
    "albedo": [0.9, 0.8, 0.7], "anisotropy": -0.5, "density_grid": "density", "level_set": false}}},
    {"extras": {"farfield_volume": "clouds/cloud.vdb"}})");
  ASSERT_EQ(scene.meshes.size(), 2u);
  const FogOptions& fog = scene.meshes[0].fog;
  EXPECT_EQ(fog.density_scale, 3);
  EXPECT_EQ(fog.anisotropy, -0.5);
  EXPECT_EQ(fog.density_grid, "density");
  EXPECT_EQ(fog.albedo, vec3(0.9f, 0.8f, 0.7f));
  EXPECT_NE(scene.meshes[0].asset_name, scene.meshes[1].asset_name);
}

TEST_F(GltfVolumes, WhatCannotBeReadIsLeftOutAndSaid) {
  for (const auto& [extras, words] :
       {std::pair(R"("none.vdb")", "no such file"), std::pair(R"("")", "names no file"),
        std::pair(R"("/etc/cloud.vdb")", "relative"),
        std::pair(R"({"file": "clouds/cloud.vdb", "colour": 1})", "\"colour\" is unknown"),
        std::pair(R"({"file": "clouds/cloud.vdb", "albedo": 1})", "\"albedo\""),
        std::pair(R"({"file": "clouds/cloud.vdb", "density_scale": -1})", "density-scale"),
        std::pair("7", "names no file")}) {
    const GltfScene scene = read(std::string(R"({"extras": {"farfield_volume": )") + extras + R"(}}, {})");
    EXPECT_TRUE(scene.instances.empty()) << extras;
    ASSERT_EQ(scene.warnings.size(), 1u) << extras;
    EXPECT_NE(scene.warnings[0].find(words), std::string::npos) << scene.warnings[0];
  }
}

TEST_F(GltfVolumes, AVolumeAloneIsAScene) {
  const auto scene = read_scene(folder_.path() / "clouds/cloud.vdb", {.assemblies = {}, .fog = {.density_scale = 4}});
  ASSERT_TRUE(scene) << scene.error().message;
  ASSERT_EQ(scene->instances.size(), 1u);
  EXPECT_EQ(scene->meshes[0].volume, "cloud.vdb");
  EXPECT_EQ(scene->meshes[0].fog.density_scale, 4);
  EXPECT_EQ(scene->bounds_world().upper, vec3(1, 0.5f, 0.5f));
  EXPECT_FALSE(scene->do_instances_move());
}

}  // namespace
}  // namespace farfield
