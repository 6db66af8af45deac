// SPDX-License-Identifier: Apache-2.0
#include "import/gltf_mesh_extras.h"

#include <gtest/gtest.h>

#include "import/read_scene.h"
#include "import/read_source.h"
#include "tests/support/files.h"
#include "tests/support/gltf_files.h"

namespace farfield {
namespace {

using test::raw;

/// Two meshes of the same triangle, with these extras.
std::string two_triangles(const std::string& first, const std::string& second, const std::string& nodes = "") {
  const std::string points = raw<float>({0, 0, 0, 1, 0, 0, 0, 1, 0});
  const std::string mesh = R"({"primitives": [{"attributes": {"POSITION": 0}}], "extras": )";
  return test::glb(R"({"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0, 1]}],
      "nodes": [)" + (nodes.empty() ? R"({"mesh": 0}, {"mesh": 1, "translation": [3, 0, 0]})" : nodes) +
                       R"(],
      "meshes": [)" + mesh +
                       first + "}, " + mesh + second + R"(}],
      "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0],
                     "max": [1, 1, 0]}],
      "bufferViews": [{"buffer": 0, "byteLength": 36}], "buffers": [{"byteLength": 36}]})",
                   points);
}

TEST(GltfMeshExtras, MeshesSayTheirSchemes) {
  const test::TemporaryFolder folder;
  const auto path = folder.write("a.glb", two_triangles(R"({"farfield_subdivision": "loop"})", "{}"));
  const SourceMesh both = read_source(path).value();
  ASSERT_EQ(both.face_scheme.size(), 2u);
  EXPECT_EQ(both.face_scheme[0], SubdivisionScheme::Loop);
  EXPECT_FALSE(both.face_scheme[1].has_value());
  const auto plain = folder.write("b.glb", two_triangles("{}", R"({"author": "me"})"));
  EXPECT_TRUE(read_source(plain).value().face_scheme.empty());
}

TEST(GltfMeshExtras, EqualTrianglesOfDifferentSchemesAreDifferentAssets) {
  const test::TemporaryFolder folder;
  const auto path = folder.write("a.glb", two_triangles(R"({"farfield_subdivision": "loop"})", "{}"));
  const GltfScene scene = read_scene(path).value();
  ASSERT_EQ(scene.instances.size(), 2u);
  EXPECT_NE(scene.instances[0].mesh, scene.instances[1].mesh);
  ImportOptions first, second;
  first.mesh = 0;
  second.mesh = 1;
  EXPECT_NE(read_source(path, first).value().source_hash, read_source(path, second).value().source_hash);
  const GltfScene same = read_scene(folder.write("b.glb", two_triangles("{}", "{}"))).value();
  EXPECT_EQ(same.instances[0].mesh, same.instances[1].mesh);
}

TEST(GltfMeshExtras, UnknownSchemesAreRefusedByMeshAndName) {
  const test::TemporaryFolder folder;
  for (const char* value : {"\"catmark\"", "7", "true"}) {
    const std::string extras = std::string(R"({"farfield_subdivision": )") + value + "}";
    const auto refused = read_source(folder.write("a.glb", two_triangles("{}", extras)));
    ASSERT_FALSE(refused) << value;
    EXPECT_EQ(refused.error().code, ErrorCode::BadFile);
    EXPECT_NE(refused.error().message.find("mesh 1: extras farfield_subdivision"), std::string::npos);
    EXPECT_NE(refused.error().message.find("catmull-clark, loop"), std::string::npos) << refused.error().message;
  }
}

TEST(GltfMeshExtras, NodesShowMeshesOfOtherFiles) {
  const test::TemporaryFolder folder;
  folder.write("quad.obj", "v 0 0 0\nv 2 0 0\nv 2 1 0\nv 0 1 0\nf 1 2 3 4\n");
  const auto path =
      folder.write("a.glb", two_triangles("{}", "{}", R"({"name": "near", "extras": {"farfield_mesh": "quad.obj"}},
        {"translation": [5, 0, 0], "extras": {"farfield_mesh": {"file": "quad.obj", "subdivision": "catmull-clark"},
                                              "farfield_id": 9}})"));
  const GltfScene scene = read_scene(path).value();
  EXPECT_TRUE(scene.warnings.empty());
  ASSERT_EQ(scene.instances.size(), 2u);
  const GltfMesh &near = scene.meshes[scene.instances[0].mesh], &far = scene.meshes[scene.instances[1].mesh];
  EXPECT_EQ(near.model, "quad.obj");
  EXPECT_FALSE(near.scheme.has_value());
  EXPECT_EQ(near.triangle_count, 2u);
  EXPECT_EQ(near.bounds.upper, vec3(2, 1, 0));
  EXPECT_EQ(far.scheme, SubdivisionScheme::CatmullClark);
  EXPECT_NE(near.asset_name, far.asset_name);
  EXPECT_EQ(scene.instances[1].data.id, 9u);
}

TEST(GltfMeshExtras, WhatCannotBeReadIsLeftOutAndSaid) {
  const test::TemporaryFolder folder;
  for (const char* extras : {R"("gone.obj")", R"("/a.obj")", R"("a.fbx")", "3", R"({"subdivision": "loop"})",
                             R"({"file": "a.obj", "subdivision": "x"})", R"({"file": "a.obj", "scheme": "loop"})"}) {
    const auto path = folder.write(
        "a.glb",
        two_triangles("{}", "{}",
                      std::string(R"({"name": "odd", "extras": {"farfield_mesh": )") + extras + "}}, {\"mesh\": 0}"));
    const GltfScene scene = read_scene(path).value();
    EXPECT_EQ(scene.instances.size(), 1u);
    ASSERT_EQ(scene.warnings.size(), 1u) << extras;
    EXPECT_NE(scene.warnings[0].find("node 0 (odd): its mesh is left out"), std::string::npos) << scene.warnings[0];
  }
}

}  // namespace
}  // namespace farfield
