// SPDX-License-Identifier: Apache-2.0
#include "bake/pack_level.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <tuple>
#include <type_traits>

#include "bake/pack_arrays.h"
#include "bake/pack_colors.h"
#include "base/check.h"
#include "base/index.h"
#include "base/parallel.h"
#include "prefilter/edge_table.h"

namespace farfield {
namespace {

// ---------------------------------------------------------------------------------------------------------------
// Pairing triangles into quads.

/// Two triangles, or one and kNoIndex, and which corner of each is not on the shared edge.
struct Pair {
  uint32_t face0 = 0, face1 = kNoIndex;
  uint32_t apex0 = 0, apex1 = 0;
};

/// The matching of triangles. First the halves of quads that are known; then the edges that are the longest of both
/// their triangles: that is how quads were split, and such pairs have the smallest bounds. Then what is left, starting
/// with triangles that have one choice.
class Pairing {
 public:
  explicit Pairing(const Surface& surface)
      : surface_(surface), edges_(build_edge_table(surface.triangles, surface.positions.size())) {
    is_free_.assign(surface.triangles.size(), true);
    length2_.resize(edges_.size());
    for (uint32_t e = 0; e < edges_.size(); ++e) {
      const vec3 d = surface.positions[edges_.larger_vertex[e]] - surface.positions[edges_.smaller_vertex[e]];
      length2_[e] = glm::dot(d, d);
    }
  }

  std::vector<Pair> run() {
    const auto count = static_cast<uint32_t>(surface_.triangles.size());
    join_halves();
    for (uint32_t f = 0; f < count; ++f) {
      if (!is_free_[f]) continue;
      const uint32_t corner = longest_edge(f);
      const uint32_t g = partner(f, corner);
      if (g != kNoIndex && edges_.face_edges[g][longest_edge(g)] == edges_.face_edges[f][corner]) join(f, corner, g);
    }
    std::vector<uint32_t> waiting;
    for (uint32_t f = 0; f < count; ++f) {
      if (is_free_[f] && choices(f) == 1) waiting.push_back(f);
    }
    for (uint32_t next = 0; next < count;) {
      uint32_t f = next;
      if (waiting.empty()) {
        ++next;
      } else {
        f = waiting.back();
        waiting.pop_back();
      }
      if (is_free_[f]) join_best(f, waiting);
    }
    return std::move(pairs_);
  }

 private:
  uint32_t edge_of(uint32_t face, uint32_t corner) const { return edges_.face_edges[face][static_cast<int>(corner)]; }
  uint32_t vertex_of(uint32_t face, uint32_t corner) const {
    return surface_.triangles[face][static_cast<int>(corner % 3)];
  }

  uint32_t longest_edge(uint32_t face) const {
    uint32_t longest = 0;
    for (uint32_t c = 1; c < 3; ++c) {
      if (length2_[edge_of(face, c)] > length2_[edge_of(face, longest)]) longest = c;
    }
    return longest;
  }

  /// The corner at which `edge` starts in `face`.
  uint32_t corner_of(uint32_t face, uint32_t edge) const {
    uint32_t c = 0;
    while (edge_of(face, c) != edge) ++c;
    return c;
  }

  /// A free triangle on the other side of the edge from `corner` to the next one, with the same winding and another
  /// apex; or kNoIndex.
  uint32_t partner(uint32_t face, uint32_t corner) const {
    const uint32_t edge = edge_of(face, corner);
    for (const uint32_t other : edges_.faces_of(edge)) {
      if (other == face || !is_free_[other]) continue;
      const uint32_t c = corner_of(other, edge);
      const bool same_winding = vertex_of(other, c) == vertex_of(face, corner + 1);
      if (same_winding && vertex_of(other, c + 2) != vertex_of(face, corner + 2)) return other;
    }
    return kNoIndex;
  }

  int choices(uint32_t face) const {
    int count = 0;
    for (uint32_t c = 0; c < 3; ++c) count += partner(face, c) != kNoIndex;
    return count;
  }

  /// Quads that are known already.
  void join_halves() {
    if (!surface_.has_quads()) return;
    for (uint32_t f = 0; f < surface_.quad.size(); ++f) {
      for (uint32_t c = 0; c < 3 && is_free_[f] && surface_.quad[f] != kNoIndex; ++c) {
        const uint32_t other = partner(f, c);
        if (other != kNoIndex && surface_.quad[other] == surface_.quad[f]) join(f, c, other);
      }
    }
  }

  void join(uint32_t face, uint32_t corner, uint32_t other) {
    is_free_[face] = is_free_[other] = false;
    pairs_.push_back({face, other, (corner + 2) % 3, (corner_of(other, edge_of(face, corner)) + 2) % 3});
  }

