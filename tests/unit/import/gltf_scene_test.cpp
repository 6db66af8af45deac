// SPDX-License-Identifier: Apache-2.0
#include "import/gltf_scene.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <glm/gtc/matrix_transform.hpp>
#include <glm/gtc/quaternion.hpp>

#include "import/read_source.h"
#include "tests/support/files.h"
#include "tests/support/gltf_files.h"
#include "tests/support/import_cases.h"

namespace farfield {
namespace {

using namespace test;

namespace fs = std::filesystem;

const fs::path kAssets = FARFIELD_SHARED_ASSETS;
constexpr double kForestYfov = 0.5631968779732008;

float distance(const vec3& a, const vec3& b) { return glm::length(a - b); }

/// A scene of one triangle mesh and the given nodes, animations and further top-level members. The binary chunk starts
/// with the triangle's positions (36 bytes, accessor 0); `extra` follows as buffer view 1.
std::string scene_file(const std::string& nodes, const std::string& roots, const std::string& members = "",
                       const std::string& extra = "", const std::string& accessors = "") {
  const std::string triangle = raw<float>({0, 0, 0, 1, 0, 0, 0, 1, 0});
  const std::string json = fmt::format(
      R"({{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[{}]}}],"nodes":[{}],
      "meshes":[{{"name":"tri","primitives":[{{"attributes":{{"POSITION":0}}}}]}}],
      "accessors":[{{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]}}{}],
      "bufferViews":[{{"buffer":0,"byteLength":36}}{}],"buffers":[{{"byteLength":{}}}]{}}})",
      roots, nodes, accessors.empty() ? "" : "," + accessors,
      extra.empty() ? "" : fmt::format(R"(,{{"buffer":0,"byteOffset":36,"byteLength":{}}})", extra.size()),
      36 + extra.size(), members.empty() ? "" : "," + members);
  return glb(json, triangle + extra);
}

TEST(GltfScene, LightsOfMapCoordinatesMoveAlong) {
  const TemporaryFolder folder;
  const std::string light = R"("extensions":{"KHR_lights_punctual":{"lights":[{"type":"point"}]}})";
  const auto scene = read_gltf_scene(folder.write("far.glb", scene_file(
                                                                 R"({"mesh":0,"translation":[4500000,0,0]},
         {"translation":[4500000,2.125,0],"extensions":{"KHR_lights_punctual":{"light":0}}})",
                                                                 "0,1", light)));
  ASSERT_TRUE(scene) << scene.error().message;
  ASSERT_EQ(scene->lights.size(), 1u);
  EXPECT_LT(distance(scene->lights[0].position - scene->instances[0].to_world[3], vec3(0, 2.125f, 0)), 1e-6f);
}

TEST(GltfScene, InstancesInMapCoordinatesCountForTheOrigin) {
  const TemporaryFolder folder;
  const auto scene = read_gltf_scene(
      folder.write("far.glb", scene_file(R"({"mesh":0,"translation":[0.125,0,0],
                     "extensions":{"EXT_mesh_gpu_instancing":{"attributes":{"TRANSLATION":1}}}})",
                                         "0", "", raw<float>({4500000, 0, 0, 4500002, 0, 0}),
                                         R"({"bufferView":1,"componentType":5126,"count":2,"type":"VEC3"})")));
  ASSERT_TRUE(scene) << scene.error().message;
  ASSERT_EQ(scene->instances.size(), 2u);
  EXPECT_NEAR(scene->origin_world.x, 4500001, 2);
  for (size_t i = 0; i < 2; ++i) {
    EXPECT_DOUBLE_EQ(scene->origin_world.x + static_cast<double>(scene->instances[i].to_world[3].x),
                     4500000.125 + 2.0 * static_cast<double>(i));
  }
}

TEST(GltfScene, AMeshWhosePointsAreFarFromItsOriginIsWarnedAbout) {
  const TemporaryFolder folder;
  std::string file = scene_file(R"({"mesh":0})", "0", "", "",
                                R"({"componentType":5126,"count":3,"type":"VEC3","min":[9e6,0,0],"max":[9e6,1,0]})");
  const std::string near = R"("POSITION":0)", far = R"("POSITION":1)";
  const auto scene = read_gltf_scene(folder.write("far.glb", file.replace(file.find(near), near.size(), far)));
  ASSERT_TRUE(scene) << scene.error().message;
  ASSERT_EQ(scene->warnings.size(), 1u);
  EXPECT_NE(scene->warnings[0].find("mesh tri"), std::string::npos) << scene->warnings[0];
}

