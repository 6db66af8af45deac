// SPDX-License-Identifier: Apache-2.0
#include "prefilter/source_surface.h"

#include <algorithm>
#include <cmath>

namespace farfield {

Box3 SourceSurface::bounds() const {
  Box3 box;
  for (const uvec3& triangle : triangles) {
    for (int k = 0; k < 3; ++k) box.extend(positions[triangle[k]]);
  }
  return box;
}

dvec3 SourceSurface::area_vector(size_t triangle) const {
  const uvec3& t = triangles[triangle];
  const dvec3 a(positions[t.x]), b(positions[t.y]), c(positions[t.z]);
  return glm::cross(b - a, c - a);
}

UvTriangle SourceSurface::uv_of(size_t triangle) const {
  if (corner_uv.empty()) return {vec2(NAN), vec2(NAN), vec2(NAN)};
  return {corner_uv[3 * triangle], corner_uv[3 * triangle + 1], corner_uv[3 * triangle + 2]};
}

vec4 SourceSurface::color_at(size_t triangle, const vec3& barycentric) const {
  if (corner_color.empty()) return vec4(1.0f);
  const vec4* corners = &corner_color[3 * triangle];
  return barycentric.x * corners[0] + barycentric.y * corners[1] + barycentric.z * corners[2];
}

vec3 SourceSurface::normal_at(size_t triangle, const vec3& barycentric) const {
  if (!corner_normal.empty()) {
    const vec3* corners = &corner_normal[3 * triangle];
    const vec3 normal = barycentric.x * corners[0] + barycentric.y * corners[1] + barycentric.z * corners[2];
    if (const float length = glm::length(normal); length > 1e-6f) return normal / length;
  }
  return vec3(glm::normalize(area_vector(triangle)));
}

bool SourceSurface::has_shading_normals() const {
  return !corner_normal.empty() || material_function ||
         std::ranges::any_of(materials, [](const SourceMaterial& m) { return bool(m.normal_map); });
}

}  // namespace farfield
