// SPDX-License-Identifier: Apache-2.0
// Symmetric 3x3 matrices: the S of SGGX distributions, everywhere in the project.
#pragma once

#include "base/vec.h"

namespace farfield {

/// A symmetric matrix by its six different entries.
struct SymMat3 {
  float xx = 0, yy = 0, zz = 0, xy = 0, xz = 0, yz = 0;

  static SymMat3 identity() { return {1, 1, 1, 0, 0, 0}; }
  /// v v^T: as an SGGX matrix, flat flakes (or a flat surface) with unit normal v.
  static SymMat3 outer(const vec3& v) { return {v.x * v.x, v.y * v.y, v.z * v.z, v.x * v.y, v.x * v.z, v.y * v.z}; }

  float trace() const { return xx + yy + zz; }
  /// S v.
  vec3 operator*(const vec3& v) const {
    return {xx * v.x + xy * v.y + xz * v.z, xy * v.x + yy * v.y + yz * v.z, xz * v.x + yz * v.y + zz * v.z};
  }
  /// v^T S v.
  float quadratic(const vec3& v) const { return glm::dot(v, *this * v); }
  mat3 to_mat3() const { return mat3(xx, xy, xz, xy, yy, yz, xz, yz, zz); }

  SymMat3& operator+=(const SymMat3& o) {
    xx += o.xx, yy += o.yy, zz += o.zz, xy += o.xy, xz += o.xz, yz += o.yz;
    return *this;
  }
  friend SymMat3 operator+(SymMat3 a, const SymMat3& b) { return a += b; }
  friend SymMat3 operator*(const SymMat3& s, float f) {
    return {s.xx * f, s.yy * f, s.zz * f, s.xy * f, s.xz * f, s.yz * f};
  }
  friend bool operator==(const SymMat3&, const SymMat3&) = default;
};

/// M S M^T for any M.
inline SymMat3 congruence(const mat3& m, const SymMat3& s) {
  const mat3 t = m * s.to_mat3() * glm::transpose(m);
  return {t[0][0], t[1][1], t[2][2], t[1][0], t[2][0], t[2][1]};
}

/// The matrix of the specular microfacets (or flakes) around a distribution of mean-surface normals S:
/// S + roughness2 (tr(S) I - S). For a flat surface S = n n^T this is exactly GGX with alpha^2 = roughness2;
/// S alone is the diffuse one, so a flat Lambertian face stays Lambertian. See docs/decisions/0002.
inline SymMat3 specular_sggx(const SymMat3& s, float roughness2) {
  return s * (1.0f - roughness2) + SymMat3::identity() * (roughness2 * s.trace());
}

}  // namespace farfield
