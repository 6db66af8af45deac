// SPDX-License-Identifier: Apache-2.0
// Candidates first: every triangle marks the voxels it passes through, and these are widened by the reach of a voxel's
// rays. Then each candidate casts its rays at the triangles, counts hits, averages what it hit, and solves for the
// density that is hit as often [Loubet 2018, sections 9.2 and 9.3].
#include "prefilter/voxelize.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/free_memory.h"
#include "base/hash.h"
#include "base/parallel_job.h"
#include "base/result.h"
#include "base/split_mix.h"
#include "prefilter/density.h"
#include "prefilter/ray_scene.h"
#include "prefilter/thin_out.h"
#include "scattering/normal_moments.h"

namespace farfield {
namespace {

/// How far rays get from their voxel's centre along an axis, in voxels: their middle is in it and they are 1 long.
constexpr double kReach = 1;
constexpr uint32_t kMaxRayFactor = 16;    ///< how many times more rays than asked for a voxel may get
constexpr uint32_t kEnoughMisses = 16;    ///< rays that must get through for a transmittance with 25 % noise
constexpr uint64_t kManyVoxels = 10'000;  ///< fewer voxels share the rays of this many: seconds of one core

/// Sums over the rays of one voxel.
struct HitSums {
  uint32_t hits = 0;
  SymMat3 sggx;
  vec3 diffuse{0.0f}, specular{0.0f}, transmission{0.0f}, emission{0.0f};
  float roughness2_weight = 0, roughness2 = 0;  ///< weighted by the specular reflectance whose lobe it is

  void add(const FaceMaterial& m) {
    ++hits;
    sggx += m.flake_normals();
    diffuse += m.diffuse;
    specular += m.specular;
    transmission += m.transmission;
    emission += m.emission;
    const float weight = component_sum(m.specular);
    roughness2_weight += weight;
    roughness2 += weight * m.roughness2;
  }
};

/// The middles (of the cube kernel, docs/decisions/0008) and directions of thesis algorithm 1, in voxels around a
/// voxel's centre, from 128 random bits per ray.
class RaySampler {
 public:
  static const RaySampler& instance() {
    static const RaySampler sampler;
    return sampler;
  }

  /// Uniform in the unit cube, 21 bits per axis.
  vec3 middle(uint64_t bits) const {
    const auto offset = [](uint64_t b) { return (static_cast<float>(b & 0x1fffff) + 0.5f) * 0x1p-21f - 0.5f; };
    return {offset(bits), offset(bits >> 21), offset(bits >> 42)};
  }
  /// Uniform on the sphere. The azimuth is one of 4096: far finer than what 200 rays can tell.
  vec3 direction(uint64_t bits) const {
    const float z = 2 * to_unit_float(bits) - 1, r = std::sqrt(std::max(0.0f, 1 - z * z));
    const vec2& c = circle_[bits & (kCells - 1)];
    return {r * c.x, r * c.y, z};
  }

 private:
  static constexpr int kCells = 4096;

  RaySampler() {
    for (int i = 0; i < kCells; ++i) {
      const double angle = 2 * M_PI * (i + 0.5) / kCells;
      circle_[static_cast<size_t>(i)] = vec2(std::cos(angle), std::sin(angle));
    }
  }

  std::array<vec2, kCells> circle_;
};

/// What one voxel is measured with.
struct VoxelRays {
  const Surface& geometry;
  const OpacityScene& scene;
  vec3 center;
  float size;  ///< of the voxel, and the length of the rays
  HitSums hits{};

