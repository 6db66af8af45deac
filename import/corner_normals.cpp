// SPDX-License-Identifier: Apache-2.0
#include "import/corner_normals.h"

#include <cmath>
#include <unordered_map>

namespace farfield {
namespace {

/// Newell's: its length is twice the polygon's area, also where the polygon is not flat.
dvec3 area_normal(const SourceMesh& mesh, size_t face) {
  const uint32_t begin = mesh.face_begin[face], end = mesh.face_begin[face + 1];
  dvec3 sum(0.0);
  if (begin == end) return sum;
  const auto position = [&](uint32_t corner) { return mesh.positions[mesh.corner_position[corner]]; };
  const dvec3 origin = position(begin);  // far from the origin, products of coordinates lose what differs
  for (uint32_t i = begin + 1; i + 1 < end; ++i) sum += glm::cross(position(i) - origin, position(i + 1) - origin);
  return sum;
}

}  // namespace

vec3 unit_normal(const dvec3& normal) {
  const double length = glm::length(normal);
  return length > 0 && std::isfinite(length) ? vec3(normal / length) : vec3(0.0f);
}

void smooth_corner_normals(SourceMesh& mesh, std::span<const uint32_t> groups) {
  std::unordered_map<uint64_t, dvec3> sums;
  const auto key = [&](size_t face, uint32_t corner) {
    return uint64_t{groups[face]} << 32 | mesh.corner_position[corner];
  };
  const auto for_each_corner = [&](auto&& visit) {
    for (size_t face = 0; face < mesh.face_count(); ++face) {
      if (groups[face] == 0) continue;
      for (uint32_t i = mesh.face_begin[face]; i < mesh.face_begin[face + 1]; ++i) visit(face, i);
    }
  };
  size_t last_face = mesh.face_count();
  dvec3 normal(0.0);
  for_each_corner([&](size_t face, uint32_t corner) {
    if (face != last_face) normal = area_normal(mesh, face);
    last_face = face;
    if (std::isfinite(glm::length(normal))) sums[key(face, corner)] += normal;
  });
  if (sums.empty()) return;
  mesh.corner_normal.resize(mesh.corner_count(), vec3(0.0f));
  for_each_corner([&](size_t face, uint32_t corner) {
    if (mesh.corner_normal[corner] == vec3(0.0f)) mesh.corner_normal[corner] = unit_normal(sums[key(face, corner)]);
  });
}

}  // namespace farfield
