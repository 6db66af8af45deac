// SPDX-License-Identifier: Apache-2.0
// Candidates first: every triangle marks the voxels it passes through, and these are widened by the reach of a voxel's
// rays. Then each candidate casts its rays on an Embree scene of the triangles, counts hits, averages what it hit, and
// solves for the density that is hit as often [Loubet 2018, sections 9.2 and 9.3].
#include "prefilter/voxelize.h"

#include <embree3/rtcore.h>
#include <fmt/format.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <mutex>
#include <type_traits>
#include <unordered_map>

#include "base/hash.h"
#include "base/parallel.h"
#include "prefilter/density.h"
#include "scattering/sggx.h"

namespace farfield {
namespace {

constexpr int kReach = 3;                  ///< voxels: how far a voxel looks, see reaches()
constexpr int kCoordinateLimit = 1 << 20;  ///< voxels from the lattice's origin
constexpr uint32_t kMaxRayFactor = 16;     ///< how many times more rays a nearly opaque voxel may get
constexpr uint32_t kEnoughMisses = 16;     ///< rays that must get through for a transmittance with 25 % noise

// ---------------------------------------------------------------------------------------------------------------
// Sets of voxels: bricks of 512 bits, bit x + 8 y of word z.

using BrickMask = std::array<uint64_t, 8>;

struct BrickSet {
  std::vector<ivec3> coordinates;  ///< sorted by z, then y, then x
  std::vector<BrickMask> masks;
};

/// A brick's place in the order of the file, as one number.
uint64_t brick_key(const ivec3& b) {
  const auto biased = [](int v) { return static_cast<uint64_t>(v + kCoordinateLimit); };
  return biased(b.z) << 42 | biased(b.y) << 21 | biased(b.x);
}
ivec3 brick_of_key(uint64_t key) {
  const auto part = [&](int shift) { return static_cast<int>(key >> shift & 0x1fffff) - kCoordinateLimit; };
  return {part(0), part(21), part(42)};
}

/// A voxel of a brick: the brick's key and the bit.
struct MarkedVoxel {
  uint64_t brick;
  uint32_t bit;
  auto operator<=>(const MarkedVoxel&) const = default;
};

void sort_unique(std::vector<MarkedVoxel>& marks) {
  std::sort(marks.begin(), marks.end());
  marks.erase(std::unique(marks.begin(), marks.end()), marks.end());
}

/// Marks the voxels that a triangle, given in voxel units, may touch: halves it until it is about as small as a voxel,
/// then takes the box of each piece.
void mark_triangle(const dvec3& a, const dvec3& b, const dvec3& c, std::vector<MarkedVoxel>& marks) {
  const dvec3 edge[3] = {b - a, c - b, a - c};
  const double length2[3] = {glm::dot(edge[0], edge[0]), glm::dot(edge[1], edge[1]), glm::dot(edge[2], edge[2])};
  const int longest = static_cast<int>(std::max_element(length2, length2 + 3) - length2);
  if (length2[longest] > 1) {
    const dvec3 corner[3] = {a, b, c};
    const dvec3 &from = corner[longest], &to = corner[(longest + 1) % 3], &apex = corner[(longest + 2) % 3];
    const dvec3 middle = 0.5 * (from + to);
    mark_triangle(apex, from, middle, marks);
    mark_triangle(apex, middle, to, marks);
    return;
  }
  const ivec3 lower(glm::floor(glm::min(a, glm::min(b, c)))), upper(glm::floor(glm::max(a, glm::max(b, c))));
  for (int z = lower.z; z <= upper.z; ++z) {
    for (int y = lower.y; y <= upper.y; ++y) {
      for (int x = lower.x; x <= upper.x; ++x) {
        marks.push_back(
            {brick_key({x >> 3, y >> 3, z >> 3}), static_cast<uint32_t>((x & 7) + 8 * (y & 7) + 64 * (z & 7))});
      }
    }
  }
}

/// All voxels that the triangles pass through.
BrickSet mark_geometry(const Surface& geometry, const VoxelLattice& lattice) {
  constexpr size_t kGrain = 4096;
  const size_t chunks = (geometry.triangles.size() + kGrain - 1) / kGrain;
  std::vector<std::vector<MarkedVoxel>> per_chunk(chunks);
  parallel_for(geometry.triangles.size(), kGrain, [&](size_t begin, size_t end) {
    std::vector<MarkedVoxel>& marks = per_chunk[begin / kGrain];
    const auto to_voxels = [&](uint32_t vertex) {
      return (dvec3(geometry.positions[vertex]) - lattice.origin) / lattice.voxel_size;
    };
    size_t limit = 1 << 20;
    for (size_t i = begin; i < end; ++i) {
      const uvec3& t = geometry.triangles[i];
      mark_triangle(to_voxels(t.x), to_voxels(t.y), to_voxels(t.z), marks);
      if (marks.size() > limit) {
        sort_unique(marks);
        limit = std::max<size_t>(limit, 2 * marks.size());
      }
    }
    sort_unique(marks);
  });

  std::vector<MarkedVoxel> all;
  for (std::vector<MarkedVoxel>& marks : per_chunk) {
    all.insert(all.end(), marks.begin(), marks.end());
    marks = {};
  }
  sort_unique(all);
  BrickSet set;
  for (size_t i = 0; i < all.size(); ++i) {
    if (i == 0 || all[i].brick != all[i - 1].brick) {
      set.coordinates.push_back(brick_of_key(all[i].brick));
      set.masks.push_back({});
    }
    set.masks.back()[all[i].bit >> 6] |= uint64_t{1} << (all[i].bit & 63);
  }
  return set;
}

/// Half-width along x of the voxels from which rays reach a marked voxel at offset (dy, dz), or -1. Rays start within
/// 1/2 + 3 sigma = 2.3 voxels along each axis, rarely so far along two of them, and are 1 voxel long. Voxels are kept
/// whose centre lies within 2.8 voxels of the marked voxel's nearest point: from further off a plane is hit by less
/// than 1 ray in 1500, and all that is cut off makes less than 1/1000 of all hits.
int reach_along_x(int dy, int dz) {
  constexpr double kRadius = 2.8;
  const auto gap = [](int d) { return std::max(std::abs(d) - 0.5, 0.0); };
  for (int dx = kReach; dx >= 0; --dx) {
    if (gap(dx) * gap(dx) + gap(dy) * gap(dy) + gap(dz) * gap(dz) <= kRadius * kRadius) return dx;
  }
  return -1;
}

/// The voxels within reach of those of a set, for one brick. `neighbours`: the masks of the 3^3 bricks around it, x
/// fastest, null where empty.
BrickMask widen(const std::array<const BrickMask*, 27>& neighbours) {
  // Rows of 24 bits along x through the 3^3 bricks, of which the middle 8 are the brick's own.
  constexpr int kSide = 3 * kBrickSide;
  std::array<std::array<std::array<uint32_t, kReach + 1>, kSide>, kSide> rows{};  // [z][y][half-width]
  for (int z = kBrickSide - kReach; z < 2 * kBrickSide + kReach; ++z) {
    for (int y = kBrickSide - kReach; y < 2 * kBrickSide + kReach; ++y) {
      uint32_t row = 0;
      for (int bx = 0; bx < 3; ++bx) {
        const BrickMask* mask = neighbours[static_cast<size_t>(bx + 3 * (y >> 3) + 9 * (z >> 3))];
        if (mask) row |= static_cast<uint32_t>((*mask)[static_cast<size_t>(z & 7)] >> (8 * (y & 7)) & 0xff) << (8 * bx);
      }
      auto& widened = rows[static_cast<size_t>(z)][static_cast<size_t>(y)];
      widened[0] = row;
      for (size_t w = 1; w <= kReach; ++w) widened[w] = widened[w - 1] | row << w | row >> w;
    }
  }
  BrickMask result{};
  for (int dz = -kReach; dz <= kReach; ++dz) {
    for (int dy = -kReach; dy <= kReach; ++dy) {
      const int half_width = reach_along_x(dy, dz);
      if (half_width < 0) continue;
      for (int z = 0; z < kBrickSide; ++z) {
        for (int y = 0; y < kBrickSide; ++y) {
          const uint32_t row = rows[static_cast<size_t>(kBrickSide + z + dz)][static_cast<size_t>(kBrickSide + y + dy)]
                                   [static_cast<size_t>(half_width)];
          result[static_cast<size_t>(z)] |= static_cast<uint64_t>(row >> kBrickSide & 0xff) << (8 * y);
        }
      }
    }
  }
  return result;
}

/// All voxels within reach of a set.
BrickSet widen(const BrickSet& marked) {
  std::unordered_map<uint64_t, const BrickMask*> mask_of;
  std::vector<uint64_t> keys;
  for (size_t i = 0; i < marked.coordinates.size(); ++i) {
    mask_of[brick_key(marked.coordinates[i])] = &marked.masks[i];
    for (int n = 0; n < 27; ++n) {
      keys.push_back(brick_key(marked.coordinates[i] + ivec3(n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1)));
    }
  }
  std::sort(keys.begin(), keys.end());
  keys.erase(std::unique(keys.begin(), keys.end()), keys.end());

  std::vector<BrickMask> masks(keys.size());
  parallel_for(keys.size(), 64, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) {
      std::array<const BrickMask*, 27> neighbours{};
      for (int n = 0; n < 27; ++n) {
        const auto found = mask_of.find(brick_key(brick_of_key(keys[i]) + ivec3(n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1)));
        if (found != mask_of.end()) neighbours[static_cast<size_t>(n)] = found->second;
      }
      masks[i] = widen(neighbours);
    }
  });
  BrickSet result;
  for (size_t i = 0; i < keys.size(); ++i) {
    if (masks[i] == BrickMask{}) continue;
    result.coordinates.push_back(brick_of_key(keys[i]));
    result.masks.push_back(masks[i]);
  }
  return result;
}

