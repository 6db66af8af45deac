// SPDX-License-Identifier: Apache-2.0
#include "import/scene_tiles.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <set>
#include <string>
#include <vector>

#include "base/text.h"

namespace farfield {
namespace {

constexpr uint64_t kMostInstances = 4;  // of what is cut: each takes as many as there are tiles
constexpr float kFlat = 0.25f;          // of the second widest side: how high it may be
constexpr float kWide = 8;              // times the median of what stands in the scene
constexpr uint64_t kMostTiles = 4096;   // of a mesh; of more triangles tiles are larger

/// The longest side of an instance in the world, its bounds taken along its own axes.
float longest_side(const GltfScene& scene, const GltfInstance& instance) {
  const Box3& bounds = scene.meshes[instance.mesh].bounds;
  if (bounds.is_empty()) return 0;
  float longest = 0;
  for (int axis = 0; axis < 3; ++axis)
    longest = std::max(longest, bounds.size()[axis] * glm::length(instance.to_world[axis]));
  return longest;
}

bool is_flat(const Box3& bounds) {
  const vec3 size = bounds.size();
  std::array<float, 3> sides = {size.x, size.y, size.z};
  std::ranges::sort(sides);
  return sides[0] <= kFlat * sides[1];
}

/// As many as make tiles of up to so many triangles: a power of two, so that all have as many.
uint32_t tile_count(const GltfMesh& mesh, uint64_t tile_triangles) {
  const uint64_t tiles = mesh.triangle_count / tile_triangles + (mesh.triangle_count % tile_triangles > 0);
  if (tiles <= 2) return 1;
  return static_cast<uint32_t>(std::bit_ceil(std::min(tiles, kMostTiles)));
}

/// Per mesh: how many tiles it is cut into; 1: none.
std::vector<uint32_t> tile_counts(const GltfScene& scene, uint64_t tile_triangles) {
  std::vector<uint64_t> shown(scene.meshes.size(), 0);
  std::vector<float> widest(scene.meshes.size(), 0.0f), sides;
  for (const GltfInstance& instance : scene.instances) {
    sides.push_back(longest_side(scene, instance));
    ++shown[instance.mesh];
    widest[instance.mesh] = std::max(widest[instance.mesh], sides.back());
  }
  std::vector<uint32_t> counts(scene.meshes.size(), 1);
  if (sides.empty()) return counts;
  const auto median = sides.begin() + static_cast<std::ptrdiff_t>((sides.size() - 1) / 2);
  std::ranges::nth_element(sides, median);
  for (size_t m = 0; m < counts.size(); ++m) {
    const GltfMesh& mesh = scene.meshes[m];
    const bool is_ground = mesh.volume.empty() && shown[m] > 0 && shown[m] <= kMostInstances &&
                           widest[m] >= kWide * *median && !mesh.bounds.is_empty() && is_flat(mesh.bounds);
    if (is_ground) counts[m] = tile_count(mesh, tile_triangles);
  }
  return counts;
}

/// A name that no other asset has, also where upper and lower case are the same.
std::string unique_name(std::string name, std::set<std::string>& taken) {
  while (!taken.insert(lower_case(name)).second) name += "_";
  return name;
}

void add_tiles(GltfScene& scene, uint32_t mesh, uint32_t count, std::set<std::string>& taken) {
  for (uint32_t number = 0; number < count; ++number) {
    GltfMesh tile = scene.meshes[mesh];
    tile.tile = {number, count};
    tile.whole = mesh;
    tile.asset_name = unique_name(fmt::format("{}_tile_{}", tile.asset_name, number), taken);
    tile.triangle_count = std::max<uint64_t>(1, tile.triangle_count / count);
    scene.meshes.push_back(std::move(tile));
  }
}

}  // namespace

void cut_into_tiles(GltfScene& scene, uint64_t tile_triangles) {
  const std::vector<uint32_t> counts = tile_counts(scene, tile_triangles);
  if (std::ranges::all_of(counts, [](uint32_t count) { return count == 1; })) return;
  std::set<std::string> taken;
  for (const GltfMesh& mesh : scene.meshes) taken.insert(lower_case(mesh.asset_name));
  std::vector<uint32_t> first_tile(counts.size(), 0);
  for (uint32_t m = 0; m < counts.size(); ++m) {
    if (counts[m] == 1) continue;
    first_tile[m] = static_cast<uint32_t>(scene.meshes.size());
    add_tiles(scene, m, counts[m], taken);
    scene.warnings.push_back(
        fmt::format("mesh {}: wide, flat and of {} triangles: baked as {} tiles; --tile-triangles 0 keeps it whole",
                    scene.meshes[m].asset_name, scene.meshes[m].triangle_count, counts[m]));
  }
  std::vector<GltfInstance> instances;
  std::vector<mat4x3> in_node;
  for (size_t i = 0; i < scene.instances.size(); ++i) {
    const uint32_t mesh = scene.instances[i].mesh;
    for (uint32_t tile = 0; tile < counts[mesh]; ++tile) {
      instances.push_back(scene.instances[i]);
      if (counts[mesh] > 1) instances.back().mesh = first_tile[mesh] + tile;
      if (!scene.in_node.empty()) in_node.push_back(scene.in_node[i]);
    }
  }
  scene.instances = std::move(instances);
  scene.in_node = std::move(in_node);
}

}  // namespace farfield
