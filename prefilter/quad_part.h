// SPDX-License-Identifier: Apache-2.0
// A connected part of a surface, with the quads that its triangles are halves of.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "prefilter/quad_mesh.h"
#include "prefilter/surface_parts.h"

namespace farfield {

/// Per triangle the one with the same number, of Surface::quad; kNoIndex: there is none.
std::vector<uint32_t> find_other_halves(std::span<const uint32_t> quad);

/// One connected part, in its own numbering. Two triangles with the same number in Surface::quad are a quad if they
/// share an edge and wind alike.
struct QuadPart {
  std::vector<dvec3> positions;
  std::vector<PolygonCorners> polygons;
  std::vector<std::array<uint32_t, 2>> triangles;  ///< per polygon: the part's triangles that are its halves
  std::vector<FaceMaterial> materials;             ///< per triangle
};
QuadPart extract_quad_part(const Surface& surface, const SurfaceParts& parts, size_t part);

}  // namespace farfield
