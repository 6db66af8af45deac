// SPDX-License-Identifier: Apache-2.0
// Four floats at once, by the vectors of GCC and Clang: what every ray does in every instance is worth it.
#pragma once

#include <cstring>

#include "base/vec.h"

namespace farfield {

using Float4 = float __attribute__((vector_size(16)));

inline Float4 load4(const float* from) {
  Float4 v;
  std::memcpy(&v, from, sizeof v);
  return v;
}
/// A point or a direction; the fourth lane is 0.
inline Float4 load_xyz(const vec3& v) { return Float4{v.x, v.y, v.z, 0.0f}; }
inline void store4(float* to, const Float4& v) { std::memcpy(to, &v, sizeof v); }
inline Float4 splat4(float x) { return Float4{x, x, x, x}; }

/// As std::min and std::max: where one of the two is NaN, the first.
inline Float4 min4(const Float4& a, const Float4& b) { return b < a ? b : a; }
inline Float4 max4(const Float4& a, const Float4& b) { return a < b ? b : a; }
inline Float4 abs4(const Float4& v) { return max4(v, -v); }

/// xyz of one, w of the other.
inline Float4 with_w_of(const Float4& xyz, const Float4& w) { return __builtin_shufflevector(xyz, w, 0, 1, 2, 7); }

/// The first three lanes by a matrix behind which four bytes can be read; the fourth lane is anything.
inline Float4 transform_vector(const mat4x3& m, const Float4& v) {
  return load4(&m[0].x) * v[0] + load4(&m[1].x) * v[1] + load4(&m[2].x) * v[2];
}
inline Float4 transform_point(const mat4x3& m, const Float4& p) { return transform_vector(m, p) + load4(&m[3].x); }

}  // namespace farfield
