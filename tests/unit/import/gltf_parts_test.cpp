// SPDX-License-Identifier: Apache-2.0
// An asset's hash is of what it takes from its file, and only that is read.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "import/gltf_scene.h"
#include "import/read_source.h"
#include "tests/support/files.h"
#include "tests/support/gltf_files.h"

namespace farfield {
namespace {

using Json = nlohmann::json;

/// A triangle as tall as asked for, and its indices.
std::string triangle(float height) {
  return test::raw<float>({0, 0, 0, 1, 0, 0, 0, height, 0}) + test::raw<uint32_t>({0, 1, 2});
}

/// Two meshes, "oak" and "elm", with a file each, a material each and an image for that of the oak; a grove of both; a
/// camera.
Json grove() {
  Json json = Json::parse(R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0,3]}],
    "nodes":[{"name":"grove","translation":[5,0,0],"children":[1,2]},{"mesh":0,"translation":[1,0,0]},{"mesh":1},
             {"camera":0}],
    "cameras":[{"type":"perspective","perspective":{"yfov":0.6,"znear":0.1}}],
    "materials":[{"name":"bark","pbrMetallicRoughness":{"baseColorTexture":{"index":0}}},{"name":"leaf"}],
    "textures":[{"source":0}],"images":[{"uri":"bark.png"}],
    "meshes":[],"buffers":[],"bufferViews":[],"accessors":[]})");
  for (const char* name : {"oak", "elm"}) {
    const size_t n = json["meshes"].size();
    json["meshes"].push_back(
        {{"name", name},
         {"primitives", {{{"attributes", {{"POSITION", 2 * n}}}, {"indices", 2 * n + 1}, {"material", n}}}}});
    json["buffers"].push_back({{"uri", fmt::format("{}%20tree.bin", name)}, {"byteLength", 48}});
    json["bufferViews"].push_back({{"buffer", n}, {"byteLength", 36}});
    json["bufferViews"].push_back({{"buffer", n}, {"byteOffset", 36}, {"byteLength", 12}});
    json["accessors"].push_back({{"bufferView", 2 * n},
                                 {"componentType", 5126},
                                 {"count", 3},
                                 {"type", "VEC3"},
                                 {"min", {0, 0, 0}},
                                 {"max", {1, 1, 0}}});
    json["accessors"].push_back({{"bufferView", 2 * n + 1}, {"componentType", 5125}, {"count", 3}, {"type", "SCALAR"}});
  }
  return json;
}

class GltfParts : public testing::Test {
 protected:
  GltfParts() {
    folder_.write("oak tree.bin", triangle(1));
    folder_.write("elm tree.bin", triangle(1));
    folder_.write("bark.png", "one");
    write(grove());
  }

  void write(const Json& json) { path_ = folder_.write("grove.gltf", json.dump()); }
  uint64_t hash(int mesh, int node = -1) {
    ImportOptions options;
    options.mesh = mesh;
    options.node = node;
    return hash_source(path_, {}, options).value();
  }
  /// Whether the hashes of the oak, the elm and the grove of both are others after `change`.
  template <typename Change>
  std::string changed(const Change& change) {
    const uint64_t before[] = {hash(0), hash(1), hash(-1, 0)};
    change();
    const uint64_t after[] = {hash(0), hash(1), hash(-1, 0)};
    const char* names[] = {"oak ", "elm ", "grove "};
    std::string text;
    for (size_t i = 0; i < 3; ++i) text += before[i] != after[i] ? names[i] : "";
    return text;
  }
  template <typename Edit>
  std::string changed_by(const Edit& edit) {
    write(grove());
    return changed([&] {
      Json json = grove();
      edit(json);
      write(json);
    });
  }

  test::TemporaryFolder folder_;
  std::filesystem::path path_;
};

TEST_F(GltfParts, AreNotChangedByWhatTheyDoNotShow) {
  EXPECT_EQ(changed_by([](Json& json) { json["cameras"][0]["perspective"]["yfov"] = 0.7; }), "");
  EXPECT_EQ(changed_by([](Json& json) { json["nodes"][0]["translation"][0] = 6; }), "") << "a place of the grove";
  EXPECT_EQ(changed_by([](Json& json) {
              json["nodes"].push_back({{"mesh", 0}});
              json["scenes"][0]["nodes"].push_back(4);
            }),
            "");
}

