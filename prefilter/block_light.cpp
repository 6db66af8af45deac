// SPDX-License-Identifier: Apache-2.0
#include "prefilter/block_light.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/hash.h"
#include "base/nonfinite.h"
#include "base/random.h"
#include "scattering/albedo.h"

namespace farfield {
namespace {

constexpr uint32_t kMostEvents = 512;  ///< light that is in the block still leaves then; in both alike

/// A ray in voxels of the block; unit direction.
struct Line {
  dvec3 origin, direction;
};

/// Where a ray is stopped; not at all if `voxel` is negative.
struct Stop {
  dvec3 point{0.0};
  ivec3 voxel{-1};
  double depth = 0;  ///< from the origin to there or, if nothing stops it, to where it leaves

  bool is_hit() const { return voxel.x >= 0; }
};

/// The block, voxel by voxel [Amanatides and Woo 1987].
class BlockMedium {
 public:
  explicit BlockMedium(const FogBlock& block) : block_(block) {}

  int side() const { return block_.side(); }
  vec3 albedo(const ivec3& voxel) const { return block_.albedo(voxel); }
  FogParams phase(const ivec3& voxel, float anisotropy) const { return block_.phase(voxel, anisotropy); }

  Stop stop(const Line& line, double depth) const {
    ivec3 cell;
    dvec3 next, delta;
    for (int axis = 0; axis < 3; ++axis) {
      const double p = line.origin[axis], d = line.direction[axis];
      cell[axis] = std::clamp(static_cast<int>(std::floor(p)), 0, side() - 1);
      next[axis] = d == 0 ? kInfinity : (cell[axis] + (d > 0 ? 1 : 0) - p) / d;
      delta[axis] = d == 0 ? kInfinity : std::abs(1 / d);
    }
    double passed = 0;
    for (double t = 0;;) {
      const int axis = next.x <= next.y && next.x <= next.z ? 0 : next.y <= next.z ? 1 : 2;
      const double end = std::max(next[axis], t), here = block_.depth(cell, line.direction), step = here * (end - t);
      if (here > 0 && passed + step >= depth) {
        const double at = std::min(t + (depth - passed) / here, end);
        return {line.origin + at * line.direction, cell, depth};
      }
      passed += step;
      t = end;
      cell[axis] += line.direction[axis] > 0 ? 1 : -1;
      if (cell[axis] < 0 || cell[axis] >= side()) return {{}, ivec3(-1), passed};
      next[axis] += delta[axis];
    }
  }

 private:
  const FogBlock& block_;
};

/// The homogeneous cube.
class CubeMedium {
 public:
  explicit CubeMedium(const FogCube& cube) : cube_(cube) {}

  int side() const { return cube_.side; }
  vec3 albedo(const ivec3&) const { return cube_.albedo; }
  FogParams phase(const ivec3&, float anisotropy) const {
    FogParams phase;
    phase.anisotropy = anisotropy;
    phase.has_shape = cube_.has_shape;
    phase.sggx = cube_.shape;
    return phase;
  }

  Stop stop(const Line& line, double depth) const {
    double length = kInfinity;
    for (int axis = 0; axis < 3; ++axis) {
      const double d = line.direction[axis];
      if (d != 0) length = std::min(length, ((d > 0 ? side() : 0) - line.origin[axis]) / d);
    }
    const double across = cube_.has_shape ? shape_sigma(cube_.shape, line.direction) : 1.0;
    const double rate = cube_.depth * across / side(), all = rate * std::max(length, 0.0);
    if (!(all >= depth)) return {{}, ivec3(-1), all};
    return {line.origin + depth / rate * line.direction, ivec3(0), depth};
  }

