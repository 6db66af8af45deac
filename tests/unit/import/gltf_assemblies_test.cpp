// SPDX-License-Identifier: Apache-2.0
// What becomes one asset (docs/scene_format.md), on scenes of trees: a bark that is as tall as the tree, and leaves.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "import/gltf_scene.h"
#include "import/read_source.h"
#include "tests/support/files.h"
#include "tests/support/gltf_files.h"

namespace farfield {
namespace {

using test::glb;
using test::raw;

/// Meshes 0 bark (4 tall), 1 leaf (0.5 wide), 2 and 3 copies of them with bytes of their own and other names, 4 a leaf
/// of another colour. Accessors 0 to 4 are their positions, 5 three translations, 6 three ids, 7 three tints.
class Assemblies : public testing::Test {
 protected:
  Result<GltfScene> read(const std::string& roots, const std::string& nodes, const std::string& members = "",
                         AssemblyRule rule = AssemblyRule::Repeated) {
    const std::string bark = raw<float>({0, 0, 0, 0.2f, 0, 0, 0, 4, 0}),
                      leaf = raw<float>({0, 0, 0, 0.5f, 0, 0, 0, 0.5f, 0});
    const std::string places = raw<float>({0, 1, 0, 0, 2, 0, 0, 3, 0}), ids = raw<uint32_t>({7, 8, 70000});
    const std::string tints = raw<float>({1, 0, 0, 0, 1, 0, 0, 0, 1});
    const auto mesh = [](const char* name, int accessor, int material) {
      return fmt::format(R"({{"name":"{}","primitives":[{{"attributes":{{"POSITION":{}}},"material":{}}}]}})", name,
                         accessor, material);
    };
    const auto accessor = [](int view, const char* rest) {
      return fmt::format(R"({{"bufferView":{},"count":3,{}}})", view, rest);
    };
    const char *tall = R"("componentType":5126,"type":"VEC3","min":[0,0,0],"max":[0.2,4,0])",
               *small = R"("componentType":5126,"type":"VEC3","min":[0,0,0],"max":[0.5,0.5,0])",
               *vectors = R"("componentType":5126,"type":"VEC3")", *numbers = R"("componentType":5125,"type":"SCALAR")";
    const std::string binary = bark + leaf + bark + leaf + leaf + places + ids + tints;
    std::string views, accessors;
    size_t at = 0;
    int number = 0;
    for (const auto& [bytes, rest] : {std::pair(bark, tall),
                                      {leaf, small},
                                      {bark, tall},
                                      {leaf, small},
                                      {leaf, small},
                                      {places, vectors},
                                      {ids, numbers},
                                      {tints, vectors}}) {
      views += fmt::format(R"({}{{"buffer":0,"byteOffset":{},"byteLength":{}}})", number ? "," : "", at, bytes.size());
      accessors += number ? "," : "";
      accessors += accessor(number, rest);
      at += bytes.size();
      ++number;
    }
    const std::string json = fmt::format(
        R"({{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[{}]}}],"nodes":[{}],"meshes":[{},{},{},{},{}],
        "materials":[{{"name":"wood"}},{{"name":"green"}},{{"name":"red","emissiveFactor":[1,0,0]}}],
        "accessors":[{}],"bufferViews":[{}],"buffers":[{{"byteLength":{}}}]{}}})",
        roots, nodes, mesh("bark", 0, 0), mesh("leaf", 1, 1), mesh("bark.001", 2, 0), mesh("leaf.001", 3, 1),
        mesh("red leaf", 4, 2), accessors, views, binary.size(), members.empty() ? "" : "," + members);
    path_ = folder_.write("scene.glb", glb(json, binary));
    return read_gltf_scene(path_, rule);
  }

  /// Names of what instances show, in order.
  static std::string shown(const Result<GltfScene>& scene) {
    if (!scene) return scene.error().message;
    std::string names;
    for (const GltfInstance& instance : scene->instances)
      names.append(names.empty() ? "" : " ").append(scene->meshes[instance.mesh].asset_name);
    return names;
  }

  test::TemporaryFolder folder_;
  std::filesystem::path path_;
};

/// A tree at x from nodes n (root), n + 1 (bark), n + 2 (leaf).
std::string tree(int n, double x, int bark = 0, int leaf = 1, const std::string& rest = "", double leaf_y = 3) {
  return fmt::format(R"({{"name":"oak {0}","translation":[{1},0,0],"children":[{2},{3}]{4}}},{{"mesh":{5}}},
      {{"mesh":{6},"translation":[0,{7},0]}})",
                     n, x, n + 1, n + 2, rest, bark, leaf, leaf_y);
}

