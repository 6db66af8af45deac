// SPDX-License-Identifier: Apache-2.0
#include "import/voxel_shape.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace farfield {
namespace {

constexpr double kTolerance = 1e-4;  ///< of edges' lengths, and of the cosines between them, of a cube
constexpr double kFlattest = 1e-6;   ///< volume by the product of the edges: less is a plane

}  // namespace

VoxelShape voxel_shape(const std::array<dvec3, 3>& edges) {
  VoxelShape out;
  std::array<double, 3> lengths;
  for (size_t a = 0; a < 3; ++a) {
    lengths[a] = glm::length(edges[a]);
    if (!std::isfinite(lengths[a]) || !(lengths[a] > 0)) out.is_singular = true;
  }
  if (out.is_singular) return out;
  const std::array<dvec3, 3> along = {edges[0] / lengths[0], edges[1] / lengths[1], edges[2] / lengths[2]};
  const double volume = glm::dot(glm::cross(along[0], along[1]), along[2]);
  out.is_singular = !(std::abs(volume) > kFlattest);
  if (out.is_singular) return out;
  const dvec3 y = glm::normalize(along[1] - glm::dot(along[1], along[0]) * along[0]);
  out.rotation = glm::dmat3(along[0], y, (volume < 0 ? -1.0 : 1.0) * glm::cross(along[0], y));
  for (int a = 0; a < 3; ++a)  // what is below the diagonal is 0 but for rounding
    for (int row = 0; row < 3; ++row)
      out.edges[a][row] = row > a ? 0.0 : glm::dot(out.rotation[row], edges[static_cast<size_t>(a)]);

  const bool is_exact = lengths[0] == lengths[1] && lengths[0] == lengths[2];  // cbrt(0.125) is a little less than 0.5
  out.size = is_exact ? lengths[0] : std::cbrt(lengths[0] * lengths[1] * lengths[2]);
  bool is_upright = true, is_even = true;
  for (size_t a = 0; a < 3; ++a) {
    is_even = is_even && std::abs(lengths[a] - out.size) <= kTolerance * out.size;
    is_upright = is_upright && std::abs(glm::dot(along[a], along[(a + 1) % 3])) <= kTolerance;
  }
  if (is_even && is_upright) return out;
  out.other_shape =
      fmt::format("{:.6g} x {:.6g} x {:.6g}{}", lengths[0], lengths[1], lengths[2], is_upright ? "" : ", sheared");
  out.size = *std::ranges::min_element(lengths);
  return out;
}

}  // namespace farfield