 private:
  const FogCube& cube_;
};

/// The start of ray number i: on a side of the block, spread evenly over it [Roberts 2018].
Line entering_ray(uint32_t i, int side, const vec2& start) {
  const int axis = static_cast<int>(i % 3);
  const bool is_up = i / 3 % 2 == 0;
  const double n = i / 6, u = n * 0.7548776662466927 + static_cast<double>(start.x),
               v = n * 0.5698402909980532 + static_cast<double>(start.y);
  Line line{dvec3(0.0), dvec3(0.0)};
  line.origin[axis] = is_up ? 0 : side;
  line.origin[(axis + 1) % 3] = (u - std::floor(u)) * side;
  line.origin[(axis + 2) % 3] = (v - std::floor(v)) * side;
  line.direction[axis] = is_up ? 1 : -1;
  return line;
}

double free_depth(Rng& rng) { return -std::log1p(-static_cast<double>(rng.next())); }

dvec3 scattered(const dvec3& direction, const FogParams& phase, Rng& rng) {
  return glm::normalize(dvec3(FogPhase(phase, vec3(-direction)).sample(rng).wi));
}

template <typename Medium>
BlockLight follow(const Medium& medium, const BlockRays& rays) {
  const uint32_t count = (rays.count + 5) / 6 * 6;
  Rng of_block(rays.seed);
  const float u = of_block.next(), v = of_block.next();
  BlockLight light;
  dvec3 left(0.0);
  double stopped = 0, cosines = 0;
  for (uint32_t i = 0; i < count; ++i) {
    Line line = entering_ray(i, medium.side(), {u, v});
    // Every ray that can be stopped is, and counts as often as it would.
    const double weight = -std::expm1(-medium.stop(line, kInfinity).depth);
    if (!(weight > 0)) continue;
    Rng rng(mix64(rays.seed, i + 1));
    Stop stop = medium.stop(line, -std::log1p(-static_cast<double>(rng.next()) * weight));
    if (!stop.is_hit()) continue;  // by rounding, at the very end
    stopped += weight;
    const dvec3 came = line.direction;
    dvec3 throughput(1.0);
    uint32_t events = 0;
    while (stop.is_hit() && events < kMostEvents) {
      throughput *= dvec3(medium.albedo(stop.voxel));
      line = {stop.point, scattered(line.direction, medium.phase(stop.voxel, rays.anisotropy), rng)};
      if (events == 0 && rays.with_single) {
        const double through = weight * std::exp(-medium.stop(line, kInfinity).depth);
        light.single += through * throughput;
        light.single_if_white += through;
      }
      ++events;
      stop = medium.stop(line, free_depth(rng));
    }
    left += weight * throughput;
    cosines += weight * throughput.y * glm::dot(came, line.direction);
    if (light.events.size() < events) {
      light.events.resize(events, 0.0);
      light.event_cosines.resize(events, 0.0);
    }
    light.events[events - 1] += weight;
    light.event_cosines[events - 1] += weight * glm::dot(came, line.direction);
  }
  light.single /= count;
  light.single_if_white /= count;
  if (!(stopped > 0)) return light;
  light.albedo = left / stopped;
  light.cosine = left.y > 0 ? cosines / left.y : 0;
  for (double& share : light.events) share /= stopped;
  for (double& cosine : light.event_cosines) cosine /= stopped;
  return light;
}

}  // namespace

FogBlock::FogBlock(const SourceVolume& source, const ivec3& lower, int side)
    : source_(source), lower_(lower), side_(side), voxel_size_(source.voxel_size) {
  const ivec3 first = lower / kVolumeBrickSide;
  const ivec3 end = glm::min((lower + side - 1) / kVolumeBrickSide + 1, source.brick_dims);
  ivec3 brick;
  for (brick.z = first.z; brick.z < end.z; ++brick.z)
    for (brick.y = first.y; brick.y < end.y; ++brick.y)
      for (brick.x = first.x; brick.x < end.x; ++brick.x) {
        const uint32_t index = source.brick_table[source.table_index(brick)];
        if (index != kEmptyBrick) bricks_.push_back({brick * kVolumeBrickSide - lower, index});
      }
}

double FogBlock::depth(const ivec3& voxel, const dvec3& w) const {
  const ivec3 at = lower_ + voxel, brick = at / kVolumeBrickSide;
  const uint32_t index = source_.brick_at(brick);
  if (index == kEmptyBrick) return 0;
  const size_t i = index_in_brick(at);
  return static_cast<double>(source_.bricks[index][i]) * source_sigma(source_, index, i, w) * voxel_size_;
}

vec3 FogBlock::albedo(const ivec3& voxel) const {
  if (!has_own_albedos(source_)) return source_.albedo;
  const ivec3 at = lower_ + voxel;
  return albedo_of(brick_of(at), index_in_brick(at));
}

vec3 FogBlock::albedo_of(uint32_t brick, size_t in_brick) const {
  const vec3 albedo = source_.albedos.empty() ? source_.albedo : unpack_albedo(source_.albedos[brick][in_brick]);
  return source_.self_shadowing.empty() ? albedo : cluster_albedo(albedo, source_.self_shadowing[brick][in_brick]);
}

FogParams FogBlock::phase(const ivec3& voxel, float anisotropy) const {
  FogParams phase;
  phase.anisotropy = anisotropy;
  if (source_.anisotropies.empty() && source_.shapes.empty()) return phase;
  const ivec3 at = lower_ + voxel;
  const uint32_t brick = brick_of(at);
  if (!source_.anisotropies.empty()) phase.anisotropy = source_.anisotropies[brick][index_in_brick(at)];
  phase.has_shape = !source_.shapes.empty();
  if (phase.has_shape) phase.sggx = source_shape(source_, brick, index_in_brick(at));
  return phase;
}

double BlockLight::cosine_for(double cube_albedo) const {
  double throughput = 1, left = 0, cosine_sum = 0;
  for (size_t n = 0; n < events.size(); ++n) {
    throughput *= cube_albedo;
    left += throughput * events[n];
    cosine_sum += throughput * event_cosines[n];
  }
  return left > 0 ? cosine_sum / left : 0.0;
}

BlockLight follow_light(const FogBlock& block, const BlockRays& rays) { return follow(BlockMedium(block), rays); }
BlockLight follow_light(const FogCube& cube, const BlockRays& rays) { return follow(CubeMedium(cube), rays); }

}  // namespace farfield