  /// Casts rays with their middles in the voxel. What a ray hits first counts.
  void cast(uint32_t rays, SplitMix& random) {
    const RaySampler& sampler = RaySampler::instance();
    for (uint32_t i = 0; i < rays; ++i) {
      const vec3 middle = center + size * sampler.middle(random.next());
      const vec3 direction = sampler.direction(random.next());
      const vec3 origin = middle - 0.5f * size * direction;
      const auto hit = scene.first_stop(origin, direction, size, random);
      if (!hit) continue;
      hits.add(geometry.materials[hit->triangle]);
    }
  }
};

/// What all voxels of a volume have in common.
struct Measurement {
  const Surface& geometry;
  const VoxelLattice& lattice;
  const OpacityScene& scene;
  uint32_t rays;  ///< per voxel
  uint64_t seed;
};

/// One voxel, or one with density 0 where no ray hits.
Voxel measure_voxel(const Measurement& m, const ivec3& coordinate) {
  const double size = m.lattice.voxel_size;
  const vec3 center(m.lattice.origin + (dvec3(coordinate) + 0.5) * size);
  SplitMix random(seed_of(coordinate, m.seed));

  VoxelRays voxel_rays{m.geometry, m.scene, center, static_cast<float>(size)};
  const HitSums& sums = voxel_rays.hits;
  uint32_t rays = m.rays;
  voxel_rays.cast(rays, random);
  // A transmittance that is the share of a handful of rays is mostly noise: cast as many rays again until it is not.
  while (rays - sums.hits < kEnoughMisses && rays < kMaxRayFactor * m.rays && sums.hits > rays / 2) {
    voxel_rays.cast(rays, random);
    rays *= 2;
  }
  Voxel voxel;
  if (sums.hits == 0) return voxel;

  const double depth = optical_depth_of_hits(sums.hits, rays);
  const float share = 1 / static_cast<float>(sums.hits);
  voxel.sggx = sggx_of_moments(sums.sggx);
  voxel.density = static_cast<float>(solve_density(voxel.sggx, depth, size));
  voxel.diffuse = sums.diffuse * share;
  voxel.specular = sums.specular * share;
  voxel.transmission = sums.transmission * share;
  voxel.emission = sums.emission * share;
  if (sums.roughness2_weight > 0) voxel.roughness2 = sums.roughness2 / sums.roughness2_weight;
  return voxel;
}

/// The voxels of one candidate brick that are kept; `mask` then says which.
std::vector<Voxel> measure_brick(const Measurement& m, const ivec3& brick, VoxelMask& mask) {
  std::vector<Voxel> voxels;
  for (int i = 0; i < kBrickVoxels; ++i) {
    const auto word = static_cast<size_t>(i >> 6);
    const uint64_t bit = uint64_t{1} << (i & 63);
    if (!(mask[word] & bit)) continue;
    const ivec3 coordinate = voxel_of_brick(brick, i);
    const Voxel voxel = measure_voxel(m, coordinate);
    if (voxel.density > 0) {
      voxels.push_back(voxel);
    } else {
      mask[word] &= ~bit;
    }
  }
  return voxels;
}

Result<void> check_arguments(const Surface& geometry, const VoxelLattice& lattice, const VoxelizeOptions& options) {
  if (!(lattice.voxel_size > 0) || options.rays_per_voxel == 0) {
    return make_error(ErrorCode::InvalidArgument,
                      fmt::format("voxelize: voxel size {} and rays per voxel {} must be positive", lattice.voxel_size,
                                  options.rays_per_voxel));
  }
  if (geometry.triangles.empty()) return {};
  const Box3 bounds = geometry.bounds();
  const dvec3 furthest =
      glm::max(glm::abs(dvec3(bounds.lower) - lattice.origin), glm::abs(dvec3(bounds.upper) - lattice.origin));
  if (!(std::max({furthest.x, furthest.y, furthest.z}) < (kCellLimit - 64) * lattice.voxel_size)) {
    return make_error(ErrorCode::InvalidArgument,
                      fmt::format("voxelize: geometry reaches further than {} voxels of {} from the lattice's origin",
                                  kCellLimit - 64, lattice.voxel_size));
  }
  return {};
}

/// Few voxels get more rays than asked for: a coarse level can afford them, and a single voxel shows more there.
uint32_t rays_per_voxel(uint64_t voxels, const VoxelizeOptions& options) {
  const uint64_t factor = std::clamp<uint64_t>(kManyVoxels / std::max<uint64_t>(voxels, 1), 1, kMaxRayFactor);
  return static_cast<uint32_t>(factor) * options.rays_per_voxel;
}

/// The voxels that may be hit.
VoxelSet find_candidates(const Surface& geometry, const VoxelLattice& lattice, const Job& job = {}) {
  return widen(mark_voxels(geometry, lattice, job), kReach);
}

/// The kept voxels of every stride-th candidate brick of the range; the masks of these bricks become theirs.
Result<std::vector<std::vector<Voxel>>> measure_bricks(const OpacityScene& geometry, const VoxelLattice& lattice,
                                                       VoxelSet& candidates, size_t stride,
                                                       const VoxelizeOptions& options) {
  std::vector<std::vector<Voxel>> voxels(candidates.coordinates.size());
  const Measurement measurement{geometry.surface(), lattice, geometry, rays_per_voxel(candidates.size(), options),
                                options.seed};
  const size_t first = std::min<uint64_t>(options.bricks.first, voxels.size());
  const size_t last = first + std::min<uint64_t>(options.bricks.count, voxels.size() - first);
  const size_t count = (last - first + stride - 1) / stride;
  const bool is_done = parallel_for(options.job, "voxelise", count, 4, [&](size_t begin, size_t end) {
    for (size_t i = first + begin * stride; i < std::min(first + end * stride, last); i += stride) {
      voxels[i] = measure_brick(measurement, candidates.coordinates[i], candidates.masks[i]);
    }
  });
  if (!is_done) return make_error(ErrorCode::Cancelled, "voxelize: cancelled");
  options.job.report(1, "voxelise");
  return voxels;
}

}  // namespace

Result<SparseVolume> voxelize(const Surface& geometry, const VoxelLattice& lattice, const VoxelizeOptions& options) {
  FARFIELD_TRY(check_arguments(geometry, lattice, options));
  if (geometry.triangles.empty()) return SparseVolume{lattice, {}, {}};
  FARFIELD_TRY_LET(const auto scene, OpacityScene::build(geometry));
  return voxelize(scene, lattice, options);
}

Result<SparseVolume> voxelize(const OpacityScene& geometry, const VoxelLattice& lattice,
                              const VoxelizeOptions& options) {
  FARFIELD_TRY(check_arguments(geometry.surface(), lattice, options));
  SparseVolume volume;
  volume.lattice = lattice;
  VoxelSet candidates = find_candidates(geometry.surface(), lattice, options.job);
  FARFIELD_TRY_LET(auto voxels, measure_bricks(geometry, lattice, candidates, 1, options));
  for (size_t i = 0; i < voxels.size(); ++i) {
    std::vector<Voxel>& of_brick = voxels[i];
    if (of_brick.empty()) continue;
    volume.bricks.push_back({candidates.coordinates[i], candidates.masks[i], volume.voxels.size()});
    volume.voxels.insert(volume.voxels.end(), of_brick.begin(), of_brick.end());
    free_memory(of_brick);
  }
  return volume;
}

uint64_t candidate_bricks(const Surface& geometry, const VoxelLattice& lattice) {
  return find_candidates(geometry, lattice).coordinates.size();
}

Result<VolumeSize> estimate_volume(const Surface& geometry, const VoxelLattice& lattice,
                                   const VoxelizeOptions& options) {
  constexpr size_t kStride = 32, kEnoughBricks = 64;
  FARFIELD_TRY(check_arguments(geometry, lattice, options));
  VolumeSize size;
  VoxelSet candidates = find_candidates(geometry, lattice, options.job);
  if (options.job.is_cancelled()) return make_error(ErrorCode::Cancelled, "voxelize: cancelled");
  if (candidates.coordinates.size() < kStride * kEnoughBricks) return size;
  VoxelizeOptions quietly = options;
  quietly.job = options.job.quiet();
  quietly.bricks = {};
  FARFIELD_TRY_LET(const auto scene, OpacityScene::build(geometry));
  FARFIELD_TRY_LET(const auto voxels, measure_bricks(scene, lattice, candidates, kStride, quietly));
  double kept = 0;
  for (const std::vector<Voxel>& of_brick : voxels) {
    double kept_in_brick = 0;
    for (const Voxel& voxel : of_brick) kept_in_brick += kept_share(voxel, lattice.voxel_size);
    kept += kept_in_brick;
    size.bricks += kept_in_brick < 1 ? 0 : kStride;
  }
  size.voxels = static_cast<uint64_t>(kStride * kept);
  return size;
}

}  // namespace farfield