TEST(GltfScene, OneBrokenMeshIsLeftOutByName) {
  const TemporaryFolder folder;
  std::string file =
      scene_file(R"({"mesh":0},{"mesh":0})", "0,1", "", "", R"({"componentType":5126,"count":3,"type":"VEC2"})");
  const std::string whole = R"("POSITION":0}}]})", torn = R"("POSITION":1}}]})";
  const auto broken = read_gltf_scene(folder.write("torn.glb", file.replace(file.find(whole), whole.size(), torn)));
  ASSERT_TRUE(broken) << broken.error().message;
  EXPECT_EQ(broken->meshes.at(0).triangle_count, 0u);
  ASSERT_EQ(broken->warnings.size(), 1u);
  EXPECT_NE(broken->warnings[0].find("mesh 0 (tri)"), std::string::npos) << broken->warnings[0];
}

TEST(GltfScene, ForestHasItsInstancesSpeciesSunAndCamera) {
  const fs::path file = kAssets / "forest/forest_pullback.glb";
  if (!fs::exists(file)) GTEST_SKIP() << file << " is not here";
  const auto scene = read_gltf_scene(file);
  ASSERT_TRUE(scene) << scene.error().message;
  ASSERT_EQ(scene->meshes.size(), 4u);
  EXPECT_EQ(scene->meshes[0].asset_name, "small_maple_lo");
  EXPECT_EQ(scene->meshes[0].triangle_count, 46218u);
  EXPECT_EQ(scene->meshes[1].triangle_count, 25188u);
  EXPECT_EQ(scene->meshes[2].triangle_count, 30902u);
  EXPECT_EQ(scene->instances.size(), 501u);  // 500 trees and the ground
  uint64_t triangles = 0;
  for (const GltfInstance& instance : scene->instances) {
    if (instance.mesh != 3) triangles += scene->meshes[instance.mesh].triangle_count;
  }
  EXPECT_EQ(triangles, 18297838u);  // without the ground
  const vec3 size = scene->bounds_world().size();
  EXPECT_NEAR(size.x, 3000, 1);
  EXPECT_NEAR(size.z, 3000, 1);
  EXPECT_GT(size.y, 20);
  EXPECT_LT(size.y, 40);

  ASSERT_EQ(scene->lights.size(), 1u);
  EXPECT_EQ(scene->lights[0].type, GltfLight::Type::Directional);
  EXPECT_FLOAT_EQ(scene->lights[0].intensity, 3073.5f);
  EXPECT_LT(scene->lights[0].direction.y, -0.3f);  // shines down
  ASSERT_EQ(scene->cameras.size(), 1u);
  EXPECT_NEAR(scene->cameras[0].yfov_rad, kForestYfov, 1e-6);
  EXPECT_NEAR(scene->cameras[0].aspect, 16.0 / 9, 1e-6);
}

TEST(GltfScene, ForestCameraPullsBackBy64AlongItsFormula) {
  const fs::path file = kAssets / "forest/forest_pullback.glb";
  if (!fs::exists(file)) GTEST_SKIP() << file << " is not here";
  const auto scene = read_gltf_scene(file);
  ASSERT_TRUE(scene) << scene.error().message;
  EXPECT_DOUBLE_EQ(scene->start_seconds, 0);
  EXPECT_DOUBLE_EQ(scene->end_seconds, 5);
  EXPECT_DOUBLE_EQ(scene->frames_per_second, 24);
  for (const int frame : {0, 1, 40, 60, 80, 119, 120, 500}) {
    const double seconds = std::min(scene->seconds_of_frame(frame), 5.0);
    const GltfCamera camera = scene->camera_at(0, scene->seconds_of_frame(frame));
    const double distance = std::hypot(camera.position.x, camera.position.z);
    EXPECT_NEAR(distance / (7.8125 * std::pow(64.0, seconds / 5)), 1, 1e-3) << "frame " << frame;
    // it looks at the maple, 4.5 m above the ground
    const vec3 to_tree = glm::normalize(vec3(0, 4.5f, 0) - camera.position);
    EXPECT_GT(glm::dot(camera.forward, to_tree), 0.995f) << "frame " << frame;
    EXPECT_GT(camera.up.y, 0.5f);
  }
}