// ---------------------------------------------------------------------------------------------------------------
// Rays.

struct DeleteDevice {
  void operator()(RTCDevice device) const { rtcReleaseDevice(device); }
};
struct DeleteScene {
  void operator()(RTCScene scene) const { rtcReleaseScene(scene); }
};

/// The triangles as an Embree scene, on a device of its own.
class RayScene {
 public:
  explicit RayScene(const Surface& geometry) : device_(rtcNewDevice(nullptr)), scene_(rtcNewScene(device_.get())) {
    RTCGeometry triangles = rtcNewGeometry(device_.get(), RTC_GEOMETRY_TYPE_TRIANGLE);
    // Embree reads 16 bytes at each vertex, so the last one needs room behind it: a copy with one more.
    auto* vertices = static_cast<vec3*>(rtcSetNewGeometryBuffer(triangles, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                                                sizeof(vec3), geometry.positions.size()));
    std::copy(geometry.positions.begin(), geometry.positions.end(), vertices);
    rtcSetSharedGeometryBuffer(triangles, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, geometry.triangles.data(), 0,
                               sizeof(uvec3), geometry.triangles.size());
    rtcCommitGeometry(triangles);
    rtcAttachGeometry(scene_.get(), triangles);
    rtcReleaseGeometry(triangles);
    // One thread: a parallel build may order triangles differently, and with them which of two equal hits is reported.
    tbb::task_arena one_thread(1);
    one_thread.execute([&] { rtcCommitScene(scene_.get()); });
  }

