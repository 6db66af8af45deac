// SPDX-License-Identifier: Apache-2.0
#include "prefilter/downsample_fog.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "base/parallel.h"
#include "prefilter/block_light.h"
#include "prefilter/match_fog.h"
#include "prefilter/voxel_marks.h"
#include "scattering/albedo.h"

namespace farfield {
namespace {

/// Light is followed where it could change an albedo, or the share of single scattering, by this much.
constexpr double kLeastEffect = 1e-3;
constexpr double kLeastDifference = 0.01;  ///< of depths, by which a block must differ from its even spread
constexpr double kMostBackward = 0.9;      ///< g of the other sign: nearly all light goes back
constexpr double kLeastShare = 1e-3;       ///< of single scattering, and of an axis's attenuation by the largest
constexpr uint32_t kRaysPerArea = 24, kMostRays = 1024;  ///< rays for each fine voxel that a side shows

/// -log of the mean of exp(-depth): finite and exact to a few roundings, however large or small the depths are.
double depth_of_columns(const std::vector<double>& depths) {
  const double least = *std::ranges::min_element(depths);
  double sum = 0;
  for (const double depth : depths) sum += std::expm1(least - depth);
  return least - std::log1p(sum / static_cast<double>(depths.size()));
}

/// What one pass over a block's voxels tells.
struct BlockSums {
  dvec3 axis_depth{0.0};  ///< of the block, by what it lets through along x, y, z
  double depth = 0;       ///< sum over all voxels
  double largest = 0, smallest = std::numeric_limits<double>::infinity();  ///< of the voxels that have any
  dvec3 albedo{0.0};                                                       ///< mean, weighted by density
  vec3 darkest{1.0f}, brightest{0.0f};
  uint64_t voxels = 0;  ///< with a density
};

BlockSums sum_block(const FogBlock& block) {
  const auto side = static_cast<size_t>(block.side());
  std::array<std::vector<double>, 3> columns;
  for (auto& of_axis : columns) of_axis.assign(side * side, 0.0);
  BlockSums sums;
  block.for_each_voxel([&](const ivec3& voxel, double depth, const vec3& albedo) {
    const glm::vec<3, size_t> v(voxel);
    columns[0][v.y + side * v.z] += depth;
    columns[1][v.z + side * v.x] += depth;
    columns[2][v.x + side * v.y] += depth;
    sums.depth += depth;
    sums.albedo += depth * dvec3(albedo);
    sums.largest = std::max(sums.largest, depth);
    sums.smallest = std::min(sums.smallest, depth);
    sums.darkest = glm::min(sums.darkest, albedo);
    sums.brightest = glm::max(sums.brightest, albedo);
    ++sums.voxels;
  });
  if (sums.voxels == 0) return sums;
  sums.albedo /= sums.depth;
  for (int axis = 0; axis < 3; ++axis) sums.axis_depth[axis] = depth_of_columns(columns[static_cast<size_t>(axis)]);
  return sums;
}

bool is_homogeneous(const BlockSums& sums, int side) {
  const auto all = static_cast<uint64_t>(side) * static_cast<uint64_t>(side) * static_cast<uint64_t>(side);
  return sums.voxels == all && sums.smallest == sums.largest && sums.darkest == sums.brightest;
}

/// Whether what light does in the block could differ from what it does in a homogeneous one.
bool is_worth_following(const BlockSums& sums, int side, float anisotropy) {
  if (is_homogeneous(sums, side)) return false;
  const double further_events = sums.largest * side;  // more than light meets after its first one
  if (anisotropy != 0) return further_events > kLeastEffect;
  return further_events * (1 - static_cast<double>(min_component(sums.darkest))) > kLeastEffect;
}

/// x with sum over n of events[n - 1] x^n = target. The sum rises and is convex: Newton from 1 comes down to the root.
double solve_collision_albedo(const std::vector<double>& events, double target) {
  if (!(target < 1)) return 1;
  if (!(target > 0)) return 0;
  double x = 1;
  for (int i = 0; i < 64; ++i) {
    double value = 0, slope = 0;
    for (size_t n = events.size(); n-- > 0;) {  // Horner
      slope = slope * x + value;
      value = value * x + events[n];
    }
    slope = slope * x + value;  // of x * value
    const double step = (x * value - target) / slope;
    if (!(step > 1e-12)) break;
    x = std::max(x - step, 0.0);
  }
  return x;
}

/// A with cluster_albedo(albedo, A) = seen in the mean over the channels; those in which it can be seen count.
float share_of_cluster(const dvec3& albedo, const dvec3& seen) {
  double weights = 0, logs = 0;
  for (int c = 0; c < 3; ++c) {
    const double a = albedo[c], x = std::min(seen[c], a);  // never brighter than what it is made of
    const double weight = x * (1 - x);
    if (!(weight > 0) || !(a < 1)) continue;
    logs += weight * std::log(x * (1 - a) / (a * (1 - x)));
    weights += weight;
  }
  return weights > 0 ? static_cast<float>(std::clamp(std::exp(logs / weights), kLeastShare, 1.0)) : 1.0f;
}

/// 14.1.13: what brings the cube's single scattering closest to the block's, over the channels.
float share_of_single_scattering(const BlockLight& block, const BlockLight& cube, const dvec3& albedo) {
  const double square = glm::dot(albedo, albedo);
  const double share = square > 0 ? glm::dot(block.single, albedo) / (cube.single_if_white * square)
                                  : block.single_if_white / cube.single_if_white;
  return std::isfinite(share) ? static_cast<float>(std::clamp(share, kLeastShare, 1.0)) : 1.0f;
}

/// Along an edge of the block, by Transp.
double mean_depth(const BlockSums& sums) { return (sums.axis_depth.x + sums.axis_depth.y + sums.axis_depth.z) / 3; }

/// Whether a block and the cube that stands for it could differ in what they scatter: the cube is thinner than the
/// block would be if its fog were spread evenly, or fog is so thin that it does not matter.
bool differs_from_cube(const BlockSums& sums, int side, double depth) {
  if (is_homogeneous(sums, side)) return false;
  const double even_depth = sums.depth / (static_cast<double>(side) * side);
  return sums.largest * side > kLeastEffect && std::abs(even_depth - depth) > kLeastDifference * depth;
}

/// The g with which the cube sends light back as much as the block does: its mean cosine rises with g.
float anisotropy_of(double cosine, const FogCube& cube, BlockRays rays) {
  double low = -kMostBackward, high = std::max(0.0, static_cast<double>(rays.anisotropy));
  const auto excess = [&](double g) {
    rays.anisotropy = static_cast<float>(g);
    return follow_light(cube, rays).cosine - cosine;
  };
  double at_high = excess(high);
  if (at_high <= 0) return static_cast<float>(high);
  double at_low = excess(low);
  if (at_low >= 0) return static_cast<float>(low);
  // The cosine is nearly straight in g: one point between, and the root on the chord that has it.
  const double g = low + (high - low) * -at_low / (at_high - at_low), at_g = excess(g);
  (at_g > 0 ? high : low) = g;
  (at_g > 0 ? at_high : at_low) = at_g;
  return static_cast<float>(low + (high - low) * -at_low / (at_high - at_low));
}

/// An ellipsoid that stops, along the axes, what the block stops.
void shape_by_axes(const dvec3& axis_depth, double length, FogVoxel& voxel) {
  const double largest = std::max({axis_depth.x, axis_depth.y, axis_depth.z});
  const dvec3 sigma = glm::max(axis_depth / largest, dvec3(kLeastShare));
  const vec3 squares(sigma * sigma);
  voxel.density = static_cast<float>(largest / length);
  voxel.shape = {squares.x, squares.y, squares.z, 0, 0, 0};
}

}  // namespace

const char* name_of(Downsampling method) {
  switch (method) {
    case Downsampling::Linear:
      return "linear";
    case Downsampling::Transp:
      return "transp";
    case Downsampling::Iso:
      return "iso";
    case Downsampling::Aniso:
      return "aniso";
    case Downsampling::Matched:
      return "matched";
  }
  return "unknown";
}

Result<Downsampling> parse_downsampling(const std::string& name) {
  for (const auto method :
       {Downsampling::Linear, Downsampling::Transp, Downsampling::Iso, Downsampling::Aniso, Downsampling::Matched})
    if (name == name_of(method)) return method;
  return make_error(ErrorCode::InvalidArgument,
                    fmt::format("\"{}\" is none of linear, transp, iso, aniso, matched", name));
}

FogDownsampler::FogDownsampler(const SourceVolume& source, uint32_t level, Downsampling method)
    : source_(source), level_(level), method_(method), dims_((source.dims + ((1 << level) - 1)) >> ivec3(level)) {}

float FogDownsampler::density(const ivec3& coordinate) const {
  const int side = 1 << level_;
  const FogBlock block(source_, coordinate * side, side);
  if (block.is_empty()) return 0;
  return static_cast<float>(mean_depth(sum_block(block)) / (source_.voxel_size * side));
}

FogVoxel FogDownsampler::voxel(const ivec3& coordinate) const {
  const int side = 1 << level_;
  const FogBlock block(source_, coordinate * side, side);
  FogVoxel voxel;
  if (block.is_empty()) return voxel;
  const BlockSums sums = sum_block(block);
  if (sums.voxels == 0) return voxel;
  const double length = source_.voxel_size * side;
  voxel.albedo = vec3(sums.albedo);
  if (method_ == Downsampling::Linear) {
    voxel.density = static_cast<float>(sums.depth / std::pow(side, 2) / length);
    return voxel;
  }
  const double depth = mean_depth(sums);
  voxel.density = static_cast<float>(depth / length);
  if (method_ == Downsampling::Aniso) shape_by_axes(sums.axis_depth, length, voxel);
  if (method_ == Downsampling::Transp || !is_worth_following(sums, side, source_.anisotropy)) return voxel;
  const BlockRays rays = block_rays(coordinate);
  const BlockLight of_block = follow_light(block, rays), of_cube = follow_light(FogCube{depth, side}, rays);
  if (source_.anisotropy != 0)
    voxel.self_shadowing = share_of_single_scattering(of_block, of_cube, sums.albedo);
  else
    set_albedo(sums.albedo, of_block, of_cube, voxel);
  return voxel;
}

FogVoxel FogDownsampler::voxel(const ivec3& coordinate, float density) const {
  const int side = 1 << level_;
  const FogBlock block(source_, coordinate * side, side);
  FogVoxel voxel;
  voxel.density = density;
  voxel.anisotropy = source_.anisotropy;
  const BlockSums sums = sum_block(block);
  if (sums.voxels == 0) return voxel;
  voxel.albedo = vec3(sums.albedo);
  const double depth = static_cast<double>(density) * source_.voxel_size * side;
  if (!differs_from_cube(sums, side, depth)) return voxel;
  BlockRays rays = block_rays(coordinate);
  const BlockLight of_block = follow_light(block, rays);
  FogCube cube{depth, side, vec3(1.0f)};
  if (min_component(sums.darkest) < 1) set_albedo(sums.albedo, of_block, follow_light(cube, rays), voxel);
  cube.albedo = source_.albedos.empty() ? cluster_albedo(voxel.albedo, voxel.self_shadowing) : voxel.albedo;
  voxel.anisotropy = anisotropy_of(of_block.cosine, cube, rays);
  return voxel;
}

BlockRays FogDownsampler::block_rays(const ivec3& coordinate) const {
  const auto area = uint64_t{1} << 2 * level_;
  return {static_cast<uint32_t>(std::min<uint64_t>(kRaysPerArea * area, kMostRays)), seed_of(coordinate, level_),
          source_.anisotropy};
}

void FogDownsampler::set_albedo(const dvec3& albedo, const BlockLight& of_block, const BlockLight& of_cube,
                                FogVoxel& voxel) const {
  dvec3 seen;
  for (int c = 0; c < 3; ++c) seen[c] = solve_collision_albedo(of_cube.events, of_block.albedo[c]);
  if (source_.albedos.empty())
    voxel.self_shadowing = share_of_cluster(albedo, seen);
  else
    voxel.albedo = vec3(seen);
}

Result<DensityGrid> matched_densities(const SourceVolume& source, uint32_t level, const Job& job) {
  const FogDownsampler downsampler(source, level, Downsampling::Transp);
  DensityGrid grid;
  grid.voxel_size = std::ldexp(source.voxel_size, static_cast<int>(level));
  grid.dims = downsampler.dims();
  grid.brick_dims = (grid.dims + (kVolumeBrickSide - 1)) / kVolumeBrickSide;
  const ivec3& n = grid.brick_dims;
  const size_t entries = static_cast<size_t>(n.x) * static_cast<size_t>(n.y) * static_cast<size_t>(n.z);
  grid.brick_table.assign(entries, kEmptyBrick);
  for (size_t entry = 0; entry < entries; ++entry) {
    const auto e = static_cast<int>(entry);
    const ivec3 corner = ivec3(e % n.x, e / n.x % n.y, e / (n.x * n.y)) * kVolumeBrickSide;
    DensityBrick brick;
    parallel_for(brick.size(), 32, [&](size_t begin, size_t end) {
      for (size_t i = begin; i < end && !job.is_cancelled(); ++i) {
        const auto v = static_cast<int>(i);
        const ivec3 voxel = corner + ivec3(v & 7, v >> 3 & 7, v >> 6);
        brick[i] = glm::all(glm::lessThan(voxel, grid.dims)) ? downsampler.density(voxel) : 0.0f;
      }
    });
    if (job.is_cancelled()) return make_error(ErrorCode::Cancelled, "bake: cancelled");
    if (std::ranges::none_of(brick, [](float density) { return density > 0; })) continue;
    grid.brick_table[entry] = static_cast<uint32_t>(grid.bricks.size());
    grid.bricks.push_back(brick);
  }
  FARFIELD_TRY(match_fog(source, level, grid, job));
  return grid;
}

}  // namespace farfield