TEST(GltfScene, WorldTransformIsTheProductAlongTheChain) {
  const TemporaryFolder folder;
  const auto file = folder.write("chain.glb", scene_file(R"({"translation":[1,2,3],"children":[1]},
          {"rotation":[0,0.70710678,0,0.70710678],"scale":[2,3,4],"children":[2]},
          {"matrix":[1,0,0,0, 0,0,1,0, 0,-1,0,0, 5,6,7,1],"mesh":0})",
                                                         "0"));
  const auto scene = read_gltf_scene(file);
  ASSERT_TRUE(scene) << scene.error().message;
  ASSERT_EQ(scene->instances.size(), 1u);
  glm::mat4 expected = glm::translate(glm::mat4(1), vec3(1, 2, 3));
  expected *= glm::mat4_cast(glm::quat(0.70710678f, 0, 0.70710678f, 0));
  expected = glm::scale(expected, vec3(2, 3, 4));
  expected *= glm::mat4(1, 0, 0, 0, 0, 0, 1, 0, 0, -1, 0, 0, 5, 6, 7, 1);
  for (const vec4& p : {vec4(0, 0, 0, 1), vec4(1, 0, 0, 1), vec4(0, 1, 0, 1), vec4(0, 0, 1, 1)}) {
    EXPECT_LT(distance(scene->instances[0].to_world * p, vec3(expected * p)), 1e-4f);
  }
}

TEST(GltfScene, CameraBasisIsOrthonormalUnderScaleAndMirror) {
  const TemporaryFolder folder;
  const auto file = folder.write(
      "camera.glb",
      scene_file(R"({"scale":[-2,3,0.5],"rotation":[0.1,0.2,0.3,0.927],"children":[1]},
          {"translation":[0,0,10],"camera":0})",
                 "0", R"("cameras":[{"type":"orthographic","orthographic":{"xmag":4,"ymag":3,"znear":0,"zfar":9}}])"));
  const auto scene = read_gltf_scene(file);
  ASSERT_TRUE(scene) << scene.error().message;
  ASSERT_EQ(scene->cameras.size(), 1u);
  const GltfCamera& c = scene->cameras[0];
  EXPECT_TRUE(c.is_orthographic);
  EXPECT_FLOAT_EQ(c.half_width, 4);
  EXPECT_FLOAT_EQ(c.half_height, 3);
  EXPECT_NEAR(glm::dot(c.forward, c.right), 0, 1e-6);
  EXPECT_NEAR(glm::dot(c.forward, c.up), 0, 1e-6);
  EXPECT_LT(distance(glm::cross(c.right, c.up), -c.forward), 1e-6f);
}

/// One camera node, animated by two channels that share the key times 0, 1, 3.
std::string animated_file(const std::string& interpolation, const std::vector<float>& translations,
                          const std::vector<float>& rotations) {
  const std::string times = raw<float>({0, 1, 3}), moves = raw(translations), turns = raw(rotations);
  const std::string accessors = fmt::format(
      R"({{"bufferView":1,"componentType":5126,"count":3,"type":"SCALAR"}},
         {{"bufferView":1,"byteOffset":12,"componentType":5126,"count":{},"type":"VEC3"}},
         {{"bufferView":1,"byteOffset":{},"componentType":5126,"count":{},"type":"VEC4"}})",
      translations.size() / 3, 12 + moves.size(), rotations.size() / 4);
  const std::string members = fmt::format(
      R"("cameras":[{{"type":"perspective","perspective":{{"yfov":1,"znear":0.1}}}}],
         "animations":[{{"channels":[{{"sampler":0,"target":{{"node":0,"path":"translation"}}}},
         {{"sampler":1,"target":{{"node":1,"path":"rotation"}}}}],
         "samplers":[{{"input":1,"output":2,"interpolation":"{0}"}},{{"input":1,"output":3,"interpolation":"{0}"}}]}}])",
      interpolation);
  return scene_file(R"({"children":[1]},{"camera":0,"mesh":0})", "0", members, times + moves + turns, accessors);
}