  RTCScene scene() const { return scene_.get(); }
  /// Whether Embree could build the scene.
  bool is_valid() const { return rtcGetDeviceError(device_.get()) == RTC_ERROR_NONE; }

 private:
  std::unique_ptr<std::remove_pointer_t<RTCDevice>, DeleteDevice> device_;
  std::unique_ptr<std::remove_pointer_t<RTCScene>, DeleteScene> scene_;
};

/// Sums over the rays of one voxel.
struct HitSums {
  uint32_t hits = 0;
  SymMat3 sggx;
  vec3 diffuse{0.0f}, specular{0.0f}, transmission{0.0f};
  float roughness2_weight = 0, roughness2 = 0;  ///< weighted by the specular reflectance whose lobe it is

  void add(const FaceMaterial& m) {
    ++hits;
    sggx += m.sggx;
    diffuse += m.diffuse;
    specular += m.specular;
    transmission += m.transmission;
    const float weight = m.specular.x + m.specular.y + m.specular.z;
    roughness2_weight += weight;
    roughness2 += weight * m.roughness2;
  }
};

/// The origins and directions of thesis algorithm 1, in voxels around a voxel's centre, from 128 random bits per ray.
class RaySampler {
 public:
  static const RaySampler& instance() {
    static const RaySampler sampler;
    return sampler;
  }

