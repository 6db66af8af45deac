// SPDX-License-Identifier: Apache-2.0
// Sources for tests of the bake, from surfaces of known materials.
#pragma once

#include <cmath>
#include <utility>

#include "prefilter/condition.h"
#include "prefilter/surface.h"

namespace farfield::test {

/// A source whose faces look as those of the surface do, by a material function.
inline SourceSurface source_of(const Surface& surface) {
  SourceSurface source;
  source.positions = surface.positions;
  source.triangles = surface.triangles;
  source.quad = surface.quad;
  source.origin = surface.origin;
  source.material.assign(surface.triangles.size(), 0);
  for (uint32_t f = 0; f < surface.triangles.size(); ++f) source.source_face.push_back(f);
  source.materials.resize(1);
  source.material_function = [materials = surface.materials](const MaterialQuery& query) {
    const FaceMaterial& m = materials[query.face];
    MaterialSample sample;
    sample.diffuse = m.diffuse;
    sample.specular = m.specular;
    sample.transmission = m.transmission;
    sample.roughness = std::sqrt(std::sqrt(m.roughness2));
    sample.opacity = m.opacity;
    sample.emission = m.emission;
    return sample;
  };
  return source;
}

/// The square [0, 1]^2 in the plane z = 0 as a reader gives it: one polygon, texture coordinates (x, y), white.
inline SourceMesh square_mesh() {
  SourceMesh mesh;
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  mesh.corner_position = {0, 1, 2, 3};
  mesh.face_begin = {0, 4};
  mesh.corner_uv = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  mesh.face_material = {0};
  mesh.materials.resize(1);
  mesh.materials[0].base_color = vec3(1.0f);
  return mesh;
}

inline ImportedAsset asset_of(const Surface& surface, uint64_t source_hash = 0) {
  ImportedAsset asset;
  asset.source = source_of(surface);
  asset.source_hash = source_hash;
  return asset;
}

}  // namespace farfield::test