  /// Joins a triangle with the neighbour that has the fewest other choices, or leaves it alone; then those of the
  /// neighbours that are left with one choice wait for their turn.
  void join_best(uint32_t face, std::vector<uint32_t>& waiting) {
    uint32_t best = kNoIndex, best_corner = 0;
    int fewest = 4;
    for (uint32_t c = 0; c < 3; ++c) {
      const uint32_t other = partner(face, c);
      if (other == kNoIndex) continue;
      const int count = choices(other);
      const bool is_longer = length2_[edge_of(face, c)] > length2_[edge_of(face, best_corner)];
      if (count < fewest || (count == fewest && is_longer)) best = other, best_corner = c, fewest = count;
    }
    if (best == kNoIndex) {
      is_free_[face] = false;
      pairs_.push_back({face});
      return;
    }
    join(face, best_corner, best);
    for (const uint32_t joined : {face, best}) {
      for (uint32_t c = 0; c < 3; ++c) {
        const uint32_t neighbour = partner(joined, c);
        if (neighbour != kNoIndex && choices(neighbour) == 1) waiting.push_back(neighbour);
      }
    }
  }

  const Surface& surface_;
  const EdgeTable edges_;
  std::vector<float> length2_;  ///< per edge
  std::vector<bool> is_free_;   ///< per face
  std::vector<Pair> pairs_;
};

/// Spreads the lower 21 bits to every third bit.
uint64_t spread_bits(uint64_t x) {
  x &= 0x1fffff;
  x = (x | x << 32) & 0x001f00000000ffffull;
  x = (x | x << 16) & 0x001f0000ff0000ffull;
  x = (x | x << 8) & 0x100f00f00f00f00full;
  x = (x | x << 4) & 0x10c30c30c30c30c3ull;
  x = (x | x << 2) & 0x1249249249249249ull;
  return x;
}

/// Place of a point along a Morton curve through the box.
uint64_t morton_code(const vec3& point, const Box3& box) {
  const dvec3 size = glm::max(dvec3(box.size()), dvec3(1e-30));
  const dvec3 unit = glm::clamp((dvec3(point) - dvec3(box.lower)) / size, 0.0, 1.0);
  const glm::u64vec3 cell(unit * double(0x1fffff));
  return spread_bits(cell.x) | spread_bits(cell.y) << 1 | spread_bits(cell.z) << 2;
}

/// part: of a triangle.
template <typename Part>
void sort_along_curve(const Surface& surface, const Part& part, std::vector<Pair>& pairs) {
  std::vector<Box3> boxes;  // of parts
  for (uint32_t face = 0; face < surface.triangles.size(); ++face) {
    if (part(face) >= boxes.size()) boxes.resize(part(face) + 1);
    Box3& box = boxes[part(face)];
    for (int c = 0; c < 3; ++c) box.extend(surface.positions[surface.triangles[face][c]]);
  }
  std::vector<std::tuple<uint32_t, uint64_t, uint32_t>> keys(pairs.size());
  for (uint32_t i = 0; i < pairs.size(); ++i) {
    Box3 bounds;
    for (const uint32_t face : {pairs[i].face0, pairs[i].face1}) {
      if (face == kNoIndex) continue;
      for (int c = 0; c < 3; ++c) bounds.extend(surface.positions[surface.triangles[face][c]]);
    }
    const uint32_t of_part = part(pairs[i].face0);
    keys[i] = {of_part, morton_code(bounds.center(), boxes[of_part]), i};
  }
  std::sort(keys.begin(), keys.end());
  std::vector<Pair> sorted;
  sorted.reserve(pairs.size());
  for (const auto& key : keys) sorted.push_back(pairs[std::get<2>(key)]);
  pairs = std::move(sorted);
}

// ---------------------------------------------------------------------------------------------------------------
// Channels. A channel is packed, and left out when all of it is the default.

/// Largest difference between entries of two matrices.
float distance(const SymMat3& a, const SymMat3& b) {
  return std::max({std::abs(a.xx - b.xx), std::abs(a.yy - b.yy), std::abs(a.zz - b.zz), std::abs(a.xy - b.xy),
                   std::abs(a.xz - b.xz), std::abs(a.yz - b.yz)});
}

/// Whether all faces have the one normal that their triangle has. The tolerance is a spread of normals of half a degree
/// (alpha = 0.01), far below what roughness in images can tell.
bool has_flat_normals(const Surface& surface) {
  constexpr float kTolerance = 1e-4f;
  for (size_t i = 0; i < surface.triangles.size(); ++i) {
    const uvec3& t = surface.triangles[i];
    const dvec3 a(surface.positions[t.x]);
    const dvec3 normal = glm::cross(dvec3(surface.positions[t.y]) - a, dvec3(surface.positions[t.z]) - a);
    const double length = glm::length(normal);
    const SymMat3& s = surface.materials[i].seen_normals();
    if (!(length > 0) || !(s.trace() > 0)) continue;  // no area, nothing to see
    if (distance(SymMat3::outer(vec3(normal / length)), s * (1 / s.trace())) > kTolerance) return false;
  }
  return true;
}

/// 0 and 255 only where it is so: rays ask no further there.
uint8_t pack_opacity(float opacity) {
  if (!(opacity > 0)) return 0;
  return opacity >= 1 ? uint8_t{255} : std::clamp<uint8_t>(pack_unorm8(opacity), 1, 254);
}

void pack_surface(const Surface& surface, const SurfaceOrder& order, LevelData& level) {
  level.positions = surface.positions;
  level.quads = order.quads;
  uint32_t first = 0;
  for (const Quad& quad : order.quads) {
    level.quad_first_face.push_back(first);
    first += quad.is_pair() ? 2 : 1;
  }
  FARFIELD_CHECK(first == surface.triangles.size());
  const auto& materials = surface.materials;
  if (!has_flat_normals(surface)) {
    level.face_sggx =
        pack_each<PackedSurfaceSggx>(materials, [](const auto& m) { return pack_surface_sggx(m.seen_normals()); });
  }
  level.face_diffuse = pack_colors(materials, [](const auto& m) { return m.diffuse; });
  level.face_specular = pack_colors(materials, [](const auto& m) { return m.specular; });
  level.face_transmission = pack_colors(materials, [](const auto& m) { return m.transmission; });
  drop_if_all(level.face_diffuse, PackedColor{});
  drop_if_all(level.face_specular, PackedColor{});
  drop_if_all(level.face_transmission, PackedColor{});
  level.face_opacity = pack_each<uint8_t>(materials, [](const auto& m) { return pack_opacity(m.opacity); });
  level.face_emission = pack_each<PackedRadiance>(materials, [](const auto& m) { return pack_radiance(m.emission); });
  drop_if_all(level.face_opacity, uint8_t{255});
  drop_if_all(level.face_emission, PackedRadiance{});
  level.face_gap = pack_each<uint8_t>(materials, [](const auto& m) { return pack_unorm8(m.gap); });
  drop_if_all(level.face_gap, uint8_t{0});
  level.face_sheet_shape =
      pack_each<PackedSheetShape>(materials, [](const auto& m) { return pack_sheet_shape(m.sheet); });
  drop_if_all(level.face_sheet_shape, PackedSheetShape{});
  if (!level.face_specular.empty()) {
    level.face_roughness2 = pack_each<uint8_t>(materials, [](const auto& m) { return pack_unorm8(m.roughness2); });
  }
  level.header.bounds.extend(surface.bounds());
}

/// Densities of one brick as bytes. Steps are even, and none that is not 0 becomes 0.
Brick pack_brick(const SparseVolume& volume, const VoxelBrick& source) {
  Brick brick{};
  brick.mask = source.mask;
  brick.payload_base = static_cast<uint32_t>(source.first_voxel);
  const uint32_t count = sum_up_mask(brick);
  const Voxel* voxels = &volume.voxels[source.first_voxel];
  for (uint32_t i = 0; i < count; ++i) brick.density_scale = std::max(brick.density_scale, voxels[i].density);
  for (int i = 0; i < kBrickVoxels; ++i) {
    if (!is_set(source.mask, i)) continue;
    const float density = voxels[brick.payload_index(i) - brick.payload_base].density;
    const float step = std::round(255.0f * density / brick.density_scale);
    brick.density[static_cast<size_t>(i)] = static_cast<uint8_t>(std::clamp(step, 1.0f, 255.0f));
  }
  return brick;
}

/// The box of a brick's stored voxels, in the space of positions.
Box3 stored_bounds(const SparseVolume& volume, const VoxelBrick& brick) {
  Box3 box;
  for (int i = 0; i < kBrickVoxels; ++i) {
    if (!is_set(brick.mask, i)) continue;
    const dvec3 corner = dvec3(voxel_of_brick(brick.coordinate, i));
    box.extend(vec3(volume.lattice.origin + corner * volume.lattice.voxel_size));
    box.extend(vec3(volume.lattice.origin + (corner + 1.0) * volume.lattice.voxel_size));
  }
  return box;
}

}  // namespace

SurfaceOrder order_surface(const Surface& surface, std::span<const uint32_t> part) {
  std::vector<Pair> pairs = Pairing(surface).run();
  sort_along_curve(
      surface, [&](uint32_t face) { return part.empty() ? 0 : part[face]; }, pairs);

  SurfaceOrder order;
  order.quads.reserve(pairs.size());
  order.vertex_number.assign(surface.positions.size(), kNoIndex);
  order.face_number.resize(surface.triangles.size());
  uint32_t vertex_count = 0, face = 0;
  const auto number_of = [&](uint32_t vertex) {
    uint32_t& number = order.vertex_number[vertex];
    if (number == kNoIndex) number = vertex_count++;
    return number;
  };
  for (const Pair& pair : pairs) {
    const uvec3& t = surface.triangles[pair.face0];
    const auto corner = [&](uint32_t offset) { return t[static_cast<int>((pair.apex0 + offset) % 3)]; };
    Quad quad{};
    quad.v0 = number_of(corner(0));
    quad.v1 = number_of(corner(1));
    quad.v3 = number_of(corner(2));
    quad.v2 = quad.v3;
    order.face_number[pair.face0] = face++;
    if (pair.face1 != kNoIndex) {
      quad.v2 = number_of(surface.triangles[pair.face1][static_cast<int>(pair.apex1)]);
      order.face_number[pair.face1] = face++;
    }
    order.quads.push_back(quad);
  }
  return order;
}

Surface reorder(const Surface& surface, const SurfaceOrder& order) {
  Surface result;
  result.origin = surface.origin;
  result.positions.resize(static_cast<size_t>(
      std::count_if(order.vertex_number.begin(), order.vertex_number.end(), [](uint32_t n) { return n != kNoIndex; })));
  for (size_t v = 0; v < surface.positions.size(); ++v) {
    if (order.vertex_number[v] != kNoIndex) result.positions[order.vertex_number[v]] = surface.positions[v];
  }
  for (const Quad& quad : order.quads) {
    result.triangles.push_back(quad.face(0));
    if (quad.is_pair()) result.triangles.push_back(quad.face(1));
  }
  result.materials.resize(surface.materials.size());
  for (size_t f = 0; f < surface.materials.size(); ++f) result.materials[order.face_number[f]] = surface.materials[f];
  result.quad.resize(surface.quad.size());
  for (size_t f = 0; f < surface.quad.size(); ++f) result.quad[order.face_number[f]] = surface.quad[f];
  return result;
}

LevelData pack_volume(const SparseVolume& volume) {
  LevelData level;
  level.header.resolution = static_cast<float>(volume.lattice.voxel_size);
  if (volume.bricks.empty()) return level;
  FARFIELD_CHECK(volume.voxels.size() < kNoIndex);
  ivec3 lower = volume.bricks.front().coordinate, upper = lower;
  for (const VoxelBrick& brick : volume.bricks) {
    lower = glm::min(lower, brick.coordinate);
    upper = glm::max(upper, brick.coordinate);
    level.header.bounds.extend(stored_bounds(volume, brick));
  }
  const ivec3 dims = upper - lower + 1;
  level.header.brick_dims = dims;
  level.header.volume_origin = vec3(volume.lattice.origin + dvec3(lower * kBrickSide) * volume.lattice.voxel_size);

  level.brick_table.assign(static_cast<size_t>(dims.x) * static_cast<size_t>(dims.y) * static_cast<size_t>(dims.z),
                           kNoBrick);
  for (const VoxelBrick& brick : volume.bricks) {  // in the order of the table
    level.brick_table[brick_table_index(dims, brick.coordinate - lower)] = static_cast<uint32_t>(level.bricks.size());
    level.bricks.push_back(pack_brick(volume, brick));
  }
  level.header.hot_spot = volume.hot_spot;
  level.header.open_side = volume.open_side;
  level.header.highlight_lean = volume.highlight_lean;
  const auto& voxels = volume.voxels;
  level.voxel_sggx = pack_each<PackedFlakeSggx>(voxels, [](const auto& v) { return pack_flake_sggx(v.sggx); });
  level.voxel_self_shadowing =
      pack_each<uint8_t>(voxels, [](const auto& v) { return std::max<uint8_t>(pack_unorm8(v.self_shadowing), 1); });
  drop_if_all(level.voxel_sggx, pack_flake_sggx(SymMat3::identity()));
  drop_if_all(level.voxel_self_shadowing, uint8_t{255});
  pack_looks(
      voxels, [](const Voxel& v) { return v.roughness2; }, level);
  return level;
}

LevelData pack_level(uint32_t level, double resolution, const Surface& surface, const SurfaceOrder& order,
                     LevelData volume, MorphMaps morph) {
  LevelData data = std::move(volume);
  data.header.level = level;
  data.header.resolution = static_cast<float>(resolution);
  if (!surface.triangles.empty()) pack_surface(surface, order, data);
  data.morph_vertex = std::move(morph.vertex);
  data.morph_face = std::move(morph.face);
  return data;
}

}  // namespace farfield