TEST(GltfScene, LinearKeysInterpolateStraightAndRotationsTheShortWay) {
  const TemporaryFolder folder;
  // The last rotation has its sign flipped: the same turn, which must not make the camera go the long way round.
  const float h = std::sqrt(0.5f);
  const auto file = folder.write(
      "linear.glb", animated_file("LINEAR", {0, 0, 0, 4, 0, 0, 4, 8, 0}, {0, 0, 0, 1, 0, h, 0, h, 0, -h, 0, -h}));
  const auto scene = read_gltf_scene(file);
  ASSERT_TRUE(scene) << scene.error().message;
  EXPECT_DOUBLE_EQ(scene->end_seconds, 3);
  EXPECT_LT(distance(scene->camera_at(0, 0.5).position, vec3(2, 0, 0)), 1e-6f);
  EXPECT_LT(distance(scene->camera_at(0, 2.5).position, vec3(4, 6, 0)), 1e-6f);
  EXPECT_LT(distance(scene->camera_at(0, -7).position, vec3(0, 0, 0)), 1e-6f);
  EXPECT_LT(distance(scene->camera_at(0, 99).position, vec3(4, 8, 0)), 1e-6f);
  EXPECT_LT(distance(scene->camera_at(0, 0.5).forward, vec3(-h, 0, -h)), 1e-6f);  // 45 degrees about y
  EXPECT_LT(distance(scene->camera_at(0, 2).forward, vec3(-1, 0, 0)), 1e-6f);
  EXPECT_LT(distance(scene->camera_at(0, std::nan("")).position, vec3(0, 0, 0)), 1e-6f);
  EXPECT_TRUE(scene->do_instances_move());
  const auto moved = scene->instances_at(2.5);
  ASSERT_EQ(moved.size(), 1u);
  EXPECT_LT(distance(moved[0].to_world[3], vec3(4, 6, 0)), 1e-6f);
}

TEST(GltfScene, StepKeysHold) {
  const TemporaryFolder folder;
  const auto file = folder.write(
      "step.glb", animated_file("STEP", {0, 0, 0, 4, 0, 0, 4, 8, 0}, {0, 0, 0, 1, 0, 1, 0, 0, 0, 0, 0, 1}));
  const auto scene = read_gltf_scene(file);
  ASSERT_TRUE(scene) << scene.error().message;
  EXPECT_EQ(scene->camera_at(0, 0.999).position, vec3(0, 0, 0));
  EXPECT_EQ(scene->camera_at(0, 1.0).position, vec3(4, 0, 0));
  EXPECT_EQ(scene->camera_at(0, 2.999).position, vec3(4, 0, 0));
}

TEST(GltfScene, CubicSplineReproducesACubic) {
  // x(t) = t^3 - 2 t: a Hermite spline with its values and slopes is that cubic exactly.
  const auto x = [](double t) { return static_cast<float>(t * t * t - 2 * t); };
  const auto slope = [](double t) { return static_cast<float>(3 * t * t - 2); };
  std::vector<float> moves, turns;
  for (const double t : {0.0, 1.0, 3.0}) {
    for (const float value : {slope(t), x(t), slope(t)}) moves.insert(moves.end(), {value, 0, 0});
    turns.insert(turns.end(), {0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0});
  }
  const TemporaryFolder folder;
  const auto scene = read_gltf_scene(folder.write("cubic.glb", animated_file("CUBICSPLINE", moves, turns)));
  ASSERT_TRUE(scene) << scene.error().message;
  for (const double t : {0.0, 0.3, 1.0, 1.7, 2.9, 3.0}) EXPECT_NEAR(scene->camera_at(0, t).position.x, x(t), 2e-5) << t;
}

TEST(GltfScene, AnimationWithBrokenKeysIsRefused) {
  const TemporaryFolder folder;
  std::string broken = animated_file("LINEAR", {0, 0, 0, 4, 0, 0, 4, 8, 0}, {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1});
  const std::string times = raw<float>({0, 1, 3}), falling = raw<float>({0, 3, 1});
  broken.replace(broken.find(times), times.size(), falling);
  const auto scene = read_gltf_scene(folder.write("falling.glb", broken));
  ASSERT_FALSE(scene);
  EXPECT_NE(scene.error().message.find("do not increase"), std::string::npos) << scene.error().message;
  // as many values as keys: too few for a spline
  const auto spline = read_gltf_scene(folder.write(
      "spline.glb", animated_file("CUBICSPLINE", {0, 0, 0, 4, 0, 0, 4, 8, 0}, {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1})));
  EXPECT_FALSE(spline);
}

TEST(GltfScene, WhatIsNoGltfIsSaidInWords) {
  const TemporaryFolder folder;
  const auto words = [&](const char* content) {
    const auto scene = read_gltf_scene(folder.write("bad.gltf", content));
    EXPECT_FALSE(scene) << content;
    return scene ? "" : scene.error().message;
  };
  const std::string no_gltf = "bad.gltf: it is no glTF, neither a JSON object nor binary: give a .gltf or .glb";
  for (const char* content : {"", " ", "v 0 0 0\nf 1 2 3\n", "ply\n", "[1]", "\x89PNG"})
    EXPECT_TRUE(words(content).ends_with(no_gltf)) << words(content);
  EXPECT_NE(words("{\"asset\":\n x}").find("its JSON is wrong at line 2, column 2"), std::string::npos);
  for (const char* content : {"{", "{\"asset\": {\"version\": \"2.0\"}, }", "{}", "\xef\xbb\xbf{"})
    EXPECT_EQ(words(content).find("exception"), std::string::npos) << words(content);
}

