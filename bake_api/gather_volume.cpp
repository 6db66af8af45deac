// SPDX-License-Identifier: Apache-2.0
#include "bake_api/gather_volume.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/hash.h"
#include "import/read_volume.h"
#include "import/resample_volume.h"
#include "import/voxel_shape.h"

namespace farfield {
namespace {

constexpr uint64_t kInputVersion = 1;        ///< goes up when the same input comes to mean something else
constexpr uint32_t kLongestSide = 1u << 23;  ///< voxels: 2^20 bricks, the most that a level has along a side

class VolumeGatherer {
 public:
  VolumeGatherer(const BakeVolume& volume, const BakeFog& fog, const Job& job)
      : given_(volume), fog_(fog), job_(job), dims_(volume.width, volume.height, volume.depth) {}

  Result<SourceVolume> run() {
    FARFIELD_TRY(check_sizes());
    FARFIELD_TRY(place());
    FARFIELD_TRY(find_bounds());
    if (job_.is_cancelled()) return cancelled();
    copy_voxels();
    if (job_.is_cancelled()) return cancelled();
    set_light();
    out_.source_hash = hash();
    if (shape_.is_cube()) return std::move(out_);
    auto cubes = resample_to_cubes(out_, shape_, job_);
    if (!cubes && cubes.error().code == ErrorCode::Unsupported) return error("{}", cubes.error().message);
    if (cubes) cubes->warnings.push_back(fmt::format("volume {}: {}", given_.name, resampling_text(shape_)));
    return cubes;
  }

 private:
  template <typename... Args>
  tl::unexpected<Error> error(fmt::format_string<Args...> text, Args&&... args) const {
    return make_error(ErrorCode::InvalidArgument,
                      fmt::format("volume {}: {}", given_.name, fmt::format(text, std::forward<Args>(args)...)));
  }
  tl::unexpected<Error> cancelled() const { return make_error(ErrorCode::Cancelled, "bake: cancelled"); }

  Result<void> check_sizes() const {
    FARFIELD_TRY(check_options(fog_options(fog_)));
    if (!fog_.density_grid.empty() || fog_.level_set)
      return error("density_grid and level_set choose from a file; this one is in memory");
    for (const uint32_t side : {dims_.x, dims_.y, dims_.z}) {
      if (side == 0 || side > kLongestSide)
        return error("{} x {} x {} voxels; sides are from 1 to {}", dims_.x, dims_.y, dims_.z, kLongestSide);
    }
    // Sides of 23 bits: their product may need 69.
    const uint64_t layer = uint64_t{dims_.x} * dims_.y;
    if (given_.density.size() % layer != 0 || given_.density.size() / layer != dims_.z) {
      return error("{} densities for {} x {} x {} voxels", given_.density.size(), dims_.x, dims_.y, dims_.z);
    }
    if (!given_.albedo.empty() && given_.albedo.size() != given_.density.size())
      return error("{} albedos for {} densities", given_.albedo.size(), given_.density.size());
    return {};
  }

  Result<void> place() {
    const glm::dmat4x3& m = given_.to_asset;
    shape_ = voxel_shape({m[0], m[1], m[2]});
    const bool is_placed = std::isfinite(m[3].x) && std::isfinite(m[3].y) && std::isfinite(m[3].z);
    if (shape_.is_singular || !is_placed) return error("to_asset is singular or not finite");
    out_.voxel_size = shape_.size;
    out_.rotation = shape_.rotation;
    return {};
  }

  /// visit(index, voxel) for each, while it returns true.
  template <typename Visit>
  void for_each_voxel(const uvec3& lower, const uvec3& upper, const Visit& visit) const {
    for (uint32_t z = lower.z; z < upper.z; ++z) {
      if (job_.is_cancelled()) return;
      for (uint32_t y = lower.y; y < upper.y; ++y) {
        size_t index = (size_t{z} * dims_.y + y) * dims_.x + lower.x;
        for (uint32_t x = lower.x; x < upper.x; ++x, ++index)
          if (!visit(index, uvec3(x, y, z))) return;
      }
    }
  }

  /// As it will be kept; 0 where that is too thin for a float.
  float density_at(size_t index) const { return static_cast<float>(given_.density.at(index) * fog_.density_scale); }

  /// The box of voxels that have a density, once every number is known to be one.
  Result<void> find_bounds() {
    Result<void> found;
    lower_ = dims_, upper_ = uvec3(0);
    for_each_voxel(uvec3(0), dims_, [&](size_t index, const uvec3& voxel) {
      found = check_voxel(index, voxel);
      if (!(density_at(index) > 0)) return found.has_value();
      lower_ = glm::min(lower_, voxel);
      upper_ = glm::max(upper_, voxel + 1u);
      ++out_.active_voxels;
      return found.has_value();
    });
    FARFIELD_TRY(std::move(found));
    if (job_.is_cancelled()) return cancelled();
    if (out_.active_voxels == 0) return error("no voxel has a density: there is nothing to see");
    if (out_.active_voxels <= kMostVolumeVoxels) return {};
    return make_error(ErrorCode::Unsupported, fmt::format("volume {}: more than {} million voxels; bake it in parts",
                                                          given_.name, kMostVolumeVoxels / 1000000));
  }

