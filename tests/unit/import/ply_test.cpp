// SPDX-License-Identifier: Apache-2.0
// What PLY files say beside positions and faces.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "import/read_source.h"
#include "tests/support/files.h"
#include "tests/support/import_cases.h"

namespace farfield {
namespace {

using test::kCases;
using test::TemporaryFolder;

namespace fs = std::filesystem;

Result<SourceMesh> read_text(const std::string& text) {
  const TemporaryFolder folder;
  return read_source(folder.write("a.ply", text));
}

/// One triangle whose vertices have further properties.
std::string triangle(const std::string& properties, const std::string& values) {
  return "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n" +
         properties + "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0 " + values +
         "\n1 0 0 " + values + "\n0 1 0 " + values + "\n3 0 1 2\n";
}

void expect_textured(const SourceMesh& mesh, size_t textures) {
  ASSERT_EQ(mesh.materials.size(), textures);
  for (const SourceMaterial& material : mesh.materials) {
    ASSERT_TRUE(material.base_color_map);
    EXPECT_EQ(material.base_color, vec3(1.0f));
  }
  ASSERT_EQ(mesh.corner_uv.size(), mesh.corner_count());
  for (size_t i = 0; i < mesh.corner_count(); ++i) {  // the unit square, its v pointing down
    const dvec3& p = mesh.positions[mesh.corner_position[i]];
    EXPECT_EQ(mesh.corner_uv[i], vec2(p.x, 1 - p.y)) << i;
  }
}

TEST(Ply, TexturesByVertexAndByFaceAreRead) {
  for (const char* name : {"p02_texture_vertex.ply", "p02_texture_face.ply"}) {
    const auto mesh = read_source(kCases / name);
    ASSERT_TRUE(mesh) << mesh.error().message;
    expect_textured(*mesh, 1);
    EXPECT_TRUE(mesh->warnings.empty()) << mesh->warnings[0];
    ASSERT_EQ(mesh->source_files.size(), 1u);
    EXPECT_EQ(mesh->source_files[0].path, "halves.png");
  }
}

TEST(Ply, TheFirstOfSeveralTexturesIsTakenWhereNothingSaysWhich) {
  const auto mesh = read_source(kCases / "p08_multi_texture.ply");
  ASSERT_TRUE(mesh) << mesh.error().message;
  expect_textured(*mesh, 2);
  EXPECT_EQ(mesh->face_material, std::vector<uint32_t>{0});
  ASSERT_EQ(mesh->warnings.size(), 1u);
  EXPECT_NE(mesh->warnings[0].find("names 2 textures"), std::string::npos);
}

TEST(Ply, TextureNumbersSayWhichTexture) {
  const TemporaryFolder folder;
  for (const char* image : {"halves.png", "leaf_rgb.png"}) fs::copy(kCases / image, folder.path() / image);
  const auto mesh = read_source(folder.write(
      "a.ply",
      "ply\nformat ascii 1.0\ncomment TextureFile halves.png\ncomment TextureFile leaf_rgb.png\nelement vertex 3\n"
      "property float x\nproperty float y\nproperty float z\nelement face 3\n"
      "property list uchar int vertex_indices\nproperty list uchar float texcoord\nproperty int texnumber\nend_header\n"
      "0 0 0\n1 0 0\n1 1 0\n3 0 1 2 6 0 0 1 0 1 1 1\n3 0 1 2 6 0 0 1 0 1 1 0\n3 0 1 2 6 0 0 1 0 1 1 7\n"));
  ASSERT_TRUE(mesh) << mesh.error().message;
  expect_textured(*mesh, 2);
  EXPECT_EQ(mesh->face_material, (std::vector<uint32_t>{1, 0, 0}));
  ASSERT_EQ(mesh->warnings.size(), 1u);
  EXPECT_NE(mesh->warnings[0].find("1 faces have a texnumber"), std::string::npos);
}

TEST(Ply, ATextureAloneHoldsBesideColours) {
  const TemporaryFolder folder;
  fs::copy(kCases / "halves.png", folder.path() / "halves.png");
  std::string text =
      triangle("property float s\nproperty float t\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n",
               "0 0 128 128 128");
  text.insert(text.find("element"), "comment TextureFile halves.png\n");
  const auto mesh = read_source(folder.write("a.ply", text));
  ASSERT_TRUE(mesh) << mesh.error().message;
  EXPECT_TRUE(mesh->materials[0].base_color_map);
  EXPECT_TRUE(mesh->corner_color.empty());
  ASSERT_EQ(mesh->warnings.size(), 1u);
  EXPECT_NE(mesh->warnings[0].find("colours beside its texture"), std::string::npos);
}

TEST(Ply, CoordinatesWithoutAnImageAndAnImageWithoutCoordinatesAreSaid) {
  const auto no_image = read_text(triangle("property float s\nproperty float t\n", "0 0"));
  ASSERT_TRUE(no_image);
  ASSERT_EQ(no_image->warnings.size(), 1u);
  EXPECT_NE(no_image->warnings[0].find("TextureFile"), std::string::npos);
  std::string text = triangle("", "");
  text.insert(text.find("element"), "comment TextureFile gone.png\n");
  const auto missing = read_text(text);
  ASSERT_TRUE(missing);
  ASSERT_EQ(missing->warnings.size(), 2u);
  EXPECT_NE(missing->warnings[0].find("gone.png"), std::string::npos);
  EXPECT_EQ(missing->materials[0].base_color, vec3(0.8f));
}

TEST(Ply, ACommentWithoutContentEndsWithItsLine) {
  std::string text = triangle("", "");
  text.insert(text.find("element"), "comment\ncomment TextureFile\ncomment made by hand\n");
  const auto mesh = read_text(text);
  ASSERT_TRUE(mesh) << mesh.error().message;
  EXPECT_EQ(mesh->face_count(), 1u);
}

TEST(Ply, VerticesHaveNormals) {
  const auto mesh = read_text(triangle("property float nx\nproperty float ny\nproperty float nz\n", "0 3 4"));
  ASSERT_TRUE(mesh);
  ASSERT_EQ(mesh->corner_normal.size(), 3u);
  EXPECT_LT(glm::length(mesh->corner_normal[2] - vec3(0, 0.6f, 0.8f)), 1e-6f);
  EXPECT_TRUE(mesh->warnings.empty());
}

struct ColourCase {
  const char* type;
  const char* values;
  float red;  ///< linear
  bool is_said;
};

TEST(Ply, ColoursAreReadByTheirRange) {
  const float half = srgb_to_linear(128.0f / 255);
  const ColourCase cases[] = {
      {"uchar", "128 255 0", half, false}, {"ushort", "32896 65535 0", half, false},
      {"ushort", "128 255 0", half, true}, {"int", "128 255 0", half, true},
      {"float", "0.5 1 0", 0.5f, false},   {"float", "0.5 1.1 0", 0.5f, false},
      {"double", "128 255 0", half, true}, {"float", "nan 1 0", 0.0f, false},
  };
  for (const ColourCase& c : cases) {
    const auto mesh =
        read_text(triangle(fmt::format("property {0} red\nproperty {0} green\nproperty {0} blue\n", c.type), c.values));
    ASSERT_TRUE(mesh) << c.type;
    ASSERT_EQ(mesh->corner_color.size(), 3u);
    EXPECT_NEAR(mesh->corner_color[0].x, c.red, 1e-3) << c.type << " " << c.values;
    EXPECT_NEAR(mesh->corner_color[0].y, 1, 1e-3) << c.type << " " << c.values;
    EXPECT_EQ(!mesh->warnings.empty(), c.is_said) << c.type << " " << c.values;
  }
}

TEST(Ply, WhatIsNotReadIsNamedOnce) {
  const auto mesh = read_text(triangle("property float confidence\nproperty uchar alpha\n", "1 255"));
  ASSERT_TRUE(mesh);
  EXPECT_EQ(mesh->warnings, std::vector<std::string>{"vertex confidence: ignored"});
}

TEST(Ply, TextLeftOverIsAnError) {
  const auto mesh = read_text(triangle("", "") + "3 0 1 2\n");
  ASSERT_FALSE(mesh);
  EXPECT_NE(mesh.error().message.find("8 bytes are left over"), std::string::npos) << mesh.error().message;
  EXPECT_TRUE(read_text(triangle("", "") + " \r\n\n"));
}

TEST(Ply, FacesWithAWrongNumberOfCoordinatesAreRefused) {
  std::string text = triangle("", "");
  text.insert(text.find("end_header"), "property list uchar float texcoord\n");
  text.replace(text.rfind("3 0 1 2"), 7, "3 0 1 2 4 0 0 1 0");
  const auto mesh = read_text(text);
  ASSERT_FALSE(mesh);
  EXPECT_NE(mesh.error().message.find("face 0 has 4 values in texcoord"), std::string::npos) << mesh.error().message;
}

}  // namespace
}  // namespace farfield
