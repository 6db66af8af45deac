// SPDX-License-Identifier: Apache-2.0
#include "bake_api/gather_materials.h"

#include <gtest/gtest.h>

#include <cmath>

#include <limits>

#include "tests/support/files.h"
#include "tests/support/png_files.h"

namespace farfield {
namespace {

BakeInput with(const BakeMaterial& material) {
  BakeInput input;
  input.materials = {material};
  return input;
}

std::string error_of_material(const BakeMaterial& material, ErrorCode code = ErrorCode::InvalidArgument) {
  const auto gathered = gather_materials(with(material), 1);
  if (gathered) return "";
  EXPECT_EQ(gathered.error().code, code);
  return gathered.error().message;
}

TEST(GatherMaterials, FillsUpToTheIdsThatFacesCarry) {
  BakeMaterial red;
  red.base_color = {1, 0, 0};
  const auto materials = gather_materials(with(red), 3).value().materials;
  ASSERT_EQ(materials.size(), 3u);
  EXPECT_EQ(materials[0].base_color, vec3(1, 0, 0));
  EXPECT_EQ(materials[2].base_color, vec3(0.8f));  // a face without any material
}

TEST(GatherMaterials, ABakesDefaultIsTheReadersDefault) {
  const SourceMaterial ours = gather_materials(with({}), 1).value().materials[0], theirs;
  EXPECT_EQ(ours.base_color, theirs.base_color);
  EXPECT_EQ(ours.dielectric_f0, theirs.dielectric_f0);
  EXPECT_EQ(ours.roughness, theirs.roughness);
  EXPECT_EQ(ours.metallic, theirs.metallic);
  EXPECT_EQ(ours.alpha_mode, theirs.alpha_mode);
  EXPECT_EQ(ours.alpha_cutoff, theirs.alpha_cutoff);
}

TEST(GatherMaterials, PixelsAndTheFileThatHoldsThemAreTheSameTexture) {
  const test::TemporaryFolder folder;
  // sRGB and linear agree at 0 and 255.
  const auto file = folder.write("checks.png", test::png(2, 1, {{255, 0, 0, 255}, {0, 255, 0, 0}}));
  const std::vector<vec4> pixels = {{1, 0, 0, 1}, {0, 1, 0, 0}};
  BakeMaterial material;
  material.alpha_mode = BakeMaterial::Alpha::Mask;
  BakeTexture in_memory, on_disk;
  on_disk.file = file;
  in_memory.pixels = pixels;
  in_memory.width = 2;
  in_memory.height = 1;
  for (auto field : {&BakeMaterial::base_color_texture, &BakeMaterial::alpha_texture, &BakeMaterial::normal_texture}) {
    BakeMaterial a = material, b = material;
    a.*field = in_memory;
    b.*field = on_disk;
    const auto of_memory = gather_materials(with(a), 1), of_disk = gather_materials(with(b), 1);
    ASSERT_TRUE(of_disk) << of_disk.error().message;
    for (auto map : {&SourceMaterial::base_color_map, &SourceMaterial::alpha_map, &SourceMaterial::normal_map}) {
      const SourceTexture &one = of_memory->materials[0].*map, &other = of_disk->materials[0].*map;
      ASSERT_EQ(static_cast<bool>(one), static_cast<bool>(other));
      if (!one) continue;
      for (int x = 0; x < 2; ++x)
        EXPECT_EQ(one.image->texel(one.image->level(0), x, 0), other.image->texel(other.image->level(0), x, 0));
    }
  }
}

TEST(GatherMaterials, AnOpaqueMaterialIgnoresItsImagesAlpha) {
  const std::vector<vec4> pixels = {{1, 0.5f, 0, 0}};
  BakeMaterial material;
  material.base_color_texture.pixels = pixels;
  material.base_color_texture.width = material.base_color_texture.height = 1;
  material.base_color_texture.wrap_v = BakeTexture::Wrap::Mirror;
  const SourceTexture map = gather_materials(with(material), 1).value().materials[0].base_color_map;
  EXPECT_NEAR(map.image->mean().y, 0.5f, 1e-4f);
  EXPECT_EQ(map.image->mean().w, 1.0f);
  EXPECT_EQ(map.wrap_u, Wrap::Repeat);
  EXPECT_EQ(map.wrap_v, Wrap::Mirror);
}

TEST(GatherMaterials, ReadsAFileOnce) {
  const test::TemporaryFolder folder;
  BakeMaterial material;
  material.base_color_texture.file = folder.write("dot.png", test::png(1, 1, {{9, 9, 9, 255}}));
  BakeInput input;
  input.materials = {material, material};
  const auto materials = gather_materials(input, 2).value().materials;
  EXPECT_EQ(materials[0].base_color_map.image, materials[1].base_color_map.image);
}

TEST(GatherMaterials, NamesTheMaterialAndTheFieldThatIsWrong) {
  BakeMaterial wrong;
  wrong.name = "bark";
  wrong.base_color.y = 1.5f;
  EXPECT_EQ(error_of_material(wrong), "material 0 (bark): base_color is (0.8, 1.5, 0.8), not in [0, 1]");
  wrong = {};
  wrong.roughness = std::numeric_limits<float>::quiet_NaN();
  EXPECT_EQ(error_of_material(wrong), "material 0: roughness is nan, not in [0, 1]");
  wrong = {};
  wrong.emission.x = -1;
  EXPECT_NE(error_of_material(wrong).find("emission is (-1, 0, 0)"), std::string::npos);
  wrong.emission.x = 1000;
  EXPECT_EQ(error_of_material(wrong), "");
  wrong.normal_scale = std::numeric_limits<float>::infinity();
  EXPECT_NE(error_of_material(wrong).find("normal_scale"), std::string::npos);
}

TEST(GatherMaterials, NamesTheTextureThatIsWrong) {
  BakeMaterial wrong;
  wrong.normal_texture.file = "/nowhere/bumps.png";
  const std::string missing = error_of_material(wrong, ErrorCode::NotFound);
  EXPECT_EQ(missing.rfind("material 0: normal_texture: ", 0), 0u) << missing;
  EXPECT_NE(missing.find("/nowhere/bumps.png"), std::string::npos) << missing;

  const std::vector<vec4> pixels = {{1, 1, 1, 1}, {0, 0, 2, 1}};
  wrong.normal_texture.pixels = pixels;
  EXPECT_NE(error_of_material(wrong).find("normal_texture has a file and pixels"), std::string::npos);
  wrong.normal_texture.file.clear();
  EXPECT_NE(error_of_material(wrong).find("normal_texture has 2 pixels for 0 x 0"), std::string::npos);
  wrong.normal_texture.width = 1;
  wrong.normal_texture.height = 2;
  EXPECT_NE(error_of_material(wrong).find("normal_texture: pixel (0, 1) is not in [0, 1]"), std::string::npos);
}

TEST(GatherMaterials, HeightsArePixelsOfAnySizeOrAFileAsStored) {
  const test::TemporaryFolder folder;
  const std::vector<vec4> pixels = {{-3, 0, 0, 1}, {20, 0, 0, 1}};
  BakeMaterial plain, in_memory, on_disk;
  in_memory.height_texture.pixels = pixels;
  in_memory.height_texture.width = 2;
  in_memory.height_texture.height = 1;
  in_memory.height_texture.wrap_u = BakeTexture::Wrap::Clamp;
  in_memory.height_gain = 0.5f;
  in_memory.height_base = -1;
  on_disk.height_texture.file = folder.write("grey.png", test::png(1, 1, {{51, 51, 51, 255}}));
  BakeInput input;
  input.materials = {plain, in_memory, on_disk};
  const auto gathered = gather_materials(input, 4).value();
  ASSERT_EQ(gathered.heights.size(), 4u);
  EXPECT_FALSE(gathered.heights[0]);
  EXPECT_EQ(gathered.heights[1].map->least(), -3);
  EXPECT_EQ(gathered.heights[1].map->most(), 20);
  EXPECT_EQ(gathered.heights[1].wrap_u, Wrap::Clamp);
  EXPECT_EQ(gathered.heights[1].gain, 0.5f);
  EXPECT_EQ(gathered.heights[1].base, -1);
  EXPECT_NEAR(gathered.heights[2].map->most(), 0.2f, 1e-6f) << "no sRGB";
  EXPECT_FALSE(gathered.heights[3]);
  EXPECT_TRUE(gather_materials(with(plain), 1).value().heights.empty());
}

TEST(GatherMaterials, HeightsThatAreWrongAreNamed) {
  const std::vector<vec4> pixels = {{0, 0, 0, 1}, {NAN, 0, 0, 1}};
  BakeMaterial wrong;
  wrong.name = "bark";
  wrong.height_texture.pixels = pixels;
  wrong.height_texture.width = 2;
  wrong.height_texture.height = 1;
  EXPECT_EQ(error_of_material(wrong), "material 0 (bark): height_texture: pixel (1, 0) is not finite");
  wrong.height_texture.width = 0;
  EXPECT_NE(error_of_material(wrong).find("height_texture has 2 pixels for 0 x 1"), std::string::npos);
  wrong.height_texture = {};
  wrong.height_texture.file = "/gone.exr";
  EXPECT_NE(error_of_material(wrong, ErrorCode::NotFound).find("height_texture: /gone.exr"), std::string::npos);
  wrong = {};
  wrong.height_gain = INFINITY;
  EXPECT_EQ(error_of_material(wrong), "material 0: height_gain is inf");
}

}  // namespace
}  // namespace farfield
