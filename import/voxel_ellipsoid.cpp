// SPDX-License-Identifier: Apache-2.0
#include "import/voxel_ellipsoid.h"

#include <algorithm>
#include <cmath>

#include "import/source_volume.h"

namespace farfield {

constexpr double kRounding = 1e-3;  ///< of entries of S that no ellipsoid has, before it is said

bool mend_ellipsoid(glm::dmat3& s) {
  const double unit = kRounding * (s[0][0] + s[1][1] + s[2][2]);
  bool is_off = false;
  for (int i = 0; i < 3; ++i) {
    is_off = is_off || s[i][i] < -unit;
    s[i][i] = std::max(s[i][i], 0.0);
  }
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3;
    const double most = std::sqrt(s[i][i] * s[j][j]);
    is_off = is_off || std::abs(s[i][j]) > most + unit;
    s[i][j] = s[j][i] = std::clamp(s[i][j], -most, most);
  }
  return is_off;
}

glm::dmat3 fibre_ellipsoid(const dvec3& direction, double roughness) {
  const dvec3 d = direction / glm::length(direction);
  return glm::dmat3(1.0) - (1 - roughness * roughness) * glm::outerProduct(d, d);
}

void put_ellipsoid(const glm::dmat3& s, std::array<float, 6>& shape, float& density) {
  const double trace = s[0][0] + s[1][1] + s[2][2];
  const std::array<double, 6> entries = {s[0][0], s[1][1], s[2][2], s[0][1], s[0][2], s[1][2]};
  for (size_t i = 0; i < 6; ++i) shape[i] = static_cast<float>(entries[i] / trace);
  density = static_cast<float>(std::min(static_cast<double>(density) * std::sqrt(trace), kDensestVolume));
}

}  // namespace farfield