  Result<void> check_voxel(size_t index, const uvec3& voxel) const {
    const double density = given_.density.at(index);
    if (!(density >= 0) || !(density * fog_.density_scale <= kDensestVolume))
      return error("the density of voxel ({}, {}, {}) is {}", voxel.x, voxel.y, voxel.z, density);
    if (given_.albedo.empty()) return {};
    for (int c = 0; c < 3; ++c) {
      const double albedo = given_.albedo.at(index, c);
      if (!(albedo >= 0 && albedo <= 1))
        return error("the albedo of voxel ({}, {}, {}) has {}, not from 0 to 1", voxel.x, voxel.y, voxel.z, albedo);
    }
    return {};
  }

  bool has_albedos() const { return !given_.albedo.empty() && !fog_.albedo; }

  void copy_voxels() {
    out_.origin = glm::dmat3(given_.to_asset) * dvec3(lower_) + given_.to_asset[3];
    out_.dims = ivec3(upper_ - lower_);
    out_.brick_dims = (out_.dims + (kVolumeBrickSide - 1)) / kVolumeBrickSide;
    out_.brick_table.assign(out_.table_index(out_.brick_dims - 1) + 1, kEmptyBrick);
    for_each_voxel(lower_, upper_, [&](size_t index, const uvec3& at) {
      const float density = density_at(index);
      if (!(density > 0)) return true;
      const ivec3 voxel(at - lower_);
      const uint32_t brick = brick_of(voxel);
      out_.bricks[brick][index_in_brick(voxel)] = density;
      out_.densest = std::max(out_.densest, density);
      if (!has_albedos()) return true;
      for (int c = 0; c < 3; ++c) {
        out_.albedos[brick][index_in_brick(voxel)][static_cast<size_t>(c)] =
            static_cast<uint16_t>(std::lround(65535 * given_.albedo.at(index, c)));
      }
      return true;
    });
  }

  uint32_t brick_of(const ivec3& voxel) {
    uint32_t& brick = out_.brick_table[out_.table_index(voxel / kVolumeBrickSide)];
    if (brick != kEmptyBrick) return brick;
    brick = static_cast<uint32_t>(out_.bricks.size());
    out_.bricks.emplace_back().fill(0);
    if (has_albedos()) out_.albedos.emplace_back();
    ++out_.filled_bricks;
    return brick;
  }

  void set_light() {
    out_.anisotropy = static_cast<float>(fog_.anisotropy);
    if (fog_.albedo) out_.albedo = *fog_.albedo;
    if (fog_.albedo && !given_.albedo.empty())
      out_.warnings.push_back(fmt::format("volume {}: the albedo of the settings is taken for its own", given_.name));
    if (fog_.albedo || has_albedos()) return;
    out_.albedo = vec3(kDefaultAlbedo);
    out_.warnings.push_back(fmt::format("volume {}: it says no albedo: {} is taken", given_.name, kDefaultAlbedo));
  }

  /// Where it lies is in it too, as the manifest says it.
  uint64_t hash() const {
    uint64_t hash = mix64(kInputVersion, out_.bricks.size());
    hash = hash_values<double>({&given_.to_asset[0][0], 12}, hash);
    hash = hash_values<uint32_t>({&lower_.x, 3}, hash);
    hash = hash_values<int>({&out_.dims.x, 3}, hash);
    hash = hash_values<uint32_t>(out_.brick_table, hash);
    hash = hash_values<DensityBrick>(out_.bricks, hash);
    hash = hash_values<AlbedoBrick>(out_.albedos, hash);
    hash = hash_values<float>({&out_.albedo.x, 3}, hash);
    return hash_values<float>({&out_.anisotropy, 1}, hash);
  }

  const BakeVolume& given_;
  const BakeFog& fog_;
  const Job& job_;
  const uvec3 dims_;
  VoxelShape shape_;
  uvec3 lower_{0}, upper_{0};  ///< of what has a density
  SourceVolume out_;
};

}  // namespace

FogOptions fog_options(const BakeFog& fog) {
  return {fog.density_grid, fog.density_scale, fog.albedo, fog.anisotropy, fog.level_set};
}

Result<SourceVolume> gather_volume(const BakeVolume& volume, const BakeFog& fog, const Job& job) {
  return VolumeGatherer(volume, fog, job).run();
}

}  // namespace farfield
