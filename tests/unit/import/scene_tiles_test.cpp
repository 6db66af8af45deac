// SPDX-License-Identifier: Apache-2.0
#include "import/scene_tiles.h"

#include <gtest/gtest.h>

#include <set>

namespace farfield {
namespace {

constexpr uint64_t kTile = 1000;

/// A ground of so many triangles, 100 x 2 x 80, that trees of size 2 stand on.
GltfScene ground_and_trees(uint64_t triangles = 16 * kTile) {
  GltfScene scene;
  GltfMesh ground, tree;
  ground.name = ground.asset_name = "ground";
  ground.bounds = {vec3(-50, 0, -40), vec3(50, 2, 40)};
  ground.triangle_count = triangles;
  tree.name = tree.asset_name = "tree";
  tree.bounds = {vec3(-1), vec3(1)};
  tree.triangle_count = 1000000;
  scene.meshes = {tree, ground};
  scene.nodes.resize(2);
  for (const uint32_t mesh : {0u, 1u, 0u}) {
    GltfInstance instance;
    instance.mesh = mesh;
    instance.name = mesh == 1 ? "Ground" : "Tree";
    instance.node = mesh;
    instance.data.id = 7 + mesh;
    scene.instances.push_back(instance);
  }
  return scene;
}

TEST(SceneTiles, AGroundBecomesTilesInItsPlace) {
  GltfScene scene = ground_and_trees();
  scene.in_node = {mat4x3(1), mat4x3(2), mat4x3(3)};
  cut_into_tiles(scene, kTile);
  ASSERT_EQ(scene.meshes.size(), 2u + 16);
  ASSERT_EQ(scene.instances.size(), 2u + 16);
  ASSERT_EQ(scene.in_node.size(), scene.instances.size());
  EXPECT_EQ(scene.instances.front().mesh, 0u);
  EXPECT_EQ(scene.instances.back().mesh, 0u);
  std::set<std::string> names;
  for (uint32_t i = 0; i < 16; ++i) {
    const GltfInstance& instance = scene.instances[1 + i];
    const GltfMesh& tile = scene.meshes[instance.mesh];
    EXPECT_EQ(tile.tile.number, i);
    EXPECT_EQ(tile.tile.count, 16u);
    EXPECT_EQ(tile.whole, 1u);
    EXPECT_EQ(instance.name, "Ground");
    EXPECT_EQ(instance.node, 1u);
    EXPECT_EQ(instance.data.id, 8u);
    EXPECT_EQ(scene.in_node[1 + i], mat4x3(2));
    names.insert(tile.asset_name);
  }
  EXPECT_EQ(names.size(), 16u);
  ASSERT_EQ(scene.warnings.size(), 1u);
  EXPECT_NE(scene.warnings[0].find("16 tiles"), std::string::npos) << scene.warnings[0];
  EXPECT_NE(scene.warnings[0].find("--tile-triangles 0"), std::string::npos);
}

TEST(SceneTiles, NamesAreThoseOfNoOtherAsset) {
  GltfScene scene = ground_and_trees();
  scene.meshes[0].asset_name = "GROUND_tile_3";
  cut_into_tiles(scene, kTile);
  EXPECT_EQ(scene.meshes[2 + 3].asset_name, "ground_tile_3_");
  EXPECT_EQ(scene.meshes[2 + 4].asset_name, "ground_tile_4");
}

TEST(SceneTiles, WhatIsNoGroundStaysWhole) {
  const auto is_cut = [](GltfScene scene) {
    cut_into_tiles(scene, kTile);
    return scene.meshes.size() > 2;
  };
  EXPECT_TRUE(is_cut(ground_and_trees()));
  EXPECT_FALSE(is_cut(ground_and_trees(2 * kTile))) << "not heavy";
  EXPECT_TRUE(is_cut(ground_and_trees(2 * kTile + 1)));
  GltfScene scene = ground_and_trees();
  scene.meshes[1].bounds.upper.y = 30;
  EXPECT_FALSE(is_cut(scene)) << "not flat";
  scene = ground_and_trees();
  for (int i = 0; i < 4; ++i) scene.instances.push_back(scene.instances[1]);
  for (int i = 0; i < 20; ++i) scene.instances.push_back(scene.instances[0]);
  EXPECT_FALSE(is_cut(scene)) << "shown often";
  scene = ground_and_trees();
  for (GltfInstance& instance : scene.instances)
    if (instance.mesh == 0) instance.to_world = mat4x3(10);
  EXPECT_FALSE(is_cut(scene)) << "no wider than what stands on it";
  scene = ground_and_trees();
  scene.instances = {scene.instances[1]};
  EXPECT_FALSE(is_cut(scene)) << "alone";
  scene = ground_and_trees();
  scene.meshes[1].volume = "fog.vdb";
  EXPECT_FALSE(is_cut(scene)) << "a volume";
  scene = ground_and_trees();
  scene.meshes[1].bounds = Box3();
  EXPECT_FALSE(is_cut(scene)) << "without bounds";
  EXPECT_FALSE(is_cut(GltfScene()));
}

TEST(SceneTiles, AGroundOfWhateverSizeHasABoundedNumberOfTiles) {
  GltfScene scene = ground_and_trees(uint64_t{1} << 62);
  cut_into_tiles(scene, kTile);
  EXPECT_EQ(scene.meshes.size(), 2u + 4096);
}

}  // namespace
}  // namespace farfield
