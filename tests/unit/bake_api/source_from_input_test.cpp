// SPDX-License-Identifier: Apache-2.0
#include "bake_api/source_from_input.h"

#include <gtest/gtest.h>

#include <set>

namespace farfield {
namespace {

/// Everything that an input can say, owned.
struct Everything {
  std::vector<vec3> points = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  std::vector<int> corners = {0, 1, 2};
  std::vector<int> materials = {0};
  std::vector<vec2> uv = {{0, 0}, {1, 0}, {0, 1}};
  std::vector<vec3> normals = {{0, 0, 1}};
  std::vector<vec4> colors = {{1, 1, 1, 1}};
  std::vector<vec4> pixels = {{1, 0, 0, 1}};
  BakeMaterial material;
  std::string key;
  bool has_function = false;

  uint64_t hash() const {
    BakeInput input;
    BakeMesh& mesh = input.meshes.emplace_back();
    mesh.points = points;
    mesh.corners = corners;
    mesh.materials = materials;
    mesh.uv = {uv, BakePer::Corner};
    mesh.normals.values = {&normals[0].x, 3, 0};  // the same for all
    mesh.colors.values = {&colors[0].x, 3, 0};
    input.materials = {material, material};
    input.materials[0].base_color_texture.pixels = pixels;
    input.materials[0].base_color_texture.width = input.materials[0].base_color_texture.height = 1;
    input.material_key = key;
    if (has_function) input.material_function = [](const MaterialQuery&) { return MaterialSample{}; };
    const auto source = source_from_input(input);
    EXPECT_TRUE(source) << source.error().message;
    return source->source_hash;
  }
};

TEST(SourceFromInput, TheSameInputHasTheSameHash) { EXPECT_EQ(Everything().hash(), Everything().hash()); }

TEST(SourceFromInput, WhateverTheInputSaysIsInItsHash) {
  using Change = void (*)(Everything&);
  const Change changes[] = {
      [](Everything& e) { e.points[1].x = 2; },
      [](Everything& e) {
        e.corners = {0, 2, 1};
      },
      [](Everything& e) { e.materials[0] = 1; },
      [](Everything& e) { e.uv[2].y = 0.5f; },
      [](Everything& e) { e.normals[0].x = 1; },
      [](Everything& e) { e.colors[0].x = 0; },
      [](Everything& e) { e.pixels[0].y = 1; },
      [](Everything& e) { e.key = std::string("2"); },
      [](Everything& e) { e.has_function = true; },
      [](Everything& e) { e.material.name = std::string("m"); },
      [](Everything& e) { e.material.base_color.x = 0; },
      [](Everything& e) { e.material.alpha = 0.5f; },
      [](Everything& e) { e.material.alpha_mode = BakeMaterial::Alpha::Mask; },
      [](Everything& e) { e.material.alpha_mode = BakeMaterial::Alpha::Blend; },
      [](Everything& e) { e.material.alpha_cutoff = 0.25f; },
      [](Everything& e) { e.material.metallic = 1; },
      [](Everything& e) { e.material.roughness = 0.5f; },
      [](Everything& e) { e.material.specular_f0.x = 0.04f; },
      [](Everything& e) { e.material.diffuse_transmission = 0.5f; },
      [](Everything& e) { e.material.diffuse_transmission_color.x = 0.5f; },
      [](Everything& e) { e.material.thin_transmission = 0.5f; },
      [](Everything& e) { e.material.emission.x = 0.5f; },
      [](Everything& e) { e.material.normal_scale = 2; },
      [](Everything& e) { e.material.base_color_texture.wrap_u = BakeTexture::Wrap::Clamp; },
      [](Everything& e) { e.material.base_color_texture.wrap_v = BakeTexture::Wrap::Clamp; },
  };
  std::set<uint64_t> hashes = {Everything().hash()};
  for (const Change change : changes) {
    Everything changed;
    change(changed);
    EXPECT_TRUE(hashes.insert(changed.hash()).second) << "change " << hashes.size() - 1;
  }
}

TEST(SourceFromInput, HandsTheFunctionOn) {
  Everything everything;
  BakeInput input;
  input.meshes.resize(1);
  input.meshes[0].points = everything.points;
  input.meshes[0].corners = everything.corners;
  input.meshes[0].materials = {};
  input.material_function = [](const MaterialQuery& query) {
    MaterialSample sample;
    sample.roughness = static_cast<float>(query.face);
    return sample;
  };
  const SourceMesh mesh = source_from_input(input).value();
  MaterialQuery query;
  query.face = 7;
  EXPECT_EQ(mesh.material_function(query).roughness, 7.0f);
  EXPECT_EQ(mesh.materials.size(), 1u);
}

}  // namespace
}  // namespace farfield
