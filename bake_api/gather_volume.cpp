// SPDX-License-Identifier: Apache-2.0
#include "bake_api/gather_volume.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/hash.h"
#include "import/read_volume.h"
#include "import/resample_volume.h"
#include "import/voxel_ellipsoid.h"
#include "import/voxel_shape.h"

namespace farfield {
namespace {

constexpr uint64_t kInputVersion = 2;              ///< goes up when the same input comes to mean something else
constexpr uint32_t kLongestSide = 1u << 23;        ///< voxels: 2^20 bricks, the most that a level has along a side
constexpr float kLeastSelfShadowing = 1.0f / 255;  ///< that levels can say

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
    FARFIELD_TRY(check_count("albedos", given_.albedo.size()));
    FARFIELD_TRY(check_count("SGGX matrices", given_.sggx.size()));
    FARFIELD_TRY(check_count("fibres", given_.fibre.size()));
    FARFIELD_TRY(check_count("anisotropies", given_.anisotropy.size()));
    FARFIELD_TRY(check_count("shares of self-shadowing", given_.self_shadowing.size()));
    if (!given_.sggx.empty() && !given_.fibre.empty()) return error("it has sggx and fibre; give one of them");
    if (!given_.self_shadowing.empty() && has_anisotropies())
      return error("it has self_shadowing and anisotropy, which is of all that a voxel scatters; give one of them");
    return {};
  }
  Result<void> check_count(const char* what, size_t count) const {
    if (count == 0 || count == given_.density.size()) return {};
    return error("{} {} for {} densities", count, what, given_.density.size());
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
    FARFIELD_TRY(check_numbers("albedo", given_.albedo, index, voxel, 0, 1));
    FARFIELD_TRY(check_numbers("anisotropy", given_.anisotropy, index, voxel, -kMostAnisotropy, kMostAnisotropy));
    FARFIELD_TRY(check_numbers("self_shadowing", given_.self_shadowing, index, voxel, 0, 1));
    FARFIELD_TRY(check_numbers("sggx", given_.sggx, index, voxel, -kDensestVolume, kDensestVolume));
    return check_numbers("fibre", given_.fibre, index, voxel, -kDensestVolume, kDensestVolume);
  }
  template <int N>
  Result<void> check_numbers(const char* what, const BakeRows<N>& rows, size_t index, const uvec3& voxel, double least,
                             double most) const {
    for (int c = 0; c < N && !rows.empty(); ++c) {
      const double value = rows.at(index, c);
      // As a float, so that a float of 0.98 is not above it.
      if (!(static_cast<float>(value) >= static_cast<float>(least) &&
            static_cast<float>(value) <= static_cast<float>(most)))
        return error("the {} of voxel ({}, {}, {}) has {}, not from {} to {}", what, voxel.x, voxel.y, voxel.z, value,
                     least, most);
    }
    return {};
  }

  bool has_albedos() const { return !given_.albedo.empty() && !fog_.albedo; }
  bool has_anisotropies() const { return !given_.anisotropy.empty() && fog_.anisotropy == 0; }
  bool has_shapes() const { return !given_.sggx.empty() || !given_.fibre.empty(); }

  void copy_voxels() {
    out_.origin = glm::dmat3(given_.to_asset) * dvec3(lower_) + given_.to_asset[3];
    out_.dims = ivec3(upper_ - lower_);
    out_.brick_dims = (out_.dims + (kVolumeBrickSide - 1)) / kVolumeBrickSide;
    out_.brick_table.assign(out_.table_index(out_.brick_dims - 1) + 1, kEmptyBrick);
    for_each_voxel(lower_, upper_, [&](size_t index, const uvec3& at) {
      const float density = density_at(index);
      if (!(density > 0)) return true;
      const ivec3 voxel(at - lower_);
      copy_voxel(index, brick_of(voxel), index_in_brick(voxel), density);
      return true;
    });
    const auto say = [&](uint64_t count, const char* what) {
      if (count > 0) out_.warnings.push_back(fmt::format("volume {}: {} voxels {}", given_.name, count, what));
    };
    say(mended_, "have matrices that are no SGGX: the nearest are taken");
    say(round_, given_.fibre.empty() ? "have no SGGX: they stop alike from all sides"
                                     : "have no direction: they stop alike from all sides");
  }