  /// Origin: uniform in the unit cube plus a Gaussian of sigma 0.6. 21 bits per axis.
  vec3 origin(uint64_t bits) const {
    return {offset(bits & 0x1fffff), offset(bits >> 21 & 0x1fffff), offset(bits >> 42 & 0x1fffff)};
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
    for (int i = 0; i <= kCells; ++i) {
      const double clipped = std::clamp(i / double(kCells), 0.1 / kCells, 1 - 0.1 / kCells);  // 4 sigma
      quantile_[static_cast<size_t>(i)] = static_cast<float>(find_quantile(clipped));
    }
    for (int i = 0; i < kCells; ++i) {
      const double angle = 2 * M_PI * (i + 0.5) / kCells;
      circle_[static_cast<size_t>(i)] = vec2(std::cos(angle), std::sin(angle));
    }
  }

  /// P(u + 0.6 g < x) for u uniform in (-1/2, 1/2) and g normal: the mean of the normal distribution over an interval.
  static double cumulative(double x) {
    constexpr double kSigma = 0.6;
    const auto integral = [](double t) {  // of the cumulative normal distribution
      return t * 0.5 * std::erfc(-t / M_SQRT2) + std::exp(-0.5 * t * t) / std::sqrt(2 * M_PI);
    };
    return kSigma * (integral((x + 0.5) / kSigma) - integral((x - 0.5) / kSigma));
  }
  static double find_quantile(double p) {
    double lower = -5, upper = 5;
    for (int i = 0; i < 60; ++i) {
      const double middle = 0.5 * (lower + upper);
      (cumulative(middle) < p ? lower : upper) = middle;
    }
    return lower;
  }

  /// The quantile function from its table: 12 bits choose the cell, 9 the place in it.
  float offset(uint64_t bits) const {
    const size_t cell = bits >> 9;
    return quantile_[cell] + (quantile_[cell + 1] - quantile_[cell]) * (static_cast<float>(bits & 0x1ff) + 0.5f) / 512;
  }

  std::array<float, kCells + 1> quantile_;
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

/// Casts rays of one voxel length from around `center`. What a ray hits first counts. Single rays: packets of 8 or 16
/// are no more than 6 % faster for rays that are so short and go everywhere.
void cast_rays(RTCScene scene, const Surface& geometry, const vec3& center, float voxel_size, uint32_t rays,
               SplitMix& random, HitSums& sums) {
  const RaySampler& sampler = RaySampler::instance();
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  for (uint32_t i = 0; i < rays; ++i) {
    const vec3 origin = center + voxel_size * sampler.origin(random.next());
    const vec3 direction = sampler.direction(random.next());
    RTCRayHit ray;
    ray.ray = {origin.x,    origin.y, origin.z,   0,           direction.x, direction.y,
               direction.z, 0,        voxel_size, 0xffffffffu, 0,           0};
    ray.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    rtcIntersect1(scene, &context, &ray);
    if (ray.hit.geomID != RTC_INVALID_GEOMETRY_ID) sums.add(geometry.materials[ray.hit.primID]);
  }
}

/// One voxel, or one with density 0 where no ray hits.
Voxel measure_voxel(RTCScene scene, const Surface& geometry, const VoxelLattice& lattice, const ivec3& coordinate,
                    const VoxelizeOptions& options) {
  const vec3 center(lattice.origin + (dvec3(coordinate) + 0.5) * lattice.voxel_size);
  const float voxel_size = static_cast<float>(lattice.voxel_size);
  const uint64_t place =
      static_cast<uint64_t>(static_cast<uint32_t>(coordinate.x)) << 32 | static_cast<uint32_t>(coordinate.y);
  SplitMix random(mix64(mix64(options.seed, place), static_cast<uint32_t>(coordinate.z)));

  HitSums sums;
  uint32_t rays = options.rays_per_voxel;
  cast_rays(scene, geometry, center, voxel_size, rays, random, sums);
  // A transmittance that is the share of a handful of rays is mostly noise: cast as many rays again until it is not.
  while (rays - sums.hits < kEnoughMisses && rays < kMaxRayFactor * options.rays_per_voxel) {
    cast_rays(scene, geometry, center, voxel_size, rays, random, sums);
    rays *= 2;
  }

  Voxel voxel;
  if (sums.hits == 0) return voxel;
  const float share = 1 / static_cast<float>(sums.hits);
  voxel.sggx = normalise_sggx(sums.sggx).sggx;
  voxel.density =
      static_cast<float>(solve_density(voxel.sggx, optical_depth_of_hits(sums.hits, rays), lattice.voxel_size));
  voxel.diffuse = sums.diffuse * share;
  voxel.specular = sums.specular * share;
  voxel.transmission = sums.transmission * share;
  if (sums.roughness2_weight > 0) voxel.roughness2 = sums.roughness2 / sums.roughness2_weight;
  return voxel;
}

/// The voxels of one candidate brick that rays hit; the mask says which.
std::vector<Voxel> measure_brick(RTCScene scene, const Surface& geometry, const VoxelLattice& lattice,
                                 const ivec3& brick, BrickMask& mask, const VoxelizeOptions& options) {
  std::vector<Voxel> voxels;
  for (int i = 0; i < kBrickVoxels; ++i) {
    uint64_t& word = mask[static_cast<size_t>(i >> 6)];
    const uint64_t bit = uint64_t{1} << (i & 63);
    if (!(word & bit)) continue;
    const ivec3 coordinate = brick * kBrickSide + ivec3(i & 7, i >> 3 & 7, i >> 6);
    const Voxel voxel = measure_voxel(scene, geometry, lattice, coordinate, options);
    if (voxel.density > 0) {
      voxels.push_back(voxel);
    } else {
      word &= ~bit;
    }
  }
  return voxels;
}

bool is_cancelled(const VoxelizeOptions& options) {
  return options.cancel && options.cancel->load(std::memory_order_relaxed);  // relaxed: only a flag, it guards no data
}

/// Counts finished bricks and passes the share on, one caller at a time.
class Progress {
 public:
  Progress(size_t total, const std::function<void(double)>& report) : total_(total), report_(report) {}
  void add(size_t done) {
    if (!report_) return;
    const std::lock_guard lock(mutex_);
    done_ += done;
    report_(static_cast<double>(done_) / static_cast<double>(total_));
  }

