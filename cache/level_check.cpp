// SPDX-License-Identifier: Apache-2.0
#include "cache/level_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

#include "cache/level_format.h"
#include "cache/placed_parts.h"
#include "scattering/fog_phase.h"
#include "scattering/highlight_lean.h"
#include "scattering/hot_spot.h"
#include "scattering/open_side.h"

namespace farfield {

namespace {

using Problem = std::optional<std::string>;

constexpr uint64_t kMaxElements = 0xfffffff0u;  // indices have 32 bits, and the last few values have other meanings
constexpr int kMaxBrickDim = 1 << 20;           // voxel coordinates stay far inside an int

/// What only one of the media has is 0 in the other.
Problem check_medium(const LevelView& level) {
  const LevelHeader& header = level.header;
  if (header.medium != Medium::Flakes && header.medium != Medium::Fog)
    return fmt::format("the medium is number {}", static_cast<uint32_t>(header.medium));
  if (header.medium == Medium::Flakes) {
    const bool is_plain = header.fog_albedo == vec3(0.0f) && header.fog_anisotropy == 0 && level.voxel_albedo.empty() &&
                          level.voxel_anisotropy.empty();
    return is_plain ? Problem() : "it has properties of fog, and no fog";
  }
  const vec3& albedo = header.fog_albedo;
  if (!is_finite(albedo) || min_component(albedo) < 0 || max_component(albedo) > 1)
    return fmt::format("the fog's albedo is ({}, {}, {})", albedo.x, albedo.y, albedo.z);
  if (!(std::abs(header.fog_anisotropy) <= kMostFogAnisotropy))
    return fmt::format("the fog's anisotropy is {}", header.fog_anisotropy);
  const bool has_flakes = !level.voxel_diffuse.empty() || !level.voxel_specular.empty() ||
                          !level.voxel_transmission.empty() || !level.voxel_emission.empty();
  return has_flakes ? Problem("its fog has properties of flakes") : Problem();
}

Problem check_header(const LevelView& level) {
  const LevelHeader& header = level.header;
  if (!std::isfinite(header.resolution) || !(header.resolution > 0)) {
    return fmt::format("the resolution is {}", header.resolution);
  }
  if (!is_finite(header.bounds.lower) || !is_finite(header.bounds.upper) || header.bounds.is_empty()) {
    return "the bounds are empty or not finite";
  }
  if (!is_finite(header.volume_origin)) return "the volume's origin is not finite";
  if (!(header.hot_spot >= 0 && header.hot_spot <= kStrongestHotSpot))
    return fmt::format("the hot spot's strength is {}", header.hot_spot);
  if (!(glm::length(header.open_side) <= kMostOpenSide * 1.001f))
    return fmt::format("the open side is ({}, {}, {})", header.open_side.x, header.open_side.y, header.open_side.z);
  if (!(std::abs(header.highlight_lean) <= kMostHighlightLean))
    return fmt::format("the highlight leans by {}", header.highlight_lean);
  if (Problem problem = check_medium(level)) return problem;
  if (!level.has_surface() && !level.has_volume()) return "it has neither surface nor volume";
  return {};
}

/// The arrays of one group are absent or as long as the group.
Problem check_lengths(const LevelView& level, SectionGroup group, const char* name, uint64_t length) {
  Problem problem;
  for_each_grouped_section(level, [&](SectionId id, SectionGroup of, const auto& array) {
    if (problem || of != group || array.empty() || array.size() == length) return;
    problem = fmt::format("{} has {} elements for {} {}", section_name(id), array.size(), length, name);
  });
  return problem;
}

Problem first_of(std::initializer_list<Problem> problems) {
  for (const Problem& problem : problems) {
    if (problem) return problem;
  }
  return {};
}

/// First index i with values[i] >= limit that is not one of the `specials` largest 32-bit values.
Problem check_indices(const char* name, std::span<const uint32_t> values, uint64_t limit, uint32_t specials) {
  const auto bad = [&](uint32_t value) { return value >= limit && value <= 0xffffffffu - specials; };
  const auto found = std::ranges::find_if(values, bad);
  if (found == values.end()) return {};
  return fmt::format("{}[{}] is {}, and there are {}", name, found - values.begin(), *found, limit);
}

// ---- surface ----

Problem check_quads(const LevelView& level) {
  if (level.positions.size() > kMaxElements || level.quads.size() > kMaxElements / 2) return "it has too many quads";
  const auto vertex_count = static_cast<uint32_t>(level.positions.size());
  const auto bad = [&](const Quad& quad) {
    return std::max(std::max(quad.v0, quad.v1), std::max(quad.v2, quad.v3)) >= vertex_count;
  };
  const auto found = std::ranges::find_if(level.quads, bad);
  if (found == level.quads.end()) return {};
  return fmt::format("quads[{}] = ({}, {}, {}, {}), and there are {} vertices", found - level.quads.begin(), found->v0,
                     found->v1, found->v2, found->v3, vertex_count);
}

/// Faces are numbered along the quads, without gaps.
Problem check_face_numbers(const LevelView& level) {
  if (level.quad_first_face.size() != level.quads.size()) {
    return fmt::format("quad_first_face has {} elements for {} quads", level.quad_first_face.size(),
                       level.quads.size());
  }
  uint32_t face = 0;
  for (size_t i = 0; i < level.quads.size(); ++i) {
    if (level.quad_first_face[i] != face) {
      return fmt::format("quad_first_face[{}] is {}, expected {}", i, level.quad_first_face[i], face);
    }
    face += level.quads[i].is_pair() ? 2 : 1;
  }
  return {};
}

/// Shading vertices, and that faces refer to them.
Problem check_shading_vertices(const LevelView& level) {
  const uint64_t count = std::max({level.shading_normal.size(), level.shading_uv.size(), level.shading_color.size()});
  if (level.corner_vertex.empty() != (count == 0)) return "corner_vertex and shading vertices do not go together";
  if (count > kMaxElements) return "it has too many shading vertices";
  const auto bad = [&](const uvec3& corners) { return std::max({corners.x, corners.y, corners.z}) >= count; };
  const auto found = std::ranges::find_if(level.corner_vertex, bad);
  if (found != level.corner_vertex.end()) {
    return fmt::format("corner_vertex[{}] = ({}, {}, {}), and there are {} shading vertices",
                       found - level.corner_vertex.begin(), found->x, found->y, found->z, count);
  }
  return check_lengths(level, SectionGroup::ShadingVertices, "shading vertices", count);
}

/// Places are where rays can go, and there are no more than can be looked at one by one.
Problem check_placements(const LevelView& level) {
  constexpr uint64_t kMostPlacedQuads = uint64_t{1} << 28;
  uint64_t placed = 0;
  for (size_t i = 0; i < level.placements.size(); ++i) {
    const PartPlacement& placement = level.placements[i];
    if (placement.part >= level.part_first_quad.size()) {
      return fmt::format("placements[{}] is of part {}, and there are {}", i, placement.part,
                         level.part_first_quad.size());
    }
    if (!can_be_undone(placement.level_to_part)) return fmt::format("placements[{}] has no inverse", i);
    const auto [first, end] = level.part_quads(placement.part);
    placed += end - first;
    if (placed > kMostPlacedQuads) return "its parts have too many quads in all places";
  }
  return {};
}

Problem check_parts(const LevelView& level) {
  if (level.part_first_quad.empty() != level.placements.empty()) {
    return "part_first_quad and placements do not go together";
  }
  for (size_t part = 0; part < level.part_first_quad.size(); ++part) {
    const uint32_t first = level.part_first_quad[part];
    const bool is_after_last = part == 0 || first > level.part_first_quad[part - 1];
    if (!is_after_last || first >= level.quads.size()) {
      return fmt::format("part_first_quad[{}] is {} of {} quads, and parts are not empty", part, first,
                         level.quads.size());
    }
  }
  const bool is_source = level.face_sggx.empty() && level.face_gap.empty();
  if (level.has_parts() && !is_source) return "it has parts, and faces that are not those of a source";
  return check_placements(level);
}

Problem check_surface(const LevelView& level) {
  if (Problem problem = check_quads(level)) return problem;
  if (Problem problem = check_face_numbers(level)) return problem;
  if (level.face_specular.size() != level.face_roughness2.size()) {
    return "face_specular and face_roughness2 do not go together";
  }
  if (!level.face_sheet_shape.empty() && level.face_gap.empty()) return "face_sheet_shape needs face_gap";
  if (Problem problem = check_shading_vertices(level)) return problem;
  if (Problem problem = check_parts(level)) return problem;
  return check_lengths(level, SectionGroup::Faces, "faces", face_count(level));
}

// ---- volume ----

/// The dimensions are what the table says, and 0 without a volume.
Problem check_brick_dims(const LevelView& level) {
  const ivec3 dims = level.header.brick_dims;
  const bool has_volume = level.has_volume();
  uint64_t cells = 1;
  for (int axis = 0; axis < 3; ++axis) {
    if (dims[axis] < 0 || dims[axis] > kMaxBrickDim || (dims[axis] > 0) != has_volume) {
      return fmt::format("brick_dims are {} x {} x {} with {} bricks", dims.x, dims.y, dims.z, level.bricks.size());
    }
    cells *= static_cast<uint64_t>(dims[axis]);  // at most 2^60
  }
  if (cells == level.brick_table.size()) return {};
  return fmt::format("brick_table has {} elements for {} x {} x {} bricks", level.brick_table.size(), dims.x, dims.y,
                     dims.z);
}

/// Each brick is in the table once, in the table's order.
Problem check_brick_table(const LevelView& level) {
  uint32_t next = 0;
  for (size_t i = 0; i < level.brick_table.size(); ++i) {
    const uint32_t entry = level.brick_table[i];
    if (entry == kNoBrick) continue;
    if (entry != next || entry >= level.bricks.size()) {
      return fmt::format("brick_table[{}] is {}, expected {} of {} bricks", i, entry, next, level.bricks.size());
    }
    ++next;
  }
  if (next == level.bricks.size()) return {};
  return fmt::format("brick_table names {} of {} bricks", next, level.bricks.size());
}

/// Bit i: byte i of `bytes` is not 0, for eight bytes.
uint64_t nonzero_bytes(const uint8_t* bytes) {
  uint64_t x;
  std::memcpy(&x, bytes, sizeof x);
  constexpr uint64_t kLow7 = 0x7f7f7f7f7f7f7f7full;
  const uint64_t high_bits = (((x & kLow7) + kLow7) | x) & ~kLow7;  // bit 8i+7: byte i is not 0
  return ((high_bits >> 7) * 0x0102040810204080ull) >> 56;          // the product moves bit 8i to bit 56+i
}

uint64_t mask_word(const Brick& brick, size_t word) {
  uint64_t mask = 0;
  for (size_t i = 0; i < 8; ++i) mask |= nonzero_bytes(&brick.density[word * 64 + i * 8]) << (8 * i);
  return mask;
}

/// Mask and prefix sums are those of the densities, so that payload_index() stays below the brick's voxel count.
Problem check_brick(const Brick& brick, size_t index, uint64_t payload_base) {
  if (!std::isfinite(brick.density_scale) || !(brick.density_scale > 0)) {
    return fmt::format("bricks[{}] has density scale {}", index, brick.density_scale);
  }
  if (brick.payload_base != payload_base) {
    return fmt::format("bricks[{}] has payload base {}, expected {}", index, brick.payload_base, payload_base);
  }
  uint32_t voxels = 0;
  for (size_t word = 0; word < 8; ++word) {
    if (brick.mask[word] != mask_word(brick, word)) return fmt::format("bricks[{}]: mask and densities differ", index);
    if (brick.prefix[word] != voxels) {
      return fmt::format("bricks[{}] has prefix sum {}, expected {}", index, brick.prefix[word], voxels);
    }
    voxels += static_cast<uint32_t>(std::popcount(brick.mask[word]));
  }
  return {};
}

Problem check_bricks(const LevelView& level) {
  uint64_t payload_base = 0;
  for (size_t i = 0; i < level.bricks.size(); ++i) {
    const Brick& brick = level.bricks[i];
    if (Problem problem = check_brick(brick, i, payload_base)) return problem;
    payload_base += brick.prefix[7] + static_cast<uint64_t>(std::popcount(brick.mask[7]));
    if (payload_base > kMaxElements) return "it has too many voxels";
  }
  return {};
}

Problem check_volume(const LevelView& level) {
  if (Problem problem = check_brick_dims(level)) return problem;
  if (Problem problem = check_brick_table(level)) return problem;
  if (Problem problem = check_bricks(level)) return problem;
  if (level.voxel_specular.size() != level.voxel_roughness2.size()) {
    return "voxel_specular and voxel_roughness2 do not go together";
  }
  return check_lengths(level, SectionGroup::Voxels, "voxels", voxel_count(level));
}

// ---- values ----

bool contains(const Box3& box, const vec3& p) {  // false for NaN
  return p.x >= box.lower.x && p.y >= box.lower.y && p.z >= box.lower.z && p.x <= box.upper.x && p.y <= box.upper.y &&
         p.z <= box.upper.z;
}

/// Those of parts are in spaces of their own: what rays can trace is all that is asked of them.
Problem check_positions(const LevelView& level) {
  std::vector<bool> is_of_part(level.has_parts() ? level.positions.size() : 0);
  for (size_t i = level.own_quad_count(); i < level.quads.size(); ++i) {
    const Quad& quad = level.quads[i];
    for (const uint32_t v : {quad.v0, quad.v1, quad.v2, quad.v3}) is_of_part[v] = true;
  }
  const Box3 anywhere{vec3(-kEmbreeLargest), vec3(kEmbreeLargest)};
  const auto outside = [&](const vec3& p) {
    const bool is_placed = level.has_parts() && is_of_part[static_cast<size_t>(&p - level.positions.data())];
    return !contains(is_placed ? anywhere : level.header.bounds, p);
  };
  const auto found = std::ranges::find_if(level.positions, outside);
  if (found == level.positions.end()) return {};
  return fmt::format("positions[{}] = ({}, {}, {}) is not inside the bounds", found - level.positions.begin(), found->x,
                     found->y, found->z);
}

/// Bounds are tight around rounded sums (origin + voxel * resolution), so allow the rounding of those.
Problem check_voxels_inside(const LevelView& level) {
  const LevelHeader& header = level.header;
  const vec3 magnitude = glm::max(glm::abs(header.bounds.lower), glm::abs(header.bounds.upper));
  const vec3 slack = 1e-3f * header.resolution + 1e-6f * magnitude;
  const Box3 allowed{header.bounds.lower - slack, header.bounds.upper + slack};
  for (size_t i = 0; i < level.brick_table.size(); ++i) {
    if (level.brick_table[i] == kNoBrick) continue;
    const Box3 active = active_box(level.bricks[level.brick_table[i]]);
    if (active.is_empty()) continue;
    const vec3 corner(brick_coordinates(header, i) * kBrickSide);
    const vec3 lower = header.volume_origin + (corner + active.lower) * header.resolution;
    const vec3 upper = header.volume_origin + (corner + active.upper) * header.resolution;
    if (!contains(allowed, lower) || !contains(allowed, upper)) {
      return fmt::format("bricks[{}] has voxels outside the bounds", level.brick_table[i]);
    }
  }
  return {};
}

Problem check_reserved_bytes(const LevelView& level) {
  for (size_t i = 0; i < level.bricks.size(); ++i) {
    if (std::ranges::any_of(level.bricks[i].reserved, [](uint8_t byte) { return byte != 0; })) {
      return fmt::format("bricks[{}]: reserved bytes are not 0", i);
    }
  }
  return {};
}

Problem check_anisotropy(const LevelView& level) {
  const auto broken = [](int8_t g) { return std::abs(unpack_anisotropy(g)) > kMostFogAnisotropy; };
  const auto found = std::ranges::find_if(level.voxel_anisotropy, broken);
  if (found == level.voxel_anisotropy.end()) return {};
  return fmt::format("voxel_anisotropy[{}] is {}", found - level.voxel_anisotropy.begin(), *found);
}

Problem check_self_shadowing(const LevelView& level) {
  const auto found = std::ranges::find(level.voxel_self_shadowing, uint8_t{0});
  if (found == level.voxel_self_shadowing.end()) return {};
  return fmt::format("voxel_self_shadowing[{}] is 0", found - level.voxel_self_shadowing.begin());
}

}  // namespace

Problem find_structure_problem(const LevelView& level) {
  if (Problem problem = check_header(level)) return problem;
  if (Problem problem = check_surface(level)) return problem;
  if (Problem problem = check_volume(level)) return problem;
  return first_of({check_indices("morph_vertex", level.morph_vertex, level.positions.size(), 1),
                   check_indices("morph_face", level.morph_face, face_count(level), 2)});
}

Problem find_value_problem(const LevelView& level) {
  if (Problem problem = check_positions(level)) return problem;
  if (Problem problem = check_voxels_inside(level)) return problem;
  return first_of({check_reserved_bytes(level), check_self_shadowing(level), check_anisotropy(level)});
}

}  // namespace farfield