  void copy_voxel(size_t index, uint32_t brick, size_t voxel, float density) {
    float& kept = out_.bricks[brick][voxel];
    kept = density;
    if (has_shapes()) put_ellipsoid(ellipsoid_at(index), out_.shapes[brick][voxel], kept);
    out_.densest = std::max(out_.densest, kept);
    if (has_anisotropies()) out_.anisotropies[brick][voxel] = static_cast<float>(given_.anisotropy.at(index));
    if (!given_.self_shadowing.empty()) {
      out_.self_shadowing[brick][voxel] =
          std::max(static_cast<float>(given_.self_shadowing.at(index)), kLeastSelfShadowing);
    }
    for (int c = 0; c < 3 && has_albedos(); ++c) {
      out_.albedos[brick][voxel][static_cast<size_t>(c)] =
          static_cast<uint16_t>(std::lround(65535 * given_.albedo.at(index, c)));
    }
  }

  /// Along the grid's axes.
  glm::dmat3 ellipsoid_at(size_t index) {
    const glm::dmat3 to_grid = glm::transpose(out_.rotation);
    if (!given_.fibre.empty()) {
      const dvec3 fibre(given_.fibre.at(index, 0), given_.fibre.at(index, 1), given_.fibre.at(index, 2));
      if (!(glm::length(fibre) > 0)) return ++round_, glm::dmat3(1.0);
      return fibre_ellipsoid(to_grid * fibre, fog_.fibre_roughness);
    }
    const auto s = [&](int entry) { return given_.sggx.at(index, entry); };
    glm::dmat3 m(s(0), s(3), s(4), s(3), s(1), s(5), s(4), s(5), s(2));
    if (!(m[0][0] + m[1][1] + m[2][2] > 0)) return ++round_, glm::dmat3(1.0);
    mended_ += mend_ellipsoid(m);
    return to_grid * m * out_.rotation;
  }

  uint32_t brick_of(const ivec3& voxel) {
    uint32_t& brick = out_.brick_table[out_.table_index(voxel / kVolumeBrickSide)];
    if (brick != kEmptyBrick) return brick;
    brick = static_cast<uint32_t>(out_.bricks.size());
    out_.bricks.emplace_back().fill(0);
    if (has_albedos()) out_.albedos.emplace_back();
    if (has_shapes()) out_.shapes.emplace_back().fill(kRoundShape);
    if (has_anisotropies()) out_.anisotropies.emplace_back();
    if (!given_.self_shadowing.empty()) out_.self_shadowing.emplace_back().fill(1.0f);
    ++out_.filled_bricks;
    return brick;
  }

  void set_light() {
    out_.anisotropy = static_cast<float>(fog_.anisotropy);
    if (fog_.albedo) out_.albedo = *fog_.albedo;
    if (fog_.albedo && !given_.albedo.empty())
      out_.warnings.push_back(fmt::format("volume {}: the albedo of the settings is taken for its own", given_.name));
    if (fog_.anisotropy != 0 && !given_.anisotropy.empty())
      out_.warnings.push_back(
          fmt::format("volume {}: the anisotropy of the settings is taken for its own", given_.name));
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
    hash = hash_values<ShapeBrick>(out_.shapes, hash);
    hash = hash_values<NumberBrick>(out_.anisotropies, hash);
    hash = hash_values<NumberBrick>(out_.self_shadowing, hash);
    hash = hash_values<float>({&out_.albedo.x, 3}, hash);
    return hash_values<float>({&out_.anisotropy, 1}, hash);
  }

  const BakeVolume& given_;
  const BakeFog& fog_;
  const Job& job_;
  const uvec3 dims_;
  VoxelShape shape_;
  uvec3 lower_{0}, upper_{0};        ///< of what has a density
  uint64_t mended_ = 0, round_ = 0;  ///< voxels whose matrices were none, or not there
  SourceVolume out_;
};

}  // namespace

FogOptions fog_options(const BakeFog& fog) {
  return {fog.density_grid, fog.density_scale, fog.albedo, fog.anisotropy, fog.level_set, fog.fibre_roughness};
}

Result<SourceVolume> gather_volume(const BakeVolume& volume, const BakeFog& fog, const Job& job) {
  return VolumeGatherer(volume, fog, job).run();
}

}  // namespace farfield
