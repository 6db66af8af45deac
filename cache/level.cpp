// SPDX-License-Identifier: Apache-2.0
#include "cache/level.h"

#include <algorithm>
#include <cmath>

namespace farfield {

namespace {

/// [0, 1] to 0 .. 255, rounded. NaN gives 0.
uint8_t to_unorm8(float x) {
  if (!(x > 0.0f)) return 0;
  return static_cast<uint8_t>(std::lround(255.0f * std::min(x, 1.0f)));
}

}  // namespace

uint8_t pack_unorm8(float x) { return to_unorm8(x); }

PackedColor pack_color(const vec3& linear_rgb) {
  PackedColor packed;
  for (int i = 0; i < 3; ++i) packed.sqrt_rgb[static_cast<size_t>(i)] = to_unorm8(std::sqrt(linear_rgb[i]));
  return packed;
}

vec3 unpack_color(PackedColor color) {
  const vec3 root(unpack_unorm8(color.sqrt_rgb[0]), unpack_unorm8(color.sqrt_rgb[1]), unpack_unorm8(color.sqrt_rgb[2]));
  return root * root;
}

LevelView view_of(const LevelData& level) {
  LevelView view;
  view.header = level.header;
  view.positions = level.positions;
  view.quads = level.quads;
  view.quad_first_face = level.quad_first_face;
  view.face_sggx = level.face_sggx;
  view.face_diffuse = level.face_diffuse;
  view.face_specular = level.face_specular;
  view.face_roughness2 = level.face_roughness2;
  view.face_transmission = level.face_transmission;
  view.brick_table = level.brick_table;
  view.bricks = level.bricks;
  view.voxel_sggx = level.voxel_sggx;
  view.voxel_diffuse = level.voxel_diffuse;
  view.voxel_specular = level.voxel_specular;
  view.voxel_roughness2 = level.voxel_roughness2;
  view.voxel_transmission = level.voxel_transmission;
  view.voxel_self_shadowing = level.voxel_self_shadowing;
  view.morph_vertex = level.morph_vertex;
  view.morph_face = level.morph_face;
  return view;
}

}  // namespace farfield
