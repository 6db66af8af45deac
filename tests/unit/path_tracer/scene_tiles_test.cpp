// SPDX-License-Identifier: Apache-2.0
// Grounds that are baked as tiles, from the file to the picture.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "path_tracer/image.h"
#include "path_tracer/render_job.h"
#include "path_tracer/scene_assets.h"
#include "tests/support/files.h"
#include "tests/support/gltf_files.h"

namespace farfield {
namespace {

namespace fs = std::filesystem;
using test::raw;

constexpr int kSide = 40;  // quads of the ground along each axis

/// Hills of 20 x 20 around the origin, three shards on them, and a camera 6 above that looks down: it sees nothing but
/// the ground. ground_node: what else its node says.
std::string hills_from_above(const std::string& ground_node = "") {
  std::vector<float> points, normals;
  std::vector<uint32_t> indices;
  for (int j = 0; j <= kSide; ++j) {
    for (int i = 0; i <= kSide; ++i) {
      const float x = 20.0f * static_cast<float>(i) / kSide - 10, z = 20.0f * static_cast<float>(j) / kSide - 10;
      points.insert(points.end(), {x, 0.5f * std::sin(x) * std::cos(0.8f * z), z});
      const vec3 n =
          glm::normalize(vec3(-0.5f * std::cos(x) * std::cos(0.8f * z), 1, 0.4f * std::sin(x) * std::sin(0.8f * z)));
      normals.insert(normals.end(), {n.x, n.y, n.z});
    }
  }
  for (uint32_t j = 0; j < kSide; ++j) {
    for (uint32_t i = 0; i < kSide; ++i) {
      const uint32_t a = j * (kSide + 1) + i, c = a + kSide + 1;
      indices.insert(indices.end(), {a, c, a + 1, a + 1, c, c + 1});
    }
  }
  const size_t vertices = points.size() / 3;
  const std::string shard = raw<float>({-0.1f, 0, -0.1f, 0.1f, 0, -0.1f, 0, 0.1f, 0.1f});
  const std::string binary = raw(points) + raw(normals) + raw(indices) + shard;
  const auto view = [&](size_t at, size_t bytes) {
    return fmt::format(R"({{"buffer": 0, "byteOffset": {}, "byteLength": {}}})", at, bytes);
  };
  return test::glb(fmt::format(R"({{"asset": {{"version": "2.0"}}, "scene": 0, "scenes": [{{"nodes": [0, 1, 2, 3, 4]}}],
"nodes": [{{"mesh": 0, "name": "Ground"{}}}, {{"mesh": 1, "translation": [40, 0, 0]}},
          {{"mesh": 1, "translation": [-40, 0, 0]}}, {{"mesh": 1, "translation": [0, 0, 40]}},
          {{"camera": 0, "translation": [0.3, 6, 0.2], "rotation": [-0.70710678, 0, 0, 0.70710678]}}],
"cameras": [{{"type": "perspective", "perspective": {{"yfov": 1.2, "znear": 0.1}}}}],
"meshes": [{{"name": "ground", "primitives": [{{"attributes": {{"POSITION": 0, "NORMAL": 1}}, "indices": 2}}]}},
           {{"name": "shard", "primitives": [{{"attributes": {{"POSITION": 3}}}}]}}],
"accessors": [{{"bufferView": 0, "componentType": 5126, "count": {}, "type": "VEC3", "min": [-10, -0.5, -10], "max": [10, 0.5, 10]}},
              {{"bufferView": 1, "componentType": 5126, "count": {}, "type": "VEC3"}},
              {{"bufferView": 2, "componentType": 5125, "count": {}, "type": "SCALAR"}},
              {{"bufferView": 3, "componentType": 5126, "count": 3, "type": "VEC3", "min": [-0.1, 0, -0.1], "max": [0.1, 0.1, 0.1]}}],
"bufferViews": [{}, {}, {}, {}], "buffers": [{{"byteLength": {}}}]}})",
                               ground_node, vertices, vertices, indices.size(), view(0, 12 * vertices),
                               view(12 * vertices, 12 * vertices), view(24 * vertices, 4 * indices.size()),
                               view(24 * vertices + 4 * indices.size(), 36), binary.size()),
                   binary);
}

class Tiles : public testing::Test {
 protected:
  Tiles() {
    options_.scene = folder_.write("hills.glb", hills_from_above());
    options_.assets = folder_.path() / "assets";
    options_.baker = "/bin/false";  // all is baked here
    options_.finest_grid = 32;
    options_.tile_triangles = 500;
    options_.width = options_.height = 48;
    options_.trace.samples_per_pixel = 16;
    options_.warning = [this](const std::string& line) { warnings_.push_back(line); };
  }

