// SPDX-License-Identifier: Apache-2.0
// What levels of surfaces and flakes and levels of fog are packed with.
#pragma once

#include <algorithm>
#include <bit>
#include <vector>

#include "bake/pack_colors.h"
#include "base/free_memory.h"
#include "base/parallel.h"
#include "cache/level.h"

namespace farfield {

/// Arrays that are nothing but their default are not stored.
template <typename T, typename Allocator>
void drop_if_all(std::vector<T, Allocator>& values, const T& default_value) {
  if (std::ranges::all_of(values, [&](const T& v) { return v == default_value; })) free_memory(values);
}

/// pack(value) of each.
template <typename Packed, typename Source, typename Pack>
std::vector<Packed> pack_each(const std::vector<Source>& source, const Pack& pack) {
  std::vector<Packed> packed(source.size());
  parallel_for(source.size(), 4096, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) packed[i] = pack(source[i]);
  });
  return packed;
}

/// What flakes look like, of those channels that say anything. roughness2_of(voxel): alpha^2.
template <typename Voxel, typename Roughness2, typename Level>
void pack_looks(const std::vector<Voxel>& voxels, const Roughness2& roughness2_of, Level& level) {
  const auto set = [](auto& array, const auto& packed) { array.assign(packed.begin(), packed.end()); };
  set(level.voxel_diffuse, pack_colors(voxels, [](const Voxel& v) { return v.diffuse; }));
  set(level.voxel_specular, pack_colors(voxels, [](const Voxel& v) { return v.specular; }));
  set(level.voxel_transmission, pack_colors(voxels, [](const Voxel& v) { return v.transmission; }));
  set(level.voxel_octants, pack_each<PackedOctants>(voxels, [](const Voxel& v) { return v.octants; }));
  set(level.voxel_emission,
      pack_each<PackedRadiance>(voxels, [](const Voxel& v) { return pack_radiance(v.emission); }));
  drop_if_all(level.voxel_diffuse, PackedColor{});
  drop_if_all(level.voxel_specular, PackedColor{});
  drop_if_all(level.voxel_transmission, PackedColor{});
  drop_if_all(level.voxel_octants, kFullOctants);
  drop_if_all(level.voxel_emission, PackedRadiance{});
  if (level.voxel_specular.empty()) return;
  set(level.voxel_roughness2,
      pack_each<uint8_t>(voxels, [&](const Voxel& v) { return pack_unorm8(roughness2_of(v)); }));
}

/// Fills in the prefix sums of a brick's mask. Returns how many voxels it has.
inline uint32_t sum_up_mask(Brick& brick) {
  uint32_t count = 0;
  for (size_t word = 0; word < brick.mask.size(); ++word) {
    brick.prefix[word] = static_cast<uint16_t>(count);
    count += static_cast<uint32_t>(std::popcount(brick.mask[word]));
  }
  return count;
}

}  // namespace farfield
