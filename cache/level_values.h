// SPDX-License-Identifier: Apache-2.0
// What a level says of a face or a voxel, in the asset's space: packed values unpacked, absent arrays' defaults in
// place.
#pragma once

#include <utility>

#include "cache/level.h"
#include "scattering/albedo.h"
#include "scattering/flake_phase.h"
#include "scattering/fog_phase.h"
#include "scattering/surface_bsdf.h"

namespace farfield {

inline vec3 color_at(ArrayView<PackedColor> colors, uint32_t i) {
  return colors.empty() ? vec3(0.0f) : unpack_color(colors[i]);
}

inline float unorm_at(ArrayView<uint8_t> values, uint32_t i) {
  return values.empty() ? 1.0f : unpack_unorm8(values[i]);
}

/// Radiance at an element of a level.
inline vec3 emission_at(ArrayView<PackedRadiance> radiances, uint32_t i) {
  return radiances.empty() ? vec3(0.0f) : unpack_radiance(radiances[i]);
}

/// What is known of a face as a whole, but for its normals.
inline SurfaceParams face_params(const LevelView& level, uint32_t face) {
  SurfaceParams params;
  params.diffuse = color_at(level.face_diffuse, face);
  params.specular = color_at(level.face_specular, face);
  params.transmission = color_at(level.face_transmission, face);
  params.roughness2 = unorm_at(level.face_roughness2, face);
  return params;
}

/// How the pieces lie that a face stands for.
inline SheetShape sheet_shape(const LevelView& level, uint32_t face) {
  return level.face_sheet_shape.empty() ? SheetShape{} : unpack_sheet_shape(level.face_sheet_shape[face]);
}

/// The share of a face that is gaps between the pieces it stands for; of a sheet, along its normal.
inline float gap_of(const LevelView& level, uint32_t face) {
  return level.face_gap.empty() ? 0.0f : unpack_unorm8(level.face_gap[face]);
}

/// The share of paths along `direction` that pass between these pieces. n: the face's unit normal; both in the asset's
/// space, `direction` of any length.
inline float gap_towards(const LevelView& level, uint32_t face, const vec3& n, const vec3& direction) {
  const float gap = gap_of(level, face);
  const SheetShape shape = sheet_shape(level, face);
  if (!shape.is_sheet() || level.face_sggx.empty()) return gap;
  return sheet_gap(shape, gap, sheet_areas(unpack(level.face_sggx[face]), n, direction));
}

/// Of a voxel of flakes, in the asset's space.
inline FlakeParams flake_params(const LevelView& level, uint32_t voxel) {
  FlakeParams params;
  params.sggx = level.voxel_sggx.empty() ? SymMat3::identity() : unpack(level.voxel_sggx[voxel]);
  params.diffuse = color_at(level.voxel_diffuse, voxel);
  params.specular = color_at(level.voxel_specular, voxel);
  params.transmission = color_at(level.voxel_transmission, voxel);
  params.roughness2 = unorm_at(level.voxel_roughness2, voxel);
  params.self_shadowing = unorm_at(level.voxel_self_shadowing, voxel);
  params.hot_spot = level.header.hot_spot;
  params.highlight_lean = level.header.highlight_lean;
  params.open_side = level.header.open_side;
  return params;
}

/// Of a voxel of fog, in the asset's space.
inline FogParams fog_params(const LevelView& level, uint32_t voxel) {
  FogParams params;
  params.albedo = level.voxel_albedo.empty() ? level.header.fog_albedo : unpack_albedo(level.voxel_albedo[voxel]);
  params.self_shadowing = unorm_at(level.voxel_self_shadowing, voxel);
  params.anisotropy = level.header.fog_anisotropy;
  if (!level.voxel_anisotropy.empty()) {  // of all that the voxel scatters, so nothing is left to tell apart
    params.anisotropy = unpack_anisotropy(level.voxel_anisotropy[voxel]);
    params.albedo = cluster_albedo(params.albedo, std::exchange(params.self_shadowing, 1.0f));
  }
  params.has_shape = !level.voxel_sggx.empty();
  if (params.has_shape) params.sggx = unpack(level.voxel_sggx[voxel]);
  return params;
}

}  // namespace farfield
