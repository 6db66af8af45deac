// SPDX-License-Identifier: Apache-2.0
// Whether a surface is a manifold at a vertex, from the edges opposite to it.
#pragma once

#include <cstdint>
#include <vector>

namespace farfield {

/// Of a triangle at a vertex: its two other corners.
struct LinkEdge {
  uint32_t a, b;
};

/// Whether the triangles around a vertex are one fan: their opposite edges make one ring (at a border: one line)
/// without a corner twice. Changes the order of the edges. Time grows with the square of their number.
bool is_one_fan(std::vector<LinkEdge>& link, bool is_border);

}  // namespace farfield
