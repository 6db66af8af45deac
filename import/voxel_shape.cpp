// SPDX-License-Identifier: Apache-2.0
#include "import/voxel_shape.h"

#include <fmt/format.h>

#include <cmath>

namespace farfield {

VoxelShape voxel_shape(const std::array<dvec3, 3>& edges) {
  constexpr double kTolerance = 1e-4;  // of edges' lengths, and of the cosines between them
  VoxelShape out;
  std::array<double, 3> lengths;
  for (size_t a = 0; a < 3; ++a) {
    lengths[a] = glm::length(edges[a]);
    if (!std::isfinite(lengths[a]) || !(lengths[a] > 0)) out.is_singular = true;
  }
  if (out.is_singular) return out;
  const bool is_exact = lengths[0] == lengths[1] && lengths[0] == lengths[2];  // cbrt(0.125) is a little less than 0.5
  out.size = is_exact ? lengths[0] : std::cbrt(lengths[0] * lengths[1] * lengths[2]);
  for (size_t a = 0; a < 3; ++a) {
    const size_t b = (a + 1) % 3;
    const bool is_edge_of_cube = std::abs(lengths[a] - out.size) <= kTolerance * out.size;
    const bool is_upright = std::abs(glm::dot(edges[a], edges[b])) <= kTolerance * lengths[a] * lengths[b];
    if (is_edge_of_cube && is_upright) continue;
    out.other_shape = fmt::format("{} x {} x {}{}", lengths[0], lengths[1], lengths[2], is_upright ? "" : ", sheared");
    return out;
  }
  const dvec3 x = edges[0] / lengths[0];
  const dvec3 y = glm::normalize(edges[1] - glm::dot(edges[1], x) * x);
  const double side = glm::dot(glm::cross(x, y), edges[2]) < 0 ? -1.0 : 1.0;
  out.rotation = glm::dmat3(x, y, side * glm::cross(x, y));
  return out;
}

}  // namespace farfield
