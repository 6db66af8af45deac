// SPDX-License-Identifier: Apache-2.0
#include "bake/pack_fog.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <vector>

#include "bake/pack_arrays.h"
#include "bake/pack_colors.h"
#include "base/parallel.h"
#include "cache/level_format.h"
#include "prefilter/fog_shape.h"
#include "scattering/highlight_lean.h"
#include "scattering/hot_spot.h"
#include "scattering/open_side.h"
#include "scattering/sggx.h"
#include "scattering/sggx_codec.h"

namespace farfield {
namespace {

constexpr uint32_t kWideLevel = 4;  ///< from which on a brick stands for more of the source than should be in memory

using FogVoxels = std::array<FogVoxel, kBrickVoxels>;

/// A brick with what its voxels have besides densities, in their order.
struct PackedFog {
  Brick brick{};
  std::vector<PackedAlbedo> albedo;
  std::vector<uint8_t> self_shadowing;
  std::vector<int8_t> anisotropy;
  std::vector<PackedFlakeSggx> shape;
  std::vector<FlakeLook> flakes;
};

/// Densities as bytes. Homogeneous bricks are exact.
void pack_densities(const FogVoxels& voxels, Brick& brick) {
  for (const FogVoxel& voxel : voxels) brick.density_scale = std::max(brick.density_scale, voxel.density);
  double owed = 0;  // in steps: what the voxels before lost by rounding
  for (size_t i = 0; i < voxels.size(); ++i) {
    if (!(voxels[i].density > 0)) continue;
    const double wanted = 255.0 * static_cast<double>(voxels[i].density) / static_cast<double>(brick.density_scale);
    const double step = std::clamp(std::round(wanted + owed), 0.0, 255.0);
    owed = std::clamp(owed + wanted - step, -0.5, 0.5);
    brick.density[i] = static_cast<uint8_t>(step);
    if (brick.density[i] != 0) brick.mask[i >> 6] |= uint64_t{1} << (i & 63);
  }
  sum_up_mask(brick);
}

PackedFog pack_brick(const FogVoxels& voxels, bool has_flakes) {
  PackedFog packed;
  pack_densities(voxels, packed.brick);
  for (size_t i = 0; i < voxels.size(); ++i) {
    if (packed.brick.density[i] == 0) continue;
    packed.albedo.push_back(pack_albedo(voxels[i].albedo));
    packed.self_shadowing.push_back(std::max<uint8_t>(pack_unorm8(voxels[i].self_shadowing), 1));
    packed.anisotropy.push_back(pack_anisotropy(voxels[i].anisotropy));
    packed.shape.push_back(pack_flake_sggx(voxels[i].shape));
    if (has_flakes) packed.flakes.push_back(voxels[i].flakes);
  }
  return packed;
}

template <typename T, typename Allocator>
void append(std::vector<T, Allocator>& all, const std::vector<T>& more) {
  all.insert(all.end(), more.begin(), more.end());
}

/// Which channels a level's voxels may have at all.
struct FogChannels {
  bool albedo = false, self_shadowing = false, shape = false, anisotropy = false;
};

/// What holds for all of a level's voxels.
void set_medium(const SourceVolume& source, LevelHeader& header) {
  if (!source.flakes) {
    header.medium = Medium::Fog;
    header.fog_albedo = source.albedo;
    header.fog_anisotropy = source.anisotropy;
    return;
  }
  const SourceFlakes& flakes = *source.flakes;
  header.medium = Medium::Flakes;
  header.hot_spot = std::clamp(flakes.hot_spot, 0.0f, kStrongestHotSpot);
  header.highlight_lean = std::clamp(flakes.highlight_lean, -kMostHighlightLean, kMostHighlightLean);
  const float length = glm::length(flakes.open_side);
  header.open_side = length > kMostOpenSide ? flakes.open_side * (kMostOpenSide / length) : flakes.open_side;
}

/// alpha^2, of GGX.
float roughness2_of(const FlakeLook& look) {
  const float alpha = look.roughness * look.roughness;
  return alpha * alpha;
}

void rest_arrays(const FogLevel& level) {
  for_each_section(level, [](SectionId, const auto& array) { rest(array); });
}

/// Makes a level from its bricks. voxels_of(brick, voxels): false where the brick is empty; called from many threads.
template <typename VoxelsOf>
Result<FogLevel> pack_bricks(const SourceVolume& source, const ivec3& dims, double voxel_size,
                             const FogChannels& channels, const Job& job, const VoxelsOf& voxels_of) {
  constexpr size_t kBatch = 4096;  // bricks that are in memory in full before they join the level
  FogLevel level;
  level.header.resolution = static_cast<float>(voxel_size);
  set_medium(source, level.header);
  level.header.brick_dims = (dims + (kBrickSide - 1)) / kBrickSide;
  const ivec3& n = level.header.brick_dims;
  const size_t entries = static_cast<size_t>(n.x) * static_cast<size_t>(n.y) * static_cast<size_t>(n.z);
  level.brick_table.assign(entries, kNoBrick);
  level.bricks.reserve(std::min<size_t>(entries, source.filled_bricks));
  std::vector<PackedFog> batch(std::min(kBatch, entries));
  std::vector<FlakeLook> looks;
  uint32_t payload_base = 0;
  for (size_t first = 0; first < entries; first += kBatch) {
    if (job.is_cancelled()) return make_error(ErrorCode::Cancelled, "bake: cancelled");
    if (is_much_in_memory()) rest_arrays(level);
    job.report(static_cast<double>(first) / static_cast<double>(entries), "");
    const size_t count = std::min(kBatch, entries - first);
    parallel_for(count, 8, [&](size_t begin, size_t end) {
      const auto voxels = std::make_unique<FogVoxels>();
      if (is_much_in_memory()) rest(source);
      for (size_t i = begin; i < end; ++i) {
        batch[i] = PackedFog();
        if (job.is_cancelled() || !voxels_of(brick_coordinates(level.header, first + i), *voxels)) continue;
        batch[i] = pack_brick(*voxels, source.flakes.has_value());
      }
    });
    for (size_t i = 0; i < count; ++i) {
      PackedFog& packed = batch[i];
      if (packed.albedo.empty()) continue;
      packed.brick.payload_base = payload_base;
      payload_base += static_cast<uint32_t>(packed.albedo.size());
      level.brick_table[first + i] = static_cast<uint32_t>(level.bricks.size());
      level.bricks.push_back(packed.brick);
      if (channels.albedo) append(level.voxel_albedo, packed.albedo);
      if (channels.self_shadowing) append(level.voxel_self_shadowing, packed.self_shadowing);
      if (channels.anisotropy) append(level.voxel_anisotropy, packed.anisotropy);
      if (channels.shape) append(level.voxel_sggx, packed.shape);
      append(looks, packed.flakes);
    }
  }
  if (job.is_cancelled()) return make_error(ErrorCode::Cancelled, "bake: cancelled");
  drop_if_all(level.voxel_albedo, pack_albedo(source.albedo));
  drop_if_all(level.voxel_self_shadowing, uint8_t{255});
  drop_if_all(level.voxel_anisotropy, pack_anisotropy(source.anisotropy));
  drop_if_all(level.voxel_sggx, pack_flake_sggx(SymMat3::identity()));
  if (source.flakes) pack_looks(looks, roughness2_of, level);
  for_each_brick(level, [&](const Brick& brick, const ivec3& coordinates) {
    const Box3 voxels = active_box(brick);
    const dvec3 corner = dvec3(coordinates * kBrickSide);
    level.header.bounds.extend(
        Box3{vec3((corner + dvec3(voxels.lower)) * voxel_size), vec3((corner + dvec3(voxels.upper)) * voxel_size)});
  });
  return level;
}

FlakeLook source_look(const SourceFlakes& flakes, uint32_t brick, size_t i) {
  const auto color = [&](const BigVector<ColorBrick>& colors) {
    return colors.empty() ? vec3(0.0f) : colors[brick][i];
  };
  FlakeLook look{color(flakes.diffuse), color(flakes.specular), color(flakes.transmission), color(flakes.emission)};
  look.roughness = flakes.roughness.empty() ? 1.0f : flakes.roughness[brick][i];
  if (!flakes.octants.empty() && mean_share(flakes.octants[brick][i]) > 0) look.octants = flakes.octants[brick][i];
  return look;
}

/// A voxel of level 0.
FogVoxel source_voxel(const SourceVolume& source, uint32_t brick, size_t i) {
  FogVoxel voxel;
  voxel.density = source.bricks[brick][i];
  voxel.albedo = source.albedos.empty() ? source.albedo : unpack_albedo(source.albedos[brick][i]);
  voxel.anisotropy = source.anisotropies.empty() ? source.anisotropy : source.anisotropies[brick][i];
  if (!source.self_shadowing.empty()) voxel.self_shadowing = source.self_shadowing[brick][i];
  if (!source.shapes.empty() && voxel.density > 0) {
    const NormalisedSggx s = normalise_sggx(source_shape(source, brick, i));
    voxel.density *= s.rho_factor;
    voxel.shape = s.sggx;
  }
  if (!source.flakes) return voxel;
  voxel.flakes = source_look(*source.flakes, brick, i);
  voxel.density /= mean_share(voxel.flakes.octants);
  return voxel;
}

}  // namespace

Result<FogLevel> pack_source_fog(const SourceVolume& source, const Job& job) {
  const bool is_fog = !source.flakes;
  const FogChannels channels{is_fog && !source.albedos.empty(), !source.self_shadowing.empty(), !source.shapes.empty(),
                             is_fog && !source.anisotropies.empty()};
  const auto voxels_of = [&](const ivec3& brick, FogVoxels& voxels) {
    const uint32_t index = source.brick_table[source.table_index(brick)];
    if (index == kEmptyBrick) return false;
    for (size_t i = 0; i < voxels.size(); ++i) voxels[i] = source_voxel(source, index, i);
    return true;
  };
  return pack_bricks(source, source.dims, source.voxel_size, channels, job, voxels_of);
}

Result<FogLevel> pack_fog(const SourceVolume& source, uint32_t level, Downsampling method, const Job& job) {
  const FogDownsampler downsampler(source, level, method);
  const bool is_fog = !source.flakes, has_anisotropies = !source.anisotropies.empty();
  const FogChannels channels{is_fog && (has_own_albedos(source) || has_anisotropies),
                             is_fog ? method != Downsampling::Linear : !source.self_shadowing.empty(),
                             method == Downsampling::Aniso || !source.shapes.empty(),
                             is_fog && (method == Downsampling::Matched || has_anisotropies)};
  DensityGrid matched;
  if (method == Downsampling::Matched) {
    FARFIELD_TRY_LET(matched, matched_densities(source, level, job.step("", 0, 0.5)));
  }
  const auto voxels_of = [&](const ivec3& brick, FogVoxels& voxels) {
    const ivec3 corner = brick * kBrickSide, inside = glm::min(downsampler.dims() - corner, ivec3(kBrickSide));
    const uint32_t densities = matched.brick_at(brick);
    // In parallel here, too: a root has few bricks.
    parallel_for(voxels.size(), 16, [&](size_t begin, size_t end) {
      if (level >= kWideLevel && is_much_in_memory()) rest(source);
      for (size_t i = begin; i < end; ++i) {
        const ivec3 voxel = voxel_in_brick(static_cast<int>(i));
        const bool is_inside = voxel.x < inside.x && voxel.y < inside.y && voxel.z < inside.z;
        if (!is_inside || job.is_cancelled())
          voxels[i] = FogVoxel();
        else if (method == Downsampling::Matched)
          voxels[i] = downsampler.voxel(corner + voxel, densities == kEmptyBrick ? 0.0f : matched.bricks[densities][i]);
        else
          voxels[i] = downsampler.voxel(corner + voxel);
      }
    });
    return std::ranges::any_of(voxels, [](const FogVoxel& voxel) { return voxel.density > 0; });
  };
  FARFIELD_TRY_LET(auto packed, pack_bricks(source, downsampler.dims(), source.voxel_size * (1 << level), channels,
                                            job.step("", 0.5, 1), voxels_of));
  packed.header.level = level;
  return packed;
}

}  // namespace farfield
