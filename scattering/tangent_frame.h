// SPDX-License-Identifier: Apache-2.0
// Where the axes of normal maps point: from a triangle's positions and texture coordinates, so that the bake and
// close-ups agree. Exporters' own tangents are averages of these over smooth vertices, and are not needed.
#pragma once

#include <array>
#include <cmath>

#include "base/vec.h"

namespace farfield {

/// The directions of u and -v (up in the image) on a triangle. Of texture coordinates without area, or not finite,
/// none: bend() then leaves normals as they are.
class TangentFrame {
 public:
  TangentFrame(const std::array<vec3, 3>& positions, const std::array<vec2, 3>& uv) {
    const dvec3 edge1(positions[1] - positions[0]), edge2(positions[2] - positions[0]);
    const glm::dvec2 uv1(uv[1] - uv[0]), uv2(uv[2] - uv[0]);
    const double determinant = uv1.x * uv2.y - uv1.y * uv2.x;
    if (!(std::abs(determinant) > 0) || !std::isfinite(determinant)) return;
    along_u_ = unit((edge1 * uv2.y - edge2 * uv1.y) * (determinant < 0 ? -1.0 : 1.0));
    up_ = unit((edge1 * uv2.x - edge2 * uv1.x) * (determinant < 0 ? -1.0 : 1.0));
  }

  /// `mapped`, a normal in the frame (along u, up, `normal`), in the space of positions; unit. normal: unit.
  vec3 bend(const vec3& normal, const vec3& mapped) const {
    if (mapped.x == 0 && mapped.y == 0) return normal;
    const vec3 along = along_u_ - normal * glm::dot(normal, along_u_);
    const float length = glm::length(along);
    if (!(length > 1e-6f)) return normal;
    const vec3 tangent = along / length;
    vec3 bitangent = glm::cross(normal, tangent);
    if (glm::dot(bitangent, up_) < 0) bitangent = -bitangent;
    const vec3 bent = tangent * mapped.x + bitangent * mapped.y + normal * mapped.z;
    const float bent_length = glm::length(bent);
    return bent_length > 1e-6f ? bent / bent_length : normal;
  }

 private:
  static vec3 unit(const dvec3& v) {
    const double length = glm::length(v);
    return length > 0 ? vec3(v / length) : vec3(0.0f);
  }

  vec3 along_u_{0.0f}, up_{0.0f};
};

}  // namespace farfield
