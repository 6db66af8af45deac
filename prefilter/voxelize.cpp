// SPDX-License-Identifier: Apache-2.0
// Candidates first: every triangle marks the voxels it passes through, and these are widened by the reach of a voxel's
// rays. Then each candidate casts its rays at the triangles, counts hits, averages what it hit, and solves for the
// density that is hit as often [Loubet 2018, sections 9.2 and 9.3], and for the self-shadowing with which as much light
// gets away as does from the points that were hit [Loubet 2018, 14.1.4].
#include "prefilter/voxelize.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <thread>

#include "base/hash.h"
#include "base/parallel.h"
#include "base/result.h"
#include "prefilter/density.h"
#include "prefilter/ray_scene.h"
#include "prefilter/self_shadowing.h"
#include "scattering/albedo.h"
#include "scattering/sggx.h"
#include "scattering/warp.h"

namespace farfield {
namespace {

/// How far rays get from their voxel's centre along an axis, in voxels: their middle is in it and they are 1 long.
constexpr double kReach = 1;
/// How far light that goes on must get away, in voxels: as far as a ray reaches to either side of its middle.
constexpr float kEscapeLength = 0.5f;
/// In voxels: light that goes on starts this far from the face it leaves.
constexpr float kClearance = 1e-3f;
/// In voxels: a ray that passes a face goes on this far behind it.
constexpr float kPassed = 1e-5f;

constexpr uint32_t kMaxRayFactor = 16;    ///< how many times more rays than asked for a voxel may get
constexpr uint32_t kEnoughMisses = 16;    ///< rays that must get through for a transmittance with 25 % noise
constexpr uint64_t kManyVoxels = 50'000;  ///< fewer voxels share the rays of this many: seconds of one core

/// Sums over the rays of one voxel.
struct HitSums {
  uint32_t hits = 0;
  SymMat3 sggx;
  vec3 diffuse{0.0f}, specular{0.0f}, transmission{0.0f}, emission{0.0f};
  float roughness2_weight = 0, roughness2 = 0;  ///< weighted by the specular reflectance whose lobe it is

