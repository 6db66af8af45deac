// SPDX-License-Identifier: Apache-2.0
// The parts of a level's surface (PartPlacement) in the level's own space.
#pragma once

#include <cstdint>
#include <vector>

#include "base/affine.h"
#include "base/vec.h"
#include "cache/level.h"

namespace farfield {

/// Whether a transform is finite and has an inverse that is, within what rays can be traced in.
bool can_be_undone(const mat4x3& transform);
/// From the part's space to the level's, of a transform that can_be_undone().
inline glm::dmat4x3 to_level(const PartPlacement& placement) {
  return inverse_of(glm::dmat4x3(placement.level_to_part));
}

/// The vertices of a part, each once.
std::vector<uint32_t> part_vertices(const LevelView& level, uint32_t part);

/// Calls visit(point) for the vertices of a level's surface where they stand. The level is checked.
template <typename Visit>
void for_each_surface_point(const LevelView& level, Visit&& visit) {
  if (!level.has_parts()) {
    for (const vec3& position : level.positions) visit(position);
    return;
  }
  for (const Quad& quad : level.quads.first(level.own_quad_count())) {
    for (const uint32_t v : {quad.v0, quad.v1, quad.v2, quad.v3}) visit(level.positions[v]);
  }
  std::vector<std::vector<uint32_t>> vertices;
  for (uint32_t part = 0; part < level.part_first_quad.size(); ++part) vertices.push_back(part_vertices(level, part));
  for (const PartPlacement& placement : level.placements) {
    const glm::dmat4x3 transform = to_level(placement);
    for (const uint32_t v : vertices[placement.part]) visit(vec3(transform * glm::dvec4(level.positions[v], 1.0)));
  }
}

/// The same level without parts: every placed quad stands in the level's own space, after those that did already, in
/// the order of the placements. The level is checked.
LevelData flattened(const LevelView& level);

}  // namespace farfield