TEST_F(GltfParts, AreChangedByWhatTheyShow) {
  EXPECT_EQ(changed_by([](Json& json) { json["nodes"][1]["translation"][0] = 2; }), "grove ");
  EXPECT_EQ(changed_by([](Json& json) { json["nodes"][0]["children"] = {2, 1}; }), "grove ");
  EXPECT_EQ(changed_by([](Json& json) { json["meshes"][1]["primitives"][0]["mode"] = 5; }), "elm grove ");
  EXPECT_EQ(changed_by([](Json& json) { json["materials"][1]["doubleSided"] = true; }), "elm grove ");
  EXPECT_EQ(changed_by([](Json& json) { json["accessors"][1]["count"] = 0; }), "oak grove ");
  EXPECT_EQ(changed_by([](Json& json) { json["extensionsUsed"] = {"VENDOR_thing"}; }), "oak elm grove ");
  EXPECT_EQ(changed_by([](Json& json) {
              json["nodes"].push_back(
                  {{"children", Json::array({0})}, {"extensions", {{"KHR_node_visibility", {{"visible", false}}}}}});
              json["scenes"][0]["nodes"][0] = 4;
            }),
            "grove ");
}

TEST_F(GltfParts, AreChangedByTheirFiles) {
  EXPECT_EQ(changed([&] { folder_.write("elm tree.bin", triangle(2)); }), "elm grove ");
  EXPECT_EQ(changed([&] { folder_.write("bark.png", "two"); }), "oak grove ");
  EXPECT_EQ(changed([&] { std::filesystem::remove(folder_.path() / "bark.png"); }), "oak grove ");
}

TEST_F(GltfParts, OfABinaryFileAreTheirViews) {
  Json json = grove();
  json["buffers"] = {{{"byteLength", 96}}};
  for (size_t view = 0; view < 4; ++view) {
    json["bufferViews"][view]["buffer"] = 0;
    json["bufferViews"][view]["byteOffset"] = view / 2 * 48 + view % 2 * 36;
  }
  const auto write_glb = [&](float oak, float elm) {
    path_ = folder_.write("grove.glb", test::glb(json.dump(), triangle(oak) + triangle(elm)));
  };
  write_glb(1, 1);
  EXPECT_EQ(changed([&] { write_glb(1, 2); }), "elm grove ");
  EXPECT_EQ(changed([&] { write_glb(2, 2); }), "oak grove ");
}

TEST_F(GltfParts, ReadingOneGivesItsHashAndReadsItsFilesAlone) {
  folder_.write("elm tree.bin", "torn");  // which the oak does not need
  ImportOptions options;
  options.mesh = 0;
  const auto oak = read_source(path_, options);
  ASSERT_TRUE(oak) << oak.error().message;
  EXPECT_EQ(oak->source_hash, hash(0));
  EXPECT_EQ(oak->positions[2], dvec3(0, 1, 0));
  ASSERT_EQ(oak->source_files.size(), 2u);
  EXPECT_EQ(oak->source_files[0].path, "bark.png");
  EXPECT_EQ(oak->source_files[1].path, "oak tree.bin");
  EXPECT_TRUE(read_gltf_scene(path_)) << "a scene is read without its meshes";
  options.mesh = 1;
  const auto elm = read_source(path_, options);
  EXPECT_EQ(elm.error().code, ErrorCode::BadFile);
  EXPECT_NE(elm.error().message.find("elm tree.bin: 4 bytes, and 48 by the glTF file"), std::string::npos)
      << elm.error().message;
}

TEST_F(GltfParts, AFileThatIsNotThereIsNamed) {
  std::filesystem::remove(folder_.path() / "elm tree.bin");
  const auto scene = read_gltf_scene(path_);
  EXPECT_EQ(scene.error().code, ErrorCode::NotFound);
  EXPECT_NE(scene.error().message.find("there is no file elm tree.bin"), std::string::npos) << scene.error().message;
}

TEST_F(GltfParts, BrokenOnesAreHashedWithTheWholeFile) {
  // What cannot be followed must neither crash nor be taken for something else.
  const std::vector<std::string> edits = {
      R"([{"op":"replace","path":"/meshes/0/primitives/0/attributes/POSITION","value":99}])",
      R"([{"op":"replace","path":"/meshes/0/primitives/0/indices","value":"x"}])",
      R"([{"op":"replace","path":"/meshes/0/primitives","value":3}])",
      R"([{"op":"replace","path":"/accessors/0/bufferView","value":-1}])",
      R"([{"op":"replace","path":"/bufferViews/0/byteLength","value":1000}])",
      R"([{"op":"replace","path":"/bufferViews/0/buffer","value":7}])",
      R"([{"op":"replace","path":"/materials/0","value":[1]}])",
      R"([{"op":"replace","path":"/nodes/0/children","value":[0]}])",
      R"([{"op":"replace","path":"/nodes/0/children","value":"1"}])",
      R"([{"op":"add","path":"/nodes/1/skin","value":0}])"};
  for (const std::string& edit : edits) {
    const Json broken = grove().patch(Json::parse(edit));
    write(broken);
    const uint64_t before = hash(0, -1) ^ hash(-1, 0);
    Json moved = broken;
    moved["cameras"][0]["perspective"]["yfov"] = 0.7;
    write(moved);
    EXPECT_NE(hash(0, -1) ^ hash(-1, 0), before) << edit;
  }
}

}  // namespace
}  // namespace farfield