  void add(const FaceMaterial& m) {
    ++hits;
    sggx += m.sggx;
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

/// A stream of random bits [Steele, Lea and Flood 2014].
class SplitMix {
 public:
  explicit SplitMix(uint64_t seed) : state_(seed) {}
  uint64_t next() { return mix64(state_ += 0x9e3779b97f4a7c15ull); }

 private:
  uint64_t state_;
};

/// Where light goes on that arrived along `direction` at a face: a cosine lobe on the side that it came from or, as
/// often as the face lets light through, on the other.
vec3 scattered_direction(const FaceMaterial& m, const vec3& geometric_normal, const vec3& direction, uint64_t bits) {
  const auto unit = [bits](int shift) { return static_cast<float>(bits >> shift & 0x1fffff) * 0x1p-21f; };
  const float through = component_sum(m.transmission);
  const float back = component_sum(m.diffuse) + component_sum(m.specular);
  const bool goes_through = unit(0) * (through + back) < through;
  // In two steps: the square of a tiny face's normal may be no float.
  const vec3 normal = glm::normalize(geometric_normal / max_component(glm::abs(geometric_normal)));
  return cosine_lobe((glm::dot(normal, direction) > 0) == goes_through ? normal : -normal, unit(21), unit(42));
}

/// What one voxel is measured with.
struct VoxelRays {
  const Surface& geometry;
  const RayScene& scene;
  vec3 center;
  float size;  ///< of the voxel, and the length of the rays
  bool is_opaque;
  HitSums hits{};
  EscapeSums escape{};

  /// Casts rays with their middles in the voxel. What a ray hits first counts.
  void cast(uint32_t rays, SplitMix& random) {
    const RaySampler& sampler = RaySampler::instance();
    for (uint32_t i = 0; i < rays; ++i) {
      const vec3 middle = center + size * sampler.middle(random.next());
      const vec3 direction = sampler.direction(random.next());
      const vec3 origin = middle - 0.5f * size * direction;
      const auto hit = first_stop(origin, direction, size, random);
      if (!hit) continue;
      hits.add(geometry.materials[hit->triangle]);
      scatter(origin, direction, *hit, random);
    }
  }

  /// The first face that stops the ray: faces that are not opaque let some pass.
  std::optional<RayHit> first_stop(const vec3& origin, const vec3& direction, float length, SplitMix& random) const {
    float passed = 0;
    while (true) {
      const auto hit = scene.first_hit(origin + passed * direction, direction, length - passed);
      if (!hit) return {};
      const float opacity = geometry.materials[hit->triangle].opacity;
      if (opacity >= 1 || to_unit_float(random.next()) < opacity) {
        return RayHit{hit->triangle, passed + hit->distance, hit->normal};
      }
      passed += hit->distance + kPassed * size;
      if (!(passed < length)) return {};
    }
  }

  bool is_blocked(const vec3& origin, const vec3& direction, float near, float far, SplitMix& random) const {
    if (is_opaque) return scene.is_occluded(origin, direction, near, far);
    return far > near && first_stop(origin + near * direction, direction, far - near, random).has_value();
  }

  /// Sends on the light of a hit. What is hidden from where the ray came from, within its length, does not count:
  /// nobody sees it, and the inside of solid twigs is of that kind.
  void scatter(const vec3& origin, const vec3& direction, const RayHit& hit, SplitMix& random) {
    const uint64_t bits = random.next();
    if (!(max_component(glm::abs(hit.normal)) >= std::numeric_limits<float>::min())) return;  // no face that reflects
    if (is_blocked(origin, -direction, 0, size - hit.distance, random)) return;
    const FaceMaterial& m = geometry.materials[hit.triangle];
    const vec3 away = scattered_direction(m, hit.normal, direction, bits);
    const vec3 point = origin + hit.distance * direction;
    escape.add(away, component_sum(layered_albedo(m.specular, m.diffuse + m.transmission)),
               !is_blocked(point, away, kClearance * size, kEscapeLength * size, random));
  }
};

/// What all voxels of a volume have in common.
struct Measurement {
  const Surface& geometry;
  const VoxelLattice& lattice;
  const RayScene& scene;
  uint32_t rays;  ///< per voxel
  uint64_t seed;
  bool is_opaque;  ///< no ray passes any face
};

SplitMix random_of_voxel(const ivec3& coordinate, uint64_t seed) {
  const auto bits = [](int v) { return static_cast<uint64_t>(static_cast<uint32_t>(v)); };
  return SplitMix(mix64(mix64(seed, bits(coordinate.x) << 32 | bits(coordinate.y)), bits(coordinate.z)));
}

/// Makes as much light get away from a voxel's medium as does from its geometry: less by self-shadowing, more by a
/// higher albedo. White stays white.
void let_escape(float ratio, Voxel& voxel) {
  voxel.self_shadowing = std::min(ratio, 1.0f);
  if (!(ratio > 1)) return;
  const vec3 albedo = layered_albedo(voxel.specular, voxel.diffuse + voxel.transmission);
  const vec3 gain = cluster_albedo(glm::min(albedo, vec3(1.0f)), ratio) / glm::max(albedo, vec3(1e-6f));
  voxel.diffuse *= gain;
  voxel.specular *= gain;
  voxel.transmission *= gain;
}

/// One voxel, or one with density 0 where no ray hits or chance has it so.
Voxel measure_voxel(const Measurement& m, const ivec3& coordinate) {
  const double size = m.lattice.voxel_size;
  const vec3 center(m.lattice.origin + (dvec3(coordinate) + 0.5) * size);
  SplitMix random = random_of_voxel(coordinate, m.seed);

  VoxelRays voxel_rays{m.geometry, m.scene, center, static_cast<float>(size), m.is_opaque};
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

  double depth = optical_depth_of_hits(sums.hits, rays);
  if (depth < kFaintestDepth) {
    if (to_unit_float(random.next()) * kFaintestDepth >= depth) return voxel;
    depth = kFaintestDepth;
  }
  const float share = 1 / static_cast<float>(sums.hits);
  voxel.sggx = normalise_sggx(sums.sggx).sggx;
  voxel.density = static_cast<float>(solve_density(voxel.sggx, depth, size));
  voxel.diffuse = sums.diffuse * share;
  voxel.specular = sums.specular * share;
  voxel.transmission = sums.transmission * share;
  voxel.emission = sums.emission * share;
  if (sums.roughness2_weight > 0) voxel.roughness2 = sums.roughness2 / sums.roughness2_weight;
  let_escape(static_cast<float>(voxel_rays.escape.ratio(voxel.sggx, voxel.density, kEscapeLength * size)), voxel);
  return voxel;
}

/// The voxels of one candidate brick that are kept; `mask` then says which.
std::vector<Voxel> measure_brick(const Measurement& m, const ivec3& brick, VoxelMask& mask) {
  std::vector<Voxel> voxels;
  for (int i = 0; i < kBrickVoxels; ++i) {
    const auto word = static_cast<size_t>(i >> 6);
    const uint64_t bit = uint64_t{1} << (i & 63);
    if (!(mask[word] & bit)) continue;
    const ivec3 coordinate = brick * kBrickSide + ivec3(i & 7, i >> 3 & 7, i >> 6);
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
  if (!(std::max({furthest.x, furthest.y, furthest.z}) < (kVoxelLimit - 64) * lattice.voxel_size)) {
    return make_error(ErrorCode::InvalidArgument,
                      fmt::format("voxelize: geometry reaches further than {} voxels of {} from the lattice's origin",
                                  kVoxelLimit - 64, lattice.voxel_size));
  }
  return {};
}

/// Few voxels get more rays than asked for: a coarse level can afford them, and a single voxel shows more there.
uint32_t rays_per_voxel(uint64_t voxels, const VoxelizeOptions& options) {
  const uint64_t factor = std::clamp<uint64_t>(kManyVoxels / std::max<uint64_t>(voxels, 1), 1, kMaxRayFactor);
  return static_cast<uint32_t>(factor) * options.rays_per_voxel;
}

/// The voxels that may be hit.
VoxelSet find_candidates(const Surface& geometry, const VoxelLattice& lattice) {
  return widen(mark_voxels(geometry, lattice), kReach);
}

/// The kept voxels of every stride-th candidate brick of the range; the masks of these bricks become theirs.
Result<std::vector<std::vector<Voxel>>> measure_bricks(const Surface& geometry, const VoxelLattice& lattice,
                                                       VoxelSet& candidates, size_t stride,
                                                       const VoxelizeOptions& options) {
  std::vector<std::vector<Voxel>> voxels(candidates.coordinates.size());
  if (voxels.empty()) return voxels;
  FARFIELD_TRY_LET(const RayScene rays, RayScene::build(geometry));
  const bool is_opaque =
      std::ranges::all_of(geometry.materials, [](const FaceMaterial& material) { return material.opacity >= 1; });
  const Measurement measurement{geometry,     lattice,  rays, rays_per_voxel(candidates.size(), options),
                                options.seed, is_opaque};
  const size_t first = std::min<uint64_t>(options.bricks.first, voxels.size());
  const size_t last = first + std::min<uint64_t>(options.bricks.count, voxels.size() - first);
  const size_t count = (last - first + stride - 1) / stride;
  std::atomic<size_t> done{0};  // relaxed: only for the progress
  const std::thread::id caller = std::this_thread::get_id();
  parallel_for(count, 4, [&](size_t begin, size_t end) {
    if (options.job.is_cancelled()) return;
    for (size_t i = first + begin * stride; i < std::min(first + end * stride, last); i += stride) {
      voxels[i] = measure_brick(measurement, candidates.coordinates[i], candidates.masks[i]);
    }
    const size_t bricks_done = done.fetch_add(end - begin, std::memory_order_relaxed) + end - begin;
    if (std::this_thread::get_id() == caller) {
      options.job.report(static_cast<double>(bricks_done) / static_cast<double>(count), "voxelise");
    }
  });
  if (options.job.is_cancelled()) return make_error(ErrorCode::Cancelled, "voxelize: cancelled");
  options.job.report(1, "voxelise");
  return voxels;
}

}  // namespace

Result<SparseVolume> voxelize(const Surface& geometry, const VoxelLattice& lattice, const VoxelizeOptions& options) {
  FARFIELD_TRY(check_arguments(geometry, lattice, options));
  SparseVolume volume;
  volume.lattice = lattice;
  VoxelSet candidates = find_candidates(geometry, lattice);
  FARFIELD_TRY_LET(auto voxels, measure_bricks(geometry, lattice, candidates, 1, options));
  for (size_t i = 0; i < voxels.size(); ++i) {
    std::vector<Voxel>& of_brick = voxels[i];
    if (of_brick.empty()) continue;
    volume.bricks.push_back({candidates.coordinates[i], candidates.masks[i], volume.voxels.size()});
    volume.voxels.insert(volume.voxels.end(), of_brick.begin(), of_brick.end());
    of_brick = {};
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
  VoxelSet candidates = find_candidates(geometry, lattice);
  if (candidates.coordinates.size() < kStride * kEnoughBricks) return size;
  VoxelizeOptions quietly = options;
  quietly.job = options.job.quiet();
  quietly.bricks = {};
  FARFIELD_TRY_LET(const auto voxels, measure_bricks(geometry, lattice, candidates, kStride, quietly));
  for (const std::vector<Voxel>& of_brick : voxels) {
    size.voxels += kStride * of_brick.size();
    size.bricks += of_brick.empty() ? 0 : kStride;
  }
  return size;
}

}  // namespace farfield