TEST_F(Assemblies, RepeatedTreesAreOneAssetWhateverTheyAreCalled) {
  const auto scene = read("0,3,6", tree(0, 0) + "," + tree(3, 10, 2, 3) + "," + tree(6, 20, 0, 4));
  ASSERT_TRUE(scene) << scene.error().message;
  // The third has a leaf of another material, and stands alone: a mesh each.
  EXPECT_EQ(shown(scene), "oak_0 oak_0 bark red_leaf");
  const GltfMesh& oak = scene->meshes[scene->instances[0].mesh];
  EXPECT_EQ(oak.node, 0);
  EXPECT_EQ(oak.triangle_count, 2u);
  EXPECT_EQ(oak.bounds.upper, vec3(0.5f, 4, 0));
  EXPECT_EQ(scene->instances[1].name, "oak 3");
  EXPECT_EQ(scene->instances[1].to_world[3], vec3(10, 0, 0));
}

TEST_F(Assemblies, AreImportedInTheSpaceOfTheirNode) {
  const auto scene = read("0,3", tree(0, 5) + "," + tree(3, 10));
  ASSERT_TRUE(scene) << scene.error().message;
  ImportOptions options;
  options.node = scene->meshes[scene->instances[0].mesh].node;
  const auto source = read_source(path_, options);
  ASSERT_TRUE(source) << source.error().message;
  ASSERT_EQ(source->face_count(), 2u);
  EXPECT_EQ(source->materials.size(), 2u);
  EXPECT_EQ(source->positions[2], dvec3(0, 4, 0));
  EXPECT_EQ(source->positions[3], dvec3(0, 3, 0));
  EXPECT_NE(source->source_hash, read_source(path_)->source_hash);
  options.node = 99;
  EXPECT_EQ(read_source(path_, options).error().code, ErrorCode::InvalidArgument);
}

TEST_F(Assemblies, OtherPlacesOfPartsAreAnotherTree) {
  EXPECT_EQ(shown(read("0,3", tree(0, 0) + "," + tree(3, 10, 0, 1, "", 2))), "bark leaf bark leaf");
}

TEST_F(Assemblies, OrderOfChildrenDoesNotMatterAndScaleIsOfTheInstance) {
  const std::string turned = R"({"translation":[9,0,0],"scale":[-2,2,2],"children":[4,5]},
      {"mesh":1,"translation":[0,3,0]},{"mesh":0})";
  const auto scene = read("0,3", tree(0, 0) + "," + turned);
  EXPECT_EQ(shown(scene), "oak_0 oak_0");
  EXPECT_EQ(scene->instances[1].to_world * vec4(1, 1, 0, 1), vec3(7, 2, 0));
}

TEST_F(Assemblies, APlaceOfManySmallThingsStaysApart) {
  // Two equal groves of two trees: trees are assets, groves are not.
  const auto grove = [](int n, int first) {
    return fmt::format(R"({{"name":"grove","translation":[0,0,{}],"children":[{},{}]}})", n, first, first + 3);
  };
  const std::string trees = tree(2, 0) + "," + tree(5, 40) + "," + tree(8, 0) + "," + tree(11, 40);
  EXPECT_EQ(shown(read("0,1", grove(0, 2) + "," + grove(50, 8) + "," + trees)), "oak_2 oak_2 oak_2 oak_2");
}

TEST_F(Assemblies, MarksSayWhatIsOneAsset) {
  const char* yes = R"(,"extras":{"farfield_asset":true})";
  EXPECT_EQ(shown(read("0", tree(0, 0))), "bark leaf") << "alone in the scene";
  EXPECT_EQ(shown(read("0", tree(0, 0, 0, 1, yes))), "oak_0");
  EXPECT_EQ(shown(read("0", tree(0, 0, 0, 1, R"(,"extras":{"farfield_asset":1})"))), "oak_0");
  EXPECT_EQ(shown(read("0", tree(0, 0, 0, 1, yes), "", AssemblyRule::Marked)), "oak_0");
  EXPECT_EQ(shown(read("0", tree(0, 0, 0, 1, yes), "", AssemblyRule::None)), "bark leaf");
  const char* no = R"(,"extras":{"farfield_asset":false})";
  EXPECT_EQ(shown(read("0,3", tree(0, 0, 0, 1, no) + "," + tree(3, 9, 0, 1, no))), "bark leaf bark leaf");
  EXPECT_EQ(shown(read("0,3", tree(0, 0) + "," + tree(3, 9), "", AssemblyRule::Marked)), "bark leaf bark leaf");
}