 private:
  const size_t total_;
  const std::function<void(double)>& report_;
  std::mutex mutex_;
  size_t done_ = 0;  // guarded by mutex_
};

}  // namespace

Result<SparseVolume> voxelize(const Surface& geometry, const VoxelLattice& lattice, const VoxelizeOptions& options) {
  if (!(lattice.voxel_size > 0) || options.rays_per_voxel == 0) {
    return make_error(ErrorCode::InvalidArgument,
                      fmt::format("voxelize: voxel size {} and rays per voxel {} must be positive", lattice.voxel_size,
                                  options.rays_per_voxel));
  }
  SparseVolume volume;
  volume.lattice = lattice;
  if (geometry.triangles.empty()) return volume;
  const Box3 bounds = geometry.bounds();
  const dvec3 furthest =
      glm::max(glm::abs(dvec3(bounds.lower) - lattice.origin), glm::abs(dvec3(bounds.upper) - lattice.origin));
  if (!(std::max({furthest.x, furthest.y, furthest.z}) < (kCoordinateLimit - 64) * lattice.voxel_size)) {
    return make_error(ErrorCode::InvalidArgument,
                      fmt::format("voxelize: geometry reaches further than {} voxels of {} from the lattice's origin",
                                  kCoordinateLimit - 64, lattice.voxel_size));
  }

  BrickSet candidates = widen(mark_geometry(geometry, lattice));
  const RayScene rays(geometry);
  if (!rays.is_valid())
    return make_error(ErrorCode::Io, "voxelize: Embree could not build the geometry (out of memory?)");

  const size_t brick_count = candidates.coordinates.size();
  std::vector<std::vector<Voxel>> voxels(brick_count);
  Progress progress(brick_count, options.progress);
  parallel_for(brick_count, 4, [&](size_t begin, size_t end) {
    if (is_cancelled(options)) return;
    for (size_t i = begin; i < end; ++i) {
      voxels[i] =
          measure_brick(rays.scene(), geometry, lattice, candidates.coordinates[i], candidates.masks[i], options);
    }
    progress.add(end - begin);
  });
  if (is_cancelled(options)) return make_error(ErrorCode::Cancelled, "voxelize: cancelled");

  for (size_t i = 0; i < brick_count; ++i) {
    if (voxels[i].empty()) continue;
    volume.bricks.push_back({candidates.coordinates[i], candidates.masks[i], volume.voxels.size()});
    volume.voxels.insert(volume.voxels.end(), voxels[i].begin(), voxels[i].end());
    voxels[i] = {};
  }
  return volume;
}

}  // namespace farfield
