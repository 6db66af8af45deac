// SPDX-License-Identifier: Apache-2.0
// What MTL says of light and of the surface's fine shape.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "import/derived_maps.h"
#include "import/read_source.h"
#include "tests/support/files.h"
#include "tests/support/import_cases.h"

namespace farfield {
namespace {

using test::kCases;
using test::TemporaryFolder;

namespace fs = std::filesystem;

const char* const kQuad =
    "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nusemtl m\nf 1/1 2/2 3/3 4/4\n";

/// A quad with one material. halves.png, red beside blue, and mask_grey.png lie beside it.
SourceMesh read_mtl_text(const std::string& lines) {
  const TemporaryFolder folder;
  for (const char* image : {"halves.png", "mask_grey.png"}) fs::copy(kCases / image, folder.path() / image);
  folder.write("m.mtl", "newmtl m\n" + lines);
  auto mesh = read_source(folder.write("a.obj", fmt::format("mtllib m.mtl\n{}", kQuad)));
  EXPECT_TRUE(mesh) << mesh.error().message;
  return mesh ? std::move(*mesh) : SourceMesh{};
}

std::string all_warnings(const SourceMesh& mesh) { return fmt::format("{}", fmt::join(mesh.warnings, "\n")); }

/// 8 x 8 texels.
template <typename Texel>
Texture image_of(Texel&& texel) {
  std::vector<vec4> texels;
  for (int y = 0; y < 8; ++y) {
    for (int x = 0; x < 8; ++x) texels.push_back(texel(x, y));
  }
  return Texture(8, 8, texels);
}

vec3 normal_at(const Texture& normals, int x, int y) {
  return 2.0f * vec3(normals.texel(normals.level(0), x, y)) - 1.0f;
}

TEST(Mtl, WhatGlowsIsRead) {
  const SourceMesh plain = read_mtl_text("Kd 0 0 0\nKe 5 2 0.5\n");
  EXPECT_EQ(plain.materials[0].emission, vec3(5, 2, 0.5f));
  EXPECT_EQ(all_warnings(plain), "");
  const SourceMesh mapped = read_mtl_text("map_Ke halves.png\n");
  EXPECT_EQ(mapped.materials[0].emission, vec3(1.0f));
  EXPECT_TRUE(mapped.materials[0].emission_map);
  EXPECT_EQ(all_warnings(mapped), "");
  const SourceMesh off = read_mtl_text("Ke 0 0 0\nmap_Ke halves.png\n");
  EXPECT_EQ(off.materials[0].emission, vec3(0.0f));
  EXPECT_NE(all_warnings(off).find("switches map_Ke off"), std::string::npos);
  EXPECT_EQ(read_mtl_text("map_Ke gone.png\n").materials[0].emission, vec3(0.0f));
}

TEST(Mtl, ImportCasesOfLightAndMapsAreRead) {
  const auto ke = read_source(kCases / "o22_ke.obj");
  ASSERT_TRUE(ke);
  EXPECT_EQ(ke->materials[0].emission, vec3(5.0f));
  EXPECT_EQ(all_warnings(*ke), "");
  const auto pbr = read_source(kCases / "o09_pbr_maps.obj");
  ASSERT_TRUE(pbr);
  const SourceMaterial& m = pbr->materials[0];
  EXPECT_EQ(m.name, "leaf");
  EXPECT_TRUE(m.metallic_roughness_map && m.emission_map && m.normal_map);
  EXPECT_EQ(m.emission, vec3(5.0f));
  EXPECT_NE(all_warnings(*pbr).find("map_Ks (line 9)"), std::string::npos) << all_warnings(*pbr);
}

TEST(Mtl, NormalMapsKeepTheirStrength) {
  const SourceMesh mesh = read_mtl_text("norm -bm 0.5 halves.png\n");
  EXPECT_TRUE(mesh.materials[0].normal_map);
  EXPECT_EQ(mesh.materials[0].normal_scale, 0.5f);
  EXPECT_EQ(all_warnings(mesh), "");
}

TEST(Mtl, HeightsBecomeANormalMapOnce) {
  const SourceMesh mesh = read_mtl_text("map_Bump -bm 2 -imfchan b halves.png\n");
  ASSERT_TRUE(mesh.materials[0].normal_map);
  EXPECT_EQ(mesh.materials[0].normal_scale, 1);
  const Texture& image = *mesh.materials[0].normal_map.image;
  // Blue is 0 left of the middle and 1 right of it: the slope against u turns the normal to the left.
  const vec3 middle = normal_at(image, image.width() / 2, image.height() / 2);
  EXPECT_NEAR(middle.x, -std::sqrt(0.5f), 1e-3);
  EXPECT_NEAR(middle.z, std::sqrt(0.5f), 1e-3);
  EXPECT_EQ(all_warnings(mesh), "");
}

TEST(Mtl, HeightsOfDispAreInTheFilesUnits) {
  const SourceMesh mesh = read_mtl_text("disp -mm -0.25 0.5 -bm 2 -clamp on -imfchan b halves.png\n");
  EXPECT_EQ(all_warnings(mesh), "");
  ASSERT_EQ(mesh.heights.size(), 1u);
  const SourceHeights& heights = mesh.heights[0];
  EXPECT_FLOAT_EQ(heights.base, -0.5f);
  EXPECT_FLOAT_EQ(heights.gain, 1);
  EXPECT_EQ(heights.wrap_u, Wrap::Clamp);
  EXPECT_EQ(heights.map->at({0.1f, 0.5f}, 1, Wrap::Clamp, Wrap::Clamp), 0) << "blue is 0 on the left";
  EXPECT_EQ(heights.map->at({0.9f, 0.5f}, 1, Wrap::Clamp, Wrap::Clamp), 1);
  const SourceMesh plain = read_mtl_text("map_disp halves.png\n");
  EXPECT_EQ(plain.heights.at(0).gain, 1);
  EXPECT_EQ(plain.heights.at(0).base, 0);
  EXPECT_EQ(plain.heights.at(0).wrap_u, Wrap::Repeat);
}

TEST(Mtl, AMapOfDispThatIsNotThereIsSaidAndOneThatIsChangesTheHash) {
  const SourceMesh gone = read_mtl_text("disp gone.png\n");
  EXPECT_NE(all_warnings(gone).find("gone.png"), std::string::npos);
  EXPECT_NE(all_warnings(gone).find("the surface is not displaced"), std::string::npos);
  EXPECT_TRUE(gone.heights.empty());
  EXPECT_NE(read_mtl_text("disp halves.png\n").source_hash, read_mtl_text("disp mask_grey.png\n").source_hash);
}

TEST(Mtl, TheMapOfDispIsNotBumpAsWell) {
  const SourceMesh both = read_mtl_text("map_Bump halves.png\ndisp halves.png\n");
  EXPECT_FALSE(both.materials[0].normal_map);
  EXPECT_NE(all_warnings(both).find("bump is the map of disp"), std::string::npos);
  const SourceMesh apart = read_mtl_text("map_Bump mask_grey.png\ndisp halves.png\n");
  EXPECT_TRUE(apart.materials[0].normal_map);
  EXPECT_EQ(all_warnings(apart), "");
}

/// The normal of the plane z = a u + b v, in texels, everywhere but where the image is wrapped.
TEST(DerivedMaps, NormalsOfAPlaneAreThePlanes) {
  const float a = 0.05f, b = -0.03f, scale = 3;
  const Texture heights = image_of([&](int x, int y) {
    return vec4(vec3(0.2f + a * static_cast<float>(x) - b * static_cast<float>(y)), 1);  // rows go down
  });
  const Texture normals = normals_of_heights(heights, 0, scale, Wrap::Repeat);
  const vec3 wanted = glm::normalize(vec3(-scale * a, -scale * b, 1));
  for (int y = 1; y < 7; ++y) {
    for (int x = 1; x < 7; ++x) EXPECT_LT(glm::length(normal_at(normals, x, y) - wanted), 2e-4f) << x << " " << y;
  }
  // Clamped, the border has half the slope; repeated, it has the step back.
  EXPECT_NEAR(normal_at(normals_of_heights(heights, 0, scale, Wrap::Clamp), 0, 4).x,
              glm::normalize(vec3(-scale * a / 2, -scale * b, 1)).x, 2e-4);
  EXPECT_GT(normal_at(normals, 0, 4).x, 0);
}

TEST(DerivedMaps, LightBlueIsANormalMapAndGreyIsNone) {
  EXPECT_TRUE(looks_like_normals(image_of([](int, int) { return vec4(0.5f, 0.5f, 1, 1); })));
  EXPECT_FALSE(looks_like_normals(image_of([](int, int) { return vec4(0.8f, 0.8f, 0.8f, 1); })));
  EXPECT_FALSE(looks_like_normals(image_of([](int, int) { return vec4(0, 0, 1, 1); })));
}

TEST(Mtl, MasksComeFromTheChannelThatIsNamed) {
  const SourceMesh mesh = read_mtl_text("map_d -imfchan b halves.png\n");
  ASSERT_TRUE(mesh.materials[0].alpha_map);
  const Texture& mask = *mesh.materials[0].alpha_map.image;
  EXPECT_EQ(mask.texel(mask.level(0), 0, 0).w, 0);
  EXPECT_EQ(mask.texel(mask.level(0), mask.width() - 1, 0).w, 1);
  EXPECT_EQ(all_warnings(mesh), "");
}

TEST(Mtl, OneImageCanHoldRoughnessAndMetal) {
  const SourceMesh mesh = read_mtl_text("map_Pr -imfchan r halves.png\nmap_Pm -imfchan b halves.png\n");
  ASSERT_TRUE(mesh.materials[0].metallic_roughness_map);
  const Texture& image = *mesh.materials[0].metallic_roughness_map.image;
  EXPECT_EQ(vec3(image.texel(image.level(0), 0, 0)), vec3(1, 1, 0));
  EXPECT_EQ(vec3(image.texel(image.level(0), image.width() - 1, 0)), vec3(1, 0, 1));
  EXPECT_NE(all_warnings(read_mtl_text("map_Kd -imfchan b halves.png\n")).find("map_Kd -imfchan (line 2)"),
            std::string::npos);
}

TEST(Mtl, DissolveIsAShareOfTheLight) {
  const SourceMesh mesh = read_mtl_text("Kd 1 1 1\nd 0.25\n");
  EXPECT_EQ(mesh.materials[0].alpha_mode, AlphaMode::Blend);
  EXPECT_EQ(mesh.materials[0].alpha, 0.25f);
  EXPECT_EQ(all_warnings(mesh), "");
}

}  // namespace
}  // namespace farfield
