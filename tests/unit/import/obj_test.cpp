// SPDX-License-Identifier: Apache-2.0
// What OBJ files say beside positions, faces and materials.
#include <gtest/gtest.h>

#include "import/read_source.h"
#include "tests/support/files.h"

namespace farfield {
namespace {

using test::TemporaryFolder;

SourceMesh read_text(const char* name, const std::string& text) {
  const TemporaryFolder folder;
  auto mesh = read_source(folder.write(name, text));
  EXPECT_TRUE(mesh) << mesh.error().message;
  return mesh ? std::move(*mesh) : SourceMesh{};
}

/// Two unit squares that meet at a right angle in the edge x = 1.
const std::string kBend = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 1 0 -1\nv 1 1 -1\n";

void expect_near(const vec3& is, const vec3& wanted) {
  EXPECT_LT(glm::length(is - wanted), 1e-6f) << is.x << " " << is.y << " " << is.z;
}

TEST(Obj, CornersHaveTheNormalsThatTheyName) {
  const SourceMesh mesh = read_text("a.obj", kBend + "vn 0 0 2\nvn 0 3 4\nf 1//1 2//2 3//-1 4\n");
  ASSERT_EQ(mesh.corner_normal.size(), 4u);
  expect_near(mesh.corner_normal[0], {0, 0, 1});
  expect_near(mesh.corner_normal[1], {0, 0.6f, 0.8f});
  expect_near(mesh.corner_normal[2], {0, 0.6f, 0.8f});
  expect_near(mesh.corner_normal[3], {0, 0, 0});
  EXPECT_TRUE(mesh.warnings.empty());
}

TEST(Obj, NormalsWithoutDirectionOrThatDoNotExistAreFlat) {
  const SourceMesh mesh = read_text("a.obj", kBend + "vn 0 0 0\nvn nan 0 0\nvn 1e400 0 0\nf 1//1 2//2 3//3 4//9\n");
  ASSERT_EQ(mesh.corner_normal.size(), 4u);
  for (const vec3& normal : mesh.corner_normal) expect_near(normal, {0, 0, 0});
  ASSERT_EQ(mesh.warnings.size(), 1u);
  EXPECT_NE(mesh.warnings[0].find("1 corners name normals that do not exist"), std::string::npos);
}

TEST(Obj, NormalsOfFacesThatAreDroppedGoWithThem) {
  const SourceMesh mesh = read_text("a.obj", kBend + "vn 0 0 1\nvn 1 0 0\nf 1//1 2//1 99//1\nf 2//2 5//2 6//2 3//2\n");
  ASSERT_EQ(mesh.corner_normal.size(), 4u);
  for (const vec3& normal : mesh.corner_normal) expect_near(normal, {1, 0, 0});
}

TEST(Obj, SmoothingGroupsWithoutNormalsAreSmooth) {
  const SourceMesh mesh = read_text("a.obj", kBend + "s 1\nf 1 2 3 4\nf 2 5 6 3\n");
  ASSERT_EQ(mesh.corner_normal.size(), 8u);
  expect_near(mesh.corner_normal[0], {0, 0, 1});
  const float h = std::sqrt(0.5f);
  for (const size_t corner : {1, 2, 4, 7}) expect_near(mesh.corner_normal[corner], {h, 0, h});
  expect_near(mesh.corner_normal[5], {1, 0, 0});
}

TEST(Obj, GroupsMeetInASharpEdgeAndOffIsFlat) {
  const SourceMesh sharp = read_text("a.obj", kBend + "s 1\nf 1 2 3 4\ns 2\nf 2 5 6 3\n");
  ASSERT_EQ(sharp.corner_normal.size(), 8u);
  for (size_t i = 0; i < 8; ++i) expect_near(sharp.corner_normal[i], i < 4 ? vec3(0, 0, 1) : vec3(1, 0, 0));
  EXPECT_TRUE(read_text("a.obj", kBend + "s off\nf 1 2 3 4\ns 0\nf 2 5 6 3\n").corner_normal.empty());
}

TEST(Obj, WhatIsNoSurfaceIsSaidOnceWithItsLine) {
  const SourceMesh mesh = read_text("a.obj", kBend + "o one\ng two\nl 1 2\nf 1 2 3\nl 2 3\np 1\n");
  EXPECT_EQ(mesh.face_count(), 1u);
  const std::vector<std::string> wanted{"line 9: l (lines) is ignored, as are 1 more",
                                        "line 12: p (points) is ignored"};
  EXPECT_EQ(mesh.warnings, wanted);
}

// ---- subdivision cages

TEST(Obj, TagsOfCagesAreRead) {
  const SourceMesh mesh =
      read_text("a.obj", kBend + "f 1 2 3 4\nf 2 5 6 3\nt crease 2/1/0 1 2 2.5\nt crease 4/2/0 0 1 2 3 1 inf\n" +
                             "t corner 2/1/0 0 3 10\nt hole 1/0/0 1\nt interpolateboundary 1/0/0 2\n" +
                             "t facevaryinginterpolateboundary 1/0/0 4\nt creasemethod 0/0/1 chaikin\n");
  const CageTags& cage = mesh.cage;
  EXPECT_EQ(cage.crease_edges, (std::vector<glm::uvec2>{{1, 2}, {0, 1}, {2, 3}}));
  EXPECT_EQ(cage.crease_sharpness, (std::vector<float>{2.5f, 1, std::numeric_limits<float>::infinity()}));
  EXPECT_EQ(cage.sharp_vertices, (std::vector<uint32_t>{0, 3}));
  EXPECT_EQ(cage.vertex_sharpness, (std::vector<float>{10, 10}));
  EXPECT_EQ(cage.holes, (std::vector<uint32_t>{1}));
  EXPECT_EQ(cage.boundary, CageBoundary::EdgeOnly);
  EXPECT_EQ(cage.uv, CageUv::Boundaries);
  EXPECT_EQ(cage.creasing, CageCreasing::Chaikin);
  EXPECT_TRUE(mesh.warnings.empty());
}

TEST(Obj, BadTagsAreSaidWithTheirLine) {
  for (const char* tag : {"t",
                          "t crease",
                          "t crease 2/1 0 1 1",
                          "t crease 2/1/0 0 1",
                          "t crease 2/1/0 0 -1 1",
                          "t crease 3/1/0 0 1 2 1",
                          "t crease 0/1/0 1",
                          "t crease 2/1/0 0 1 -1",
                          "t crease 2/1/0 0 1 nan",
                          "t crease 4/3/0 0 1 1 2 1 2 3",
                          "t crease 99999999999999999999/1/0 0 1 1",
                          "t corner 0/1/0 1",
                          "t corner 1/1/0 0 -3",
                          "t corner 1/0/0 0",
                          "t interpolateboundary 1/0/0 3",
                          "t interpolateboundary 0/0/0",
                          "t facevaryinginterpolateboundary 1/0/0 6",
                          "t creasemethod 0/0/1 odd",
                          "t creasemethod 0/0/2 normal",
                          "t vertexedit 1/1/0 0 1"}) {
    const SourceMesh mesh = read_text("a.obj", kBend + tag + "\nf 1 2 3 4\n");
    EXPECT_TRUE(mesh.cage.empty()) << tag;
    EXPECT_EQ(mesh.face_count(), 1u) << tag;
    ASSERT_EQ(mesh.warnings.size(), 1u) << tag;
    EXPECT_EQ(mesh.warnings[0].find("line 7: t "), 0u) << mesh.warnings[0];
  }
}

TEST(Obj, TagsOfWhatDoesNotExistAreIgnored) {
  const SourceMesh mesh = read_text("a.obj", kBend +
                                                 "f 1 2 99\nf 1 2 3 4\nf 2 5 6 3\nt crease 2/1/0 0 6 1\n"
                                                 "t corner 2/2/0 0 77 1 2\nt hole 4/0/0 0 2 3 7\n");
  EXPECT_TRUE(mesh.cage.crease_edges.empty());
  EXPECT_EQ(mesh.cage.sharp_vertices, (std::vector<uint32_t>{0}));
  EXPECT_EQ(mesh.cage.vertex_sharpness, (std::vector<float>{1}));
  EXPECT_EQ(mesh.cage.holes, (std::vector<uint32_t>{1})) << "face 2 of the file, whose face 0 was dropped";
  ASSERT_EQ(mesh.warnings.size(), 2u);
  EXPECT_NE(mesh.warnings[1].find("5 tags"), std::string::npos) << mesh.warnings[1];
}

}  // namespace
}  // namespace farfield