TEST(GltfScene, NodeCyclesAndSharedChildrenAreRefused) {
  const TemporaryFolder folder;
  for (const char* nodes : {R"({"children":[1]},{"children":[0]})", R"({"children":[0]})",
                            R"({"children":[2]},{"children":[2]},{"mesh":0})", R"({"children":[7]})"}) {
    const auto scene = read_gltf_scene(folder.write("bad.glb", scene_file(nodes, "0")));
    ASSERT_FALSE(scene) << nodes;
    EXPECT_EQ(scene.error().code, ErrorCode::BadFile);
    EXPECT_NE(scene.error().message.find("bad.glb"), std::string::npos);
  }
}

TEST(GltfScene, ChainOf5000NodesIsWalkedWithoutRecursion) {
  std::string nodes;
  for (int i = 0; i < 4999; ++i) nodes += fmt::format(R"({{"translation":[0,0,0.5],"children":[{}]}},)", i + 1);
  const TemporaryFolder folder;
  const auto scene = read_gltf_scene(folder.write("deep.glb", scene_file(nodes + R"({"mesh":0})", "0")));
  ASSERT_TRUE(scene) << scene.error().message;
  ASSERT_EQ(scene->instances.size(), 1u);
  EXPECT_FLOAT_EQ(scene->instances[0].to_world[3].z + static_cast<float>(scene->origin_world.z), 2499.5f);
}

TEST(GltfScene, DeepJsonIsRefusedBeforeAnyRecursiveParser) {
  const TemporaryFolder folder;
  const std::string deep = std::string(200000, '[') + std::string(200000, ']');
  const auto scene = read_gltf_scene(folder.write("deep.gltf", R"({"asset":{"version":"2.0"},"extras":)" + deep + "}"));
  ASSERT_FALSE(scene);
  EXPECT_NE(scene.error().message.find("nested deeper"), std::string::npos) << scene.error().message;
}

TEST(GltfScene, SingularInstancesAreLeftOutWithAWarning) {
  const TemporaryFolder folder;
  const auto scene = read_gltf_scene(folder.write(
      "flat.glb", scene_file(R"({"mesh":0,"scale":[0,1,1]},{"mesh":0,"matrix":[0,0,0,0,0,0,0,0,0,0,0,0,0,0,0,0]},
          {"mesh":0,"scale":[-1,2,0.5],"rotation":[0,0,0,0]})",
                             "0,1,2")));
  ASSERT_TRUE(scene) << scene.error().message;
  EXPECT_EQ(scene->instances.size(), 1u);
  EXPECT_EQ(scene->warnings.size(), 2u);
}

TEST(GltfScene, LightsKeepTheirPhotometricValueAndDirection) {
  const TemporaryFolder folder;
  const auto scene = read_gltf_scene(folder.write(
      "lights.glb",
      scene_file(R"({"rotation":[-0.70710678,0,0,0.70710678],"extensions":{"KHR_lights_punctual":{"light":0}}},
          {"translation":[1,2,3],"extensions":{"KHR_lights_punctual":{"light":1}}},
          {"extensions":{"KHR_lights_punctual":{"light":9}}})",
                 "0,1,2",
                 R"("extensionsRequired":["KHR_lights_punctual"],"extensions":{"KHR_lights_punctual":{"lights":[
          {"type":"directional","color":[1,0.5,0.25],"intensity":1000},
          {"type":"spot","intensity":7,"spot":{"innerConeAngle":0.1,"outerConeAngle":0.2}}]}})")));
  ASSERT_TRUE(scene) << scene.error().message;
  ASSERT_EQ(scene->lights.size(), 2u);
  EXPECT_LT(distance(scene->lights[0].direction, vec3(0, -1, 0)), 1e-6f);
  EXPECT_EQ(scene->lights[0].color, vec3(1, 0.5f, 0.25f));
  EXPECT_EQ(scene->lights[0].intensity, 1000);
  EXPECT_EQ(scene->lights[1].type, GltfLight::Type::Spot);
  EXPECT_EQ(scene->lights[1].position, vec3(1, 2, 3));
  EXPECT_FLOAT_EQ(scene->lights[1].outer_cone_rad, 0.2f);
  EXPECT_EQ(scene->warnings.size(), 1u);  // light 9 does not exist
}

