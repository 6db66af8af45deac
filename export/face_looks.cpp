// SPDX-License-Identifier: Apache-2.0
#include "export/face_looks.h"

#include <algorithm>
#include <cmath>

#include "cache/level_values.h"

namespace farfield {
namespace {

/// alpha^2 of the GGX lobe that spreads as the facets around the face's normals do: their share along the face against
/// that across it. Of a flat face its own roughness2.
float seen_roughness2(const SymMat3& normals, float roughness2, const vec3& area_vector) {
  const float length = glm::length(area_vector);
  if (!(length > 0) || !(normals.trace() > 0)) return roughness2;
  const SymMat3 facets = specular_sggx(normals, roughness2);
  const float across = facets.quadratic(area_vector / length);
  return across > 0 ? std::clamp(0.5f * (facets.trace() - across) / across, 0.0f, 1.0f) : 1.0f;
}

}  // namespace

std::vector<uvec3> face_corners(const LevelView& level) {
  std::vector<uvec3> corners;
  corners.reserve(face_count(level));
  for (const Quad& quad : level.quads) {
    corners.push_back(quad.face(0));
    if (quad.is_pair()) corners.push_back(quad.face(1));
  }
  return corners;
}

std::vector<FaceLook> face_looks(const LevelView& level, const std::vector<uvec3>& corners) {
  std::vector<FaceLook> looks(corners.size());
  for (uint32_t f = 0; f < looks.size(); ++f) {
    const vec3& a = level.positions[corners[f].x];
    const vec3 area_vector =
        0.5f * glm::cross(level.positions[corners[f].y] - a, level.positions[corners[f].z] - a);
    const SurfaceParams params = face_params(level, f);
    FaceLook& look = looks[f];
    look.diffuse = params.diffuse;
    look.specular = params.specular;
    look.transmission = params.transmission;
    look.emission = emission_at(level.face_emission, f);
    const float roughness2 = level.face_sggx.empty()
                                 ? params.roughness2
                                 : seen_roughness2(unpack(level.face_sggx[f]), params.roughness2, area_vector);
    look.roughness = std::sqrt(std::sqrt(roughness2));
    const float gap = level.face_gap.empty() ? 0.0f : unpack_unorm8(level.face_gap[f]);
    look.opacity = unorm_at(level.face_opacity, f) * (1 - gap);
    look.area = double{glm::length(area_vector)};
  }
  return looks;
}

}  // namespace farfield
