// SPDX-License-Identifier: Apache-2.0
#include "path_tracer/scene_names.h"

#include <gtest/gtest.h>

#include "cache/manifest.h"
#include "path_tracer/cryptomatte.h"
#include "tests/support/files.h"
#include "tests/support/level_builder.h"
#include "tests/support/runtime_host.h"

namespace farfield {
namespace {

using Names = std::set<std::string>;

GltfInstance instance_of(size_t mesh, const std::string& name, size_t node) {
  GltfInstance instance;
  instance.mesh = static_cast<decltype(instance.mesh)>(mesh);
  instance.name = name;
  instance.node = static_cast<decltype(instance.node)>(node);
  return instance;
}

const MaterialNames kNames = {{"bark", "leaf"}, {}, {"material 0", "leaf"}};

TEST(SceneNames, AreNumbersWhereTheFileHasNone) {
  EXPECT_EQ(object_name(instance_of(0, "oak", 3)), "oak");
  EXPECT_EQ(object_name(instance_of(0, "", 3)), "node 3");
}

TEST(SceneNames, AreThoseOfWhatIsThere) {
  const std::vector<GltfInstance> shown = {instance_of(0, "oak", 0), instance_of(1, "", 1), instance_of(0, "oak", 2)};
  EXPECT_EQ(names_of_objects(shown), (Names{"oak", "node 1"}));
  EXPECT_EQ(names_of_materials(shown, kNames), (Names{"(prefiltered)", "bark", "leaf"}));
}

TEST(SceneNames, OfMaterialsAreReadFromTheAssets) {
  const test::TemporaryFolder folder;
  test::write_asset(folder.path() / "plain", test::white_sphere(8));
  const std::vector<std::filesystem::path> folders = {"", folder.path() / "plain"};
  const auto names = read_material_names(folders);
  ASSERT_TRUE(names) << names.error().message;
  EXPECT_EQ(*names, (MaterialNames{{}, {"material 0"}}));

  auto manifest = *read_manifest(folder.path() / "plain");
  manifest.materials.resize(3);
  manifest.materials[1].name = "leaf";
  ASSERT_TRUE(write_manifest(folder.path() / "plain", manifest));
  EXPECT_EQ(*read_material_names(folders), (MaterialNames{{}, {"material 0", "leaf", "material 2"}}));

  EXPECT_FALSE(read_material_names(std::vector<std::filesystem::path>{folder.path() / "nowhere"}));
}

TEST(SceneIds, AreThoseOfTheNames) {
  SceneIds ids(kNames);
  ids.add_instance(instance_of(2, "bush", 0));
  ids.add_instance(instance_of(0, "", 7));
  Interaction seen;
  seen.instance = 1, seen.material = 0;
  EXPECT_EQ(ids.object(seen), cryptomatte_id("node 7"));
  EXPECT_EQ(ids.material(seen), cryptomatte_id("bark"));
  seen.instance = 0, seen.material = 1;
  EXPECT_EQ(ids.object(seen), cryptomatte_id("bush"));
  EXPECT_EQ(ids.material(seen), cryptomatte_id("leaf"));
  seen.material = kNoMaterial;
  EXPECT_EQ(ids.material(seen), cryptomatte_id("(prefiltered)"));
}

TEST(SceneIds, OfWhatIsNotKnownAreNothing) {
  Interaction seen;
  seen.instance = 0, seen.material = 0;
  EXPECT_EQ(SceneIds().object(seen), 0u);
  EXPECT_EQ(SceneIds(kNames).material(seen), 0u);
}

}  // namespace
}  // namespace farfield
