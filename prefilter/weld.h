// SPDX-License-Identifier: Apache-2.0
// Joins vertices that share a position: formats split them for normals and UVs, the bake needs them connected.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/index.h"
#include "base/job.h"
#include "base/vec.h"

namespace farfield {

struct WeldResult {
  std::vector<uint32_t> vertex_of;  ///< for each input vertex its output vertex; kNoIndex where no face uses it
  std::vector<vec3> positions;      ///< of the output vertices, in order of first use
  size_t near_welds = 0;            ///< how many were joined although their positions differ
};

/// Joins vertices with equal positions (-0 equals 0), then those closer than 1e-6 of the bounds' longest side and also
/// closer than 1 % of the shortest edge at either of them, so that fine detail in a large mesh never collapses.
/// Vertices that no face uses are dropped. Face i has the corners face_begin[i] .. face_begin[i + 1] - 1. Positions
/// must be finite. Once the job is cancelled it returns at once, with a result of no use.
WeldResult weld(std::span<const vec3> positions, std::span<const uint32_t> face_begin,
                std::span<const uint32_t> corner_vertex, const Job& job = {});

}  // namespace farfield