TEST(GltfScene, GpuInstancesAreInstancesWhetherUsedOrRequired) {
  for (const char* name : {"g01_gpu_instancing_used.glb", "g01_gpu_instancing_required.glb"}) {
    const auto scene = read_gltf_scene(kCases / name);
    ASSERT_TRUE(scene) << scene.error().message;
    ASSERT_EQ(scene->instances.size(), 100u);
    EXPECT_EQ(scene->instances_at(0).size(), 100u);
    EXPECT_FALSE(scene->do_instances_move());
    EXPECT_NE(scene->instances[0].to_world[3], scene->instances[99].to_world[3]);
    EXPECT_EQ(scene->instances_at(0)[99].to_world, scene->instances[99].to_world);

    const auto flattened = read_source(kCases / name);
    ASSERT_TRUE(flattened) << flattened.error().message;
    EXPECT_EQ(flattened->face_count(), 200u);
    Box3 bounds;
    for (const dvec3& p : flattened->positions) bounds.extend(vec3(p));
    Box3 corners;  // of the squares in the scene
    for (const GltfInstance& instance : scene->instances)
      for (const float x : {-0.5f, 0.5f})
        for (const float y : {-0.5f, 0.5f}) corners.extend(instance.to_world * vec4(x, y, 0, 1));
    EXPECT_LT(distance(bounds.lower, corners.lower), 1e-4f);
    EXPECT_LT(distance(bounds.upper, corners.upper), 1e-4f);
  }
}

TEST(GltfScene, GpuInstancesStandInTheSpaceOfTheirNode) {
  const TemporaryFolder folder;
  const auto scene = read_gltf_scene(folder.write(
      "i.glb", scene_file(R"({"mesh":0,"translation":[10,0,0],"scale":[2,2,2],"extensions":{"EXT_mesh_gpu_instancing":
          {"attributes":{"TRANSLATION":1}}}})",
                          "0", "", raw<float>({0, 0, 0, 1, 2, 3}),
                          R"({"bufferView":1,"componentType":5126,"count":2,"type":"VEC3"})")));
  ASSERT_TRUE(scene) << scene.error().message;
  ASSERT_EQ(scene->instances.size(), 2u);
  EXPECT_EQ(scene->instances[1].to_world * vec4(1, 0, 0, 1), vec3(14, 4, 6));
}

TEST(GltfScene, GpuInstancesWithAttributesOfDifferentLengthAreRefused) {
  const TemporaryFolder folder;
  for (const char* attributes : {R"("TRANSLATION":1,"SCALE":0)", R"("TRANSLATION":7)", R"("ROTATION":1)"}) {
    const auto scene = read_gltf_scene(
        folder.write("bad.glb", scene_file(fmt::format(R"({{"mesh":0,"extensions":{{"EXT_mesh_gpu_instancing":
            {{"attributes":{{{}}}}}}}}})",
                                                       attributes),
                                           "0", "", raw<float>({0, 0, 0, 1, 2, 3}),
                                           R"({"bufferView":1,"componentType":5126,"count":2,"type":"VEC3"})")));
    ASSERT_FALSE(scene) << attributes;
    EXPECT_EQ(scene.error().code, ErrorCode::BadFile);
  }
}

TEST(GltfScene, WhatGrowsFromNothingIsThereOnceItHasASize) {
  for (const char* name : {"g02_scale_from_zero.glb", "g02_scale_from_tiny.glb"}) {
    const auto scene = read_gltf_scene(kCases / name);
    ASSERT_TRUE(scene) << scene.error().message;
    EXPECT_EQ(scene->instances.size(), 2u) << name;
    EXPECT_TRUE(scene->warnings.empty());
    EXPECT_EQ(scene->instances_at(0).size(), name == std::string("g02_scale_from_zero.glb") ? 1u : 2u);
    for (const double seconds : {0.25, 1.0}) {
      const auto placed = scene->instances_at(seconds);
      ASSERT_EQ(placed.size(), 2u) << name;
      EXPECT_NEAR(placed[0].to_world[0].x, seconds, 1e-3) << name;
    }
  }
}