TEST_F(Assemblies, WhatMovesInItselfStaysApart) {
  const std::string moving = R"("animations":[{"samplers":[{"input":6,"output":5}],
      "channels":[{"sampler":0,"target":{"node":NODE,"path":"translation"}}]}])";
  const auto animate = [&](const char* node) { return std::string(moving).replace(moving.find("NODE"), 4, node); };
  // Accessor 6 holds unsigned numbers that increase: fit for key times.
  EXPECT_EQ(shown(read("0,3", tree(0, 0) + "," + tree(3, 9), animate("2"))), "bark leaf bark leaf");
  EXPECT_EQ(shown(read("0,3", tree(0, 0) + "," + tree(3, 9), animate("0"))), "oak_0 oak_0") << "it moves as a whole";
  const auto marked = read("0", tree(0, 0, 0, 1, R"(,"extras":{"farfield_asset":true})"), animate("2"));
  EXPECT_EQ(shown(marked), "bark leaf");
  ASSERT_EQ(marked->warnings.size(), 1u);
  EXPECT_NE(marked->warnings[0].find("oak 0"), std::string::npos);
}

TEST_F(Assemblies, HoldInstancedLeaves) {
  const auto leafy = [](int n, double x) {
    return fmt::format(R"({{"name":"oak {}","translation":[{},0,0],"children":[{},{}]}},{{"mesh":0}},
        {{"mesh":1,"extensions":{{"EXT_mesh_gpu_instancing":{{"attributes":{{"TRANSLATION":5}}}}}}}})",
                       n, x, n + 1, n + 2);
  };
  const auto scene = read("0,3", leafy(0, 0) + "," + leafy(3, 10));
  ASSERT_EQ(shown(scene), "oak_0 oak_0");
  ImportOptions options;
  options.node = 0;
  const auto source = read_source(path_, options);
  ASSERT_TRUE(source) << source.error().message;
  EXPECT_EQ(source->face_count(), 4u);
  EXPECT_EQ(scene->meshes[scene->instances[0].mesh].triangle_count, 4u);
}

TEST_F(Assemblies, HiddenPartsAreNotPartOfThem) {
  const std::string hidden = R"({"name":"oak 3","translation":[9,0,0],"children":[4,5,6]},{"mesh":0},
      {"mesh":1,"translation":[0,3,0]},{"mesh":4,"extensions":{"KHR_node_visibility":{"visible":false}}})";
  EXPECT_EQ(shown(read("0,3", tree(0, 0) + "," + hidden)), "oak_0 oak_0");
}

TEST_F(Assemblies, EqualMeshesAreOneAsset) {
  EXPECT_EQ(shown(read("0,1,2", R"({"mesh":1},{"mesh":3},{"mesh":4})")), "leaf leaf red_leaf");
}

TEST_F(Assemblies, AChainOfNodesIsWalkedInLittleTime) {
  std::string nodes;
  constexpr int kLength = 3000;
  for (int n = 0; n < kLength; ++n)
    nodes += fmt::format(R"({}{{"mesh":0{}}})", n ? "," : "",
                         n + 1 < kLength ? fmt::format(R"(,"children":[{}])", n + 1) : "");
  const auto scene = read("0", nodes);
  ASSERT_TRUE(scene) << scene.error().message;
  EXPECT_EQ(scene->instances.size(), size_t{kLength});
}

TEST_F(Assemblies, DataOfInstancesComesFromAttributesAndExtras) {
  const auto scene = read("0,1", R"({"mesh":1,"extensions":{"EXT_mesh_gpu_instancing":{"attributes":
      {"TRANSLATION":5,"_ID":6,"_TINT":7}}}},{"mesh":0,"extras":{"farfield_id":12,"farfield_tint":[0.5,0.25,1]}})");
  ASSERT_TRUE(scene) << scene.error().message;
  ASSERT_EQ(scene->instances.size(), 4u);
  EXPECT_EQ(scene->instances[2].data, (InstanceData{70000, vec3(0, 0, 1)}));
  EXPECT_EQ(scene->instances[3].data, (InstanceData{12, vec3(0.5f, 0.25f, 1)}));
  EXPECT_EQ(scene->instances_at(1)[0].data, (InstanceData{7, vec3(1, 0, 0)}));

  for (const char* bad :
       {R"("TRANSLATION":5,"_ID":99)", R"("TRANSLATION":5,"_ID":5)", R"("_ID":6)", R"("TRANSLATION":5,"_TINT":6)"}) {
    const auto broken = read(
        "0", fmt::format(R"({{"mesh":1,"extensions":{{"EXT_mesh_gpu_instancing":{{"attributes":{{{}}}}}}}}})", bad));
    ASSERT_FALSE(broken) << bad;
    EXPECT_EQ(broken.error().code, ErrorCode::BadFile);
  }
}

TEST(AssemblyRules, AreReadByName) {
  for (const auto rule : {AssemblyRule::None, AssemblyRule::Marked, AssemblyRule::Repeated})
    EXPECT_EQ(parse_assembly_rule(name_of(rule)).value(), rule);
  EXPECT_EQ(parse_assembly_rule("all").error().code, ErrorCode::InvalidArgument);
}

}  // namespace
}  // namespace farfield
