// SPDX-License-Identifier: Apache-2.0
#include "prefilter/downsample_fog.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "prefilter/block_light.h"
#include "prefilter/voxel_marks.h"
#include "scattering/albedo.h"

namespace farfield {
namespace {

/// Light is followed where it could change an albedo, or the share of single scattering, by this much.
constexpr double kLeastEffect = 1e-3;
constexpr double kLeastShare = 1e-3;  ///< of single scattering, and of an axis's attenuation by the largest
constexpr uint32_t kRaysPerArea = 24, kMostRays = 3072;  ///< rays for each fine voxel that a side shows

/// -log of the mean of exp(-depth): finite whatever the depths are.
double depth_of_columns(const std::vector<double>& depths) {
  const double least = *std::ranges::min_element(depths);
  double sum = 0;
  for (const double depth : depths) sum += std::exp(least - depth);
  return least - std::log(sum / static_cast<double>(depths.size()));
}

/// What one pass over a block's voxels tells.
struct BlockSums {
  dvec3 axis_depth{0.0};  ///< of the block, by what it lets through along x, y, z
  double depth = 0;       ///< sum over all voxels
  double largest = 0, smallest = std::numeric_limits<double>::infinity();  ///< of the voxels that have any
  dvec3 albedo{0.0};       ///< mean, weighted by density
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
  }
  return "unknown";
}

Result<Downsampling> parse_downsampling(const std::string& name) {
  for (const auto method : {Downsampling::Linear, Downsampling::Transp, Downsampling::Iso, Downsampling::Aniso})
    if (name == name_of(method)) return method;
  return make_error(ErrorCode::InvalidArgument, fmt::format("\"{}\" is none of linear, transp, iso, aniso", name));
}

FogDownsampler::FogDownsampler(const SourceVolume& source, uint32_t level, Downsampling method)
    : source_(source), level_(level), method_(method), dims_((source.dims + ((1 << level) - 1)) >> ivec3(level)) {}

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
  const double depth = (sums.axis_depth.x + sums.axis_depth.y + sums.axis_depth.z) / 3;
  voxel.density = static_cast<float>(depth / length);
  if (method_ == Downsampling::Aniso) shape_by_axes(sums.axis_depth, length, voxel);
  if (method_ == Downsampling::Transp || !is_worth_following(sums, side, source_.anisotropy)) return voxel;

  const auto area = static_cast<uint64_t>(side) * static_cast<uint64_t>(side);
  const BlockRays rays{static_cast<uint32_t>(std::min<uint64_t>(kRaysPerArea * area, kMostRays)),
                       seed_of(coordinate, level_), source_.anisotropy};
  const BlockLight of_block = follow_light(block, rays), of_cube = follow_light(FogCube{depth, side}, rays);
  if (source_.anisotropy != 0) {
    voxel.self_shadowing = share_of_single_scattering(of_block, of_cube, sums.albedo);
    return voxel;
  }
  dvec3 seen;
  for (int c = 0; c < 3; ++c) seen[c] = solve_collision_albedo(of_cube.events, of_block.albedo[c]);
  if (source_.albedos.empty())
    voxel.self_shadowing = share_of_cluster(sums.albedo, seen);
  else
    voxel.albedo = vec3(seen);
  return voxel;
}

}  // namespace farfield