  SceneBakeOptions bake_options() const {
    SceneBakeOptions bake;
    bake.scene = options_.scene;
    bake.library = options_.assets / "hills";
    bake.finest_grid = options_.finest_grid;
    bake.read.tile_triangles = options_.tile_triangles;
    return bake;
  }
  std::set<std::string> bake() {
    SceneBakeOptions options = bake_options();
    std::set<std::string> baked;
    options.end = [&](const std::string& asset, const Result<BakeReport>& report) {
      EXPECT_TRUE(report) << report.error().message;
      if (report && !report->up_to_date) baked.insert(asset);
    };
    EXPECT_EQ(bake_scene_assets(options).value(), 0u);
    return baked;
  }
  Image render() {
    const fs::path out = folder_.path() / "frame.exr";
    const auto report = render_frame(options_, 0, out);
    EXPECT_TRUE(report) << report.error().message;
    return read_exr(out).value().image;
  }
  float alpha(const Image& image, int x, int y) const { return image.pixel(x, y)[image.find_channel("A")]; }

  test::TemporaryFolder folder_;
  RenderOptions options_;
  std::vector<std::string> warnings_;
};

TEST_F(Tiles, AreAssetsThatAreFoundAgain) {
  const std::set<std::string> baked = bake();
  EXPECT_EQ(baked.size(), 1u + 8);
  EXPECT_TRUE(baked.contains("ground_tile_0"));
  EXPECT_TRUE(baked.contains("ground_tile_7"));
  EXPECT_TRUE(bake().empty());
  fs::remove_all(options_.assets / "hills" / "ground_tile_5.farfield");
  EXPECT_EQ(bake(), std::set<std::string>{"ground_tile_5"});

  options_.tile_triangles = 0;
  EXPECT_EQ(bake(), std::set<std::string>{"ground"});
}

TEST_F(Tiles, AreSaidOnce) {
  bake();
  render();
  ASSERT_EQ(warnings_.size(), 1u) << warnings_.back();
  EXPECT_NE(warnings_[0].find("mesh ground: "), std::string::npos);
  EXPECT_NE(warnings_[0].find("8 tiles"), std::string::npos);
}

TEST_F(Tiles, OfPartsOfABakeAreTheSame) {
  bake();
  const fs::path whole = options_.assets / "hills" / "ground_tile_6.farfield" / "manifest.json";
  const auto bytes = test::read_bytes(whole);
  SceneBakeOptions part = bake_options();
  part.library = folder_.path() / "parts";
  part.part_count = 3;
  for (part.part = 0; part.part < 3; ++part.part) EXPECT_EQ(bake_scene_assets(part).value(), 0u);
  EXPECT_EQ(test::read_bytes(part.library / "ground_tile_6.farfield" / "manifest.json"), bytes);
}

TEST_F(Tiles, ShowTheSourceAsItIs) {
  bake();
  options_.full_detail = true;
  const Image tiles = render();
  options_.tile_triangles = 0;
  bake();
  const Image whole = render();
  for (int y = 0; y < options_.height; ++y)
    for (int x = 0; x < options_.width; ++x)
      for (int c = 0; c < 3; ++c)
        ASSERT_NEAR(tiles.pixel(x, y)[c], whole.pixel(x, y)[c], 0.02f * whole.pixel(x, y)[c]) << x << ' ' << y;
}

TEST_F(Tiles, LetNoRayThroughWhereTheyMeet) {
  bake();
  std::set<float> levels;
  for (const Blend blend : {Blend::Dissolve, Blend::Morph}) {
    options_.blend = blend;
    for (const float error : {1.0f, 4.0f, 6.0f, 9.0f, 1e6f}) {
      options_.pixel_error = error;
      const Image image = render();
      for (int y = 0; y < options_.height; ++y) {
        for (int x = 0; x < options_.width; ++x) {
          ASSERT_NEAR(alpha(image, x, y), 1.0f, 1e-4f) << error << ": " << x << ' ' << y;
          levels.insert(image.pixel(x, y)[image.find_channel("lod.level")]);
        }
      }
    }
  }
  EXPECT_GT(levels.size(), 2u) << "tiles of several levels were seen";
}

TEST_F(Tiles, HaveTheNameOfTheirObject) {
  bake();
  options_.cryptomatte = true;
  const fs::path out = folder_.path() / "ids.exr";
  ASSERT_TRUE(render_frame(options_, 0, out));
  const auto file = read_exr(out);
  ASSERT_TRUE(file);
  const int first = file->image.find_channel("CryptoObject00.R");
  ASSERT_GE(first, 0);
  for (int y = 0; y < options_.height; ++y)
    for (int x = 0; x < options_.width; ++x) EXPECT_EQ(file->image.pixel(x, y)[first], file->image.pixel(0, 0)[first]);
}

}  // namespace
}  // namespace farfield