TEST(GltfScene, AssetNamesAreUniqueAndFitForFiles) {
  const TemporaryFolder folder;
  std::string file = scene_file(R"({"mesh":0})", "0");
  const std::string one = R"({"name":"tri","primitives":[{"attributes":{"POSITION":0}}]})";
  std::string meshes;
  for (const char* name : {"a/b", "a b", "", "../x", "A_B"}) {
    meshes += fmt::format(R"({}{{"name":"{}","primitives":[{{"attributes":{{"POSITION":0}}}}]}})",
                          meshes.empty() ? "" : ",", name);
  }
  const size_t at = file.find(one);
  std::string json = file.substr(20, file.find(std::string("BIN\0", 4)) - 24);
  json.replace(at - 20, one.size(), meshes);
  const auto scene = read_gltf_scene(folder.write("names.glb", glb(json, raw<float>({0, 0, 0, 1, 0, 0, 0, 1, 0}))));
  ASSERT_TRUE(scene) << scene.error().message;
  std::vector<std::string> names;
  for (const GltfMesh& mesh : scene->meshes) names.push_back(mesh.asset_name);
  EXPECT_EQ(names, (std::vector<std::string>{"a_b", "a_b_2", "mesh_2", "_._x", "A_B_3"}));
}

TEST(GltfScene, MapCoordinatesLoseNothing) {
  const auto near = read_gltf_scene(kCases / "g24_origin.glb"), far = read_gltf_scene(kCases / "g24_utm.glb");
  ASSERT_TRUE(near && far);
  EXPECT_EQ(near->origin_world, dvec3(0.0));
  ASSERT_EQ(far->instances.size(), 1u);
  const vec3 from_near = near->cameras[0].position - vec3(near->instances[0].to_world[3]);
  const vec3 from_far = far->cameras[0].position - vec3(far->instances[0].to_world[3]);
  EXPECT_LT(distance(from_near, from_far), 1e-6f);
  const vec3 later = far->camera_at(0, 1).position - vec3(far->instances_at(1)[0].to_world[3]);
  EXPECT_LT(distance(from_near, later), 1e-6f);
  EXPECT_LT(glm::length(far->origin_world + dvec3(far->instances[0].to_world[3]) - dvec3(500000.25, 0, 4500000.5)),
            1e-6);
}

TEST(GltfScene, SkinnedMeshesStandWhereTheirSkeletonIs) {
  const auto scene = read_gltf_scene(kCases / "g09_skin.glb");
  ASSERT_TRUE(scene) << scene.error().message;
  ASSERT_EQ(scene->instances.size(), 1u);
  EXPECT_LT(distance(scene->instances[0].to_world * vec4(0.5f, 0.5f, 0, 1), vec3(0.5f, 5.5f, 0)), 1e-5f);
  ASSERT_EQ(scene->warnings.size(), 1u);
  EXPECT_EQ(scene->warnings[0], "node 0 (figure): skinned; shown stiff, in its bind pose where its first joint is");
  const auto mesh = read_source(kCases / "g09_skin.glb");
  ASSERT_TRUE(mesh) << mesh.error().message;
  EXPECT_EQ(mesh->warnings, scene->warnings);
  for (const dvec3& p : mesh->positions) {
    EXPECT_NEAR(std::abs(p.x), 0.5, 1e-6);
    EXPECT_NEAR(std::abs(p.y - 5), 0.5, 1e-6);
  }
}

TEST(GltfScene, ASkinWithRandomBindMatricesStandsWhereItsNodeIs) {
  const TemporaryFolder folder;
  std::vector<float> matrix(16, 1e18f);
  const auto file =
      folder.write("a.glb", scene_file(R"({"name":"n","mesh":0,"skin":0,"translation":[1,0,0]},{})", "0,1",
                                       R"("skins":[{"joints":[1],"inverseBindMatrices":1}])", raw<float>(matrix),
                                       R"({"bufferView":1,"componentType":5126,"count":1,"type":"MAT4"})"));
  const auto scene = read_gltf_scene(file);
  const auto mesh = read_source(file);
  ASSERT_TRUE(scene && mesh);
  EXPECT_EQ(vec3(scene->instances[0].to_world[3]), vec3(1, 0, 0));
  EXPECT_EQ(mesh->positions[0], dvec3(1, 0, 0));
  EXPECT_NE(scene->warnings[0].find("no transform"), std::string::npos);
  EXPECT_EQ(scene->warnings, mesh->warnings);
}

