// SPDX-License-Identifier: Apache-2.0
// Whether polygons close, for tests of what cuts them.
#pragma once

#include <map>
#include <utility>

#include "import/source_mesh.h"

namespace farfield::test {

/// Calls visit(a, b) with the positions' numbers for each edge of each face.
template <typename Visit>
void for_each_edge(const SourceMesh& mesh, const Visit& visit) {
  for (size_t face = 0; face < mesh.face_count(); ++face) {
    const uint32_t begin = mesh.face_begin[face], end = mesh.face_begin[face + 1];
    for (uint32_t i = begin; i < end; ++i) {
      visit(mesh.corner_position[i], mesh.corner_position[i + 1 == end ? begin : i + 1]);
    }
  }
}

/// Edges that do not have one face on either side, these winding alike.
inline size_t open_edges(const SourceMesh& mesh) {
  std::map<std::pair<uint32_t, uint32_t>, int> uses;
  for_each_edge(mesh, [&](uint32_t a, uint32_t b) { ++uses[{a, b}]; });
  size_t bad = 0;
  for (const auto& [edge, count] : uses) {
    const auto other = uses.find({edge.second, edge.first});
    bad += count != 1 || other == uses.end() || other->second != 1;
  }
  return bad;
}

}  // namespace farfield::test