TEST(GltfScene, BrokenSkinsAndTexturesOfMaterialsAreRefused) {
  const TemporaryFolder folder;
  for (const char* members :
       {R"("skins":[{"joints":[7]}])", R"("skins":[{"joints":[]}])",
        R"("skins":[{"joints":[0],"inverseBindMatrices":9}])", R"("materials":[{"normalTexture":{"index":3}}])",
        R"("materials":[{"emissiveTexture":{"index":3}}])"}) {
    EXPECT_FALSE(read_gltf_scene(folder.write("bad.glb", scene_file(R"({"mesh":0})", "0", members)))) << members;
  }
  EXPECT_FALSE(read_gltf_scene(folder.write("bad.glb", scene_file(R"({"mesh":0,"skin":2})", "0"))));
}

TEST(GltfScene, HiddenNodesAndWhatIsBelowThemAreLeftOut) {
  const TemporaryFolder folder;
  const auto file = folder.write(
      "a.glb", scene_file(R"({"mesh":0,"children":[1],"extensions":{"KHR_node_visibility":{"visible":false}}},
                             {"mesh":0},{"mesh":0,"extensions":{"KHR_node_visibility":{"visible":true}}})",
                          "0,2", R"("extensionsUsed":["KHR_node_visibility"])"));
  const auto scene = read_gltf_scene(file);
  ASSERT_TRUE(scene) << scene.error().message;
  ASSERT_EQ(scene->instances.size(), 1u);
  EXPECT_EQ(scene->instances[0].node, 2u);
  EXPECT_TRUE(scene->warnings.empty());
  const auto mesh = read_source(file);
  ASSERT_TRUE(mesh);
  EXPECT_EQ(mesh->face_count(), 1u);
}

/// The triangle with one morph target that lifts it by 2, and with lines.
std::string morphed_file(const std::string& node_members) {
  std::string file =
      scene_file(fmt::format(R"({{"mesh":0{}}})", node_members), "0", "", raw<float>({0, 0, 2, 0, 0, 2, 0, 0, 2}),
                 R"({"bufferView":1,"componentType":5126,"count":3,"type":"VEC3"})");
  const std::string plain = R"({"attributes":{"POSITION":0}}]}])";
  std::string json = file.substr(20);
  const std::string targets =
      R"({"attributes":{"POSITION":0},"targets":[{"POSITION":1}]},{"attributes":{"POSITION":0},"mode":1}],"weights":[0.5]}])";
  json.replace(json.find(plain), plain.size(), targets);
  const size_t end = json.find("BIN") - 4;  // the chunk's length stands before its name
  return glb(json.substr(0, end), json.substr(end + 8));
}

TEST(GltfScene, MorphTargetsHaveTheirDefaultWeightsAndLinesAreSaid) {
  const TemporaryFolder folder;
  const auto file = folder.write("a.glb", morphed_file(""));
  const auto mesh = read_source(file);
  ASSERT_TRUE(mesh) << mesh.error().message;
  ASSERT_EQ(mesh->positions.size(), 3u);
  for (const dvec3& p : mesh->positions) EXPECT_EQ(p.z, 1.0);
  EXPECT_EQ(mesh->warnings,
            std::vector<std::string>{"mesh 0 primitive 1: points or lines; they have no surface, left out"});
  const auto other = read_gltf_scene(folder.write("b.glb", morphed_file(R"(,"name":"face","weights":[1])")));
  ASSERT_TRUE(other) << other.error().message;
  EXPECT_EQ(other->warnings,
            std::vector<std::string>{"node 0 (face): its own morph weights are ignored; its mesh's are shown"});
}

TEST(GltfScene, AnimatedLightsAreSaid) {
  const TemporaryFolder folder;
  std::string members = R"("extensionsUsed":["KHR_lights_punctual"],
      "extensions":{"KHR_lights_punctual":{"lights":[{"type":"point","name":"lamp"}]}},
      "animations":[{"channels":[{"sampler":0,"target":{"node":0,"path":"translation"}}],
                     "samplers":[{"input":1,"output":2}]}])";
  const auto scene = read_gltf_scene(
      folder.write("a.glb", scene_file(R"({"extensions":{"KHR_lights_punctual":{"light":0}}})", "0", members,
                                       raw<float>({0, 1, 0, 0, 0, 1, 0, 0}),
                                       R"({"bufferView":1,"componentType":5126,"count":2,"type":"SCALAR"},
                             {"bufferView":1,"byteOffset":8,"componentType":5126,"count":2,"type":"VEC3"})")));
  ASSERT_TRUE(scene) << scene.error().message;
  EXPECT_EQ(scene->lights.size(), 1u);
  EXPECT_EQ(scene->warnings, std::vector<std::string>{"light lamp: it is animated; it stays where it is at time 0"});
}

}  // namespace
}  // namespace farfield
