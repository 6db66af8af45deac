// SPDX-License-Identifier: Apache-2.0
#include "prefilter/downsample_fog.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "base/parallel.h"
#include "prefilter/block_light.h"
#include "prefilter/fog_shape.h"
#include "prefilter/match_fog.h"
#include "prefilter/voxel_marks.h"
#include "scattering/albedo.h"
#include "scattering/carlson.h"
#include "scattering/sggx.h"

namespace farfield {
namespace {

/// Light is followed where it could change an albedo, or the share of single scattering, by this much.
constexpr double kLeastEffect = 1e-3;
constexpr double kLeastDifference = 0.01;  ///< of depths, by which a block must differ from its even spread
constexpr double kMostBackward = 0.9;      ///< g of the other sign: nearly all light goes back
constexpr double kCosineSlope = 0.8;       ///< of the mean cosine over g, about: where the search starts
constexpr double kLeastShare = 1e-3;       ///< of single scattering, and of an axis's attenuation by the largest
constexpr uint32_t kRaysPerArea = 8, kMostRays = 512;  ///< rays for each fine voxel that a side shows

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
  uint64_t voxels = 0;      ///< with a density
  double anisotropy = 0;    ///< mean, weighted by density
  SymMat3 shape;            ///< mean, the same; lambda_max 1. Without shapes, the identity
  double mean_sigma = 1;    ///< of the shape, over directions
  dvec3 axis_sigma{1.0};    ///< of the shape, along x, y, z
  bool is_one_kind = true;  ///< shapes and anisotropies are the same everywhere
};

/// Finds the mean shape and how it stops: depths become means over directions.
class MeanShape {
 public:
  explicit MeanShape(const SourceVolume& source) : source_(source), has_shapes_(!source.shapes.empty()) {}

  /// The voxel's depths along x, y, z; adds them to the mean.
  struct Depths {
    dvec3 along_axes;
    double mean;
  };
  Depths add(const FogBlockVoxel& voxel) {
    if (!has_shapes_) return {dvec3(voxel.depth), voxel.depth};
    const SymMat3 s = source_shape(source_, voxel.brick, voxel.in_brick);
    is_same_ = is_same_ && (sum_ == 0 || s == first_);
    if (sum_ == 0) first_ = s;
    const dvec3 eigen = eigenvalues(s);
    const double mean = voxel.depth * carlson_rg(eigen.x, eigen.y, eigen.z);
    weighted_ += s * static_cast<float>(mean);
    sum_ += mean;
    return {voxel.depth * glm::sqrt(glm::max(dvec3(s.xx, s.yy, s.zz), dvec3(0.0))), mean};
  }
  void finish(BlockSums& sums) const {
    sums.shape = SymMat3::identity();
    if (!has_shapes_) return;
    sums.shape = normalise_sggx(weighted_ * static_cast<float>(1 / sum_)).sggx;
    const dvec3 eigen = eigenvalues(sums.shape);
    sums.mean_sigma = carlson_rg(eigen.x, eigen.y, eigen.z);
    sums.axis_sigma = glm::sqrt(glm::max(dvec3(sums.shape.xx, sums.shape.yy, sums.shape.zz), dvec3(0.0)));
    sums.is_one_kind = sums.is_one_kind && is_same_;
  }

 private:
  const SourceVolume& source_;
  const bool has_shapes_;
  bool is_same_ = true;
  SymMat3 first_, weighted_;
  double sum_ = 0;
};

BlockSums sum_block(const SourceVolume& source, const FogBlock& block) {
  const auto side = static_cast<size_t>(block.side());
  std::array<std::vector<double>, 3> columns;
  for (auto& of_axis : columns) of_axis.assign(side * side, 0.0);
  BlockSums sums;
  MeanShape shape(source);
  float first_anisotropy = 0;
  block.for_each_voxel([&](const FogBlockVoxel& voxel) {
    const glm::vec<3, size_t> v(voxel.at);
    const auto [along_axes, depth] = shape.add(voxel);
    columns[0][v.y + side * v.z] += along_axes.x;
    columns[1][v.z + side * v.x] += along_axes.y;
    columns[2][v.x + side * v.y] += along_axes.z;
    sums.depth += depth;
    sums.albedo += depth * dvec3(voxel.albedo);
    sums.largest = std::max(sums.largest, voxel.depth);
    sums.smallest = std::min(sums.smallest, voxel.depth);
    sums.darkest = glm::min(sums.darkest, voxel.albedo);
    sums.brightest = glm::max(sums.brightest, voxel.albedo);
    if (!source.anisotropies.empty()) {
      const float g = source.anisotropies[voxel.brick][voxel.in_brick];
      if (sums.voxels == 0) first_anisotropy = g;
      sums.is_one_kind = sums.is_one_kind && g == first_anisotropy;
      sums.anisotropy += depth * static_cast<double>(g);
    }
    ++sums.voxels;
  });
  if (sums.voxels == 0) return sums;
  sums.albedo /= sums.depth;
  sums.anisotropy = source.anisotropies.empty() ? static_cast<double>(source.anisotropy) : sums.anisotropy / sums.depth;
  shape.finish(sums);
  for (int axis = 0; axis < 3; ++axis) sums.axis_depth[axis] = depth_of_columns(columns[static_cast<size_t>(axis)]);
  return sums;
}

bool is_homogeneous(const BlockSums& sums, int side) {
  const auto all = static_cast<uint64_t>(side) * static_cast<uint64_t>(side) * static_cast<uint64_t>(side);
  const bool is_even = sums.smallest == sums.largest && sums.darkest == sums.brightest && sums.is_one_kind;
  return sums.voxels == all && is_even;
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

/// Along an edge of the block and the largest axis of its mean shape, by Transp.
double mean_depth(const BlockSums& sums) {
  return (sums.axis_depth.x + sums.axis_depth.y + sums.axis_depth.z) /
         (sums.axis_sigma.x + sums.axis_sigma.y + sums.axis_sigma.z);
}

/// Whether a block and the cube that stands for it could differ in what they scatter: the cube is thinner than the
/// block would be if its fog were spread evenly, or fog is so thin that it does not matter.
bool differs_from_cube(const BlockSums& sums, int side, double depth) {
  if (is_homogeneous(sums, side)) return false;
  const double even_depth = sums.depth / (static_cast<double>(side) * side);
  const double of_cube = depth * sums.mean_sigma;
  return sums.largest * side > kLeastEffect && std::abs(even_depth - of_cube) > kLeastDifference * of_cube;
}

/// The g with which the cube sends light back as much as the block does: its mean cosine rises with g. `white`: the
/// light of the white cube with the g of the rays.
float anisotropy_of(double cosine, const BlockLight& white, const FogCube& cube, BlockRays rays) {
  const auto cosine_at = [&](double g) {
    rays.anisotropy = static_cast<float>(g);
    return follow_light(cube, rays).cosine;
  };
  const double high = std::max(0.0, static_cast<double>(rays.anisotropy));
  const bool is_known = rays.anisotropy >= 0;
  const double at_high = (is_known ? white.cosine_for(static_cast<double>(cube.albedo.y)) : cosine_at(high)) - cosine;
  if (at_high <= 0) return static_cast<float>(high);
  // The cosine is nearly straight in g: a guess, and the root of the line through both.
  const double guess = std::max(high - at_high / kCosineSlope, -kMostBackward), at_guess = cosine_at(guess) - cosine;
  if (!(at_high > at_guess)) return static_cast<float>(guess);
  const double root = guess - at_guess * (high - guess) / (at_high - at_guess);
  return static_cast<float>(std::clamp(root, -kMostBackward, high));
}

/// An ellipsoid that stops, along the axes, what the block stops.
void shape_by_axes(const BlockSums& sums, double length, FogVoxel& voxel) {
  // The mean shape stretched along the axes; of none, the ellipsoid itself.
  const dvec3 axis_depth = sums.axis_depth / glm::max(sums.axis_sigma, dvec3(kLeastShare));
  const double largest = std::max({axis_depth.x, axis_depth.y, axis_depth.z});
  const dvec3 sigma = glm::max(axis_depth / largest, dvec3(kLeastShare));
  const vec3 squares(sigma * sigma);
  voxel.density = static_cast<float>(largest / length);
  voxel.shape = {squares.x, squares.y, squares.z, 0, 0, 0};
  if (sums.shape == SymMat3::identity()) return;
  const NormalisedSggx stretched = normalise_sggx(
      congruence(mat3(glm::dmat3(dvec3(sigma.x, 0, 0), dvec3(0, sigma.y, 0), dvec3(0, 0, sigma.z))), sums.shape));
  voxel.density *= stretched.rho_factor;
  voxel.shape = stretched.sggx;
}

/// Means of what flakes have, weighted by what they stop.
class MeanLook {
 public:
  explicit MeanLook(const SourceVolume& source) : source_(source) {}

  /// Also the mean self-shadowing.
  void find(const FogBlock& block, FogVoxel& voxel) const {
    const SourceFlakes& flakes = *source_.flakes;
    double sum = 0, shadowing = 0, roughness = 0, shine = 0;
    dvec3 diffuse(0.0), specular(0.0), transmission(0.0), emission(0.0);
    block.for_each_voxel([&](const FogBlockVoxel& v) {
      const auto add = [&](const BigVector<ColorBrick>& colors, dvec3& to) {
        if (!colors.empty()) to += v.depth * dvec3(colors[v.brick][v.in_brick]);
      };
      sum += v.depth;
      add(flakes.diffuse, diffuse);
      add(flakes.specular, specular);
      add(flakes.transmission, transmission);
      add(flakes.emission, emission);
      shadowing += v.depth * static_cast<double>(value_at(source_.self_shadowing, v, 1));
      if (flakes.specular.empty()) return;
      const double weight = v.depth * static_cast<double>(max_component(flakes.specular[v.brick][v.in_brick]));
      shine += weight;
      roughness += weight * static_cast<double>(value_at(flakes.roughness, v, 1));
    });
    if (!(sum > 0)) return;
    voxel.flakes.diffuse = vec3(diffuse / sum);
    voxel.flakes.specular = vec3(specular / sum);
    voxel.flakes.transmission = vec3(transmission / sum);
    voxel.flakes.emission = vec3(emission / sum);
    voxel.flakes.roughness = shine > 0 ? static_cast<float>(roughness / shine) : 0.0f;
    voxel.self_shadowing = static_cast<float>(shadowing / sum);
  }

 private:
  static float value_at(const BigVector<NumberBrick>& numbers, const FogBlockVoxel& v, float otherwise) {
    return numbers.empty() ? otherwise : numbers[v.brick][v.in_brick];
  }
  const SourceVolume& source_;
};

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

FogDownsampler::Attenuation FogDownsampler::attenuation(const ivec3& coordinate) const {
  const int side = 1 << level_;
  const FogBlock block(source_, coordinate * side, side);
  if (block.is_empty()) return {};
  const BlockSums sums = sum_block(source_, block);
  if (sums.voxels == 0) return {};
  return {static_cast<float>(mean_depth(sums) / (source_.voxel_size * side)), sums.shape};
}

FogVoxel FogDownsampler::voxel(const ivec3& coordinate) const {
  const int side = 1 << level_;
  const FogBlock block(source_, coordinate * side, side);
  FogVoxel voxel;
  if (block.is_empty()) return voxel;
  const BlockSums sums = sum_block(source_, block);
  if (sums.voxels == 0) return voxel;
  const double length = source_.voxel_size * side;
  voxel.albedo = vec3(sums.albedo);
  voxel.anisotropy = static_cast<float>(sums.anisotropy);
  voxel.shape = sums.shape;
  if (source_.flakes) MeanLook(source_).find(block, voxel);
  if (method_ == Downsampling::Linear) {
    voxel.density = static_cast<float>(sums.depth / sums.mean_sigma / std::pow(side, 2) / length);
    return voxel;
  }
  const double depth = mean_depth(sums);
  voxel.density = static_cast<float>(depth / length);
  if (method_ == Downsampling::Aniso) shape_by_axes(sums, length, voxel);
  if (source_.flakes || method_ == Downsampling::Transp || !is_worth_following(sums, side, voxel.anisotropy))
    return voxel;
  BlockRays rays = block_rays(coordinate);
  rays.anisotropy = voxel.anisotropy;
  const FogCube cube{depth, side, vec3(1.0f), !source_.shapes.empty(), sums.shape};
  const BlockLight of_block = follow_light(block, rays), of_cube = follow_light(cube, rays);
  if (source_.anisotropy != 0 && source_.anisotropies.empty())
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
  const BlockSums sums = sum_block(source_, block);
  if (sums.voxels == 0) return voxel;
  voxel.albedo = vec3(sums.albedo);
  voxel.anisotropy = static_cast<float>(sums.anisotropy);
  voxel.shape = sums.shape;
  if (source_.flakes) {
    MeanLook(source_).find(block, voxel);
    return voxel;
  }
  const double depth = static_cast<double>(density) * source_.voxel_size * side;
  if (!differs_from_cube(sums, side, depth)) return voxel;
  BlockRays rays = block_rays(coordinate);
  rays.anisotropy = voxel.anisotropy;
  rays.with_single = false;
  const BlockLight of_block = follow_light(block, rays);
  FogCube cube{depth, side, vec3(1.0f), !source_.shapes.empty(), sums.shape};
  const BlockLight of_white = follow_light(cube, rays);
  if (min_component(sums.darkest) < 1) set_albedo(sums.albedo, of_block, of_white, voxel);
  cube.albedo = !has_own_albedos(source_) ? cluster_albedo(voxel.albedo, voxel.self_shadowing) : voxel.albedo;
  voxel.anisotropy = anisotropy_of(of_block.cosine, of_white, cube, rays);
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
  if (!has_own_albedos(source_) && source_.anisotropies.empty())
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
    if (is_much_in_memory()) rest(source), rest(grid);
    const ivec3 corner = grid.brick_of_entry(entry) * kVolumeBrickSide;
    DensityBrick brick;
    ShapeBrick shapes;
    parallel_for(brick.size(), 32, [&](size_t begin, size_t end) {
      for (size_t i = begin; i < end && !job.is_cancelled(); ++i) {
        const ivec3 voxel = corner + voxel_in_brick(static_cast<int>(i));
        const bool is_inside = glm::all(glm::lessThan(voxel, grid.dims));
        const auto [density, s] = is_inside ? downsampler.attenuation(voxel) : FogDownsampler::Attenuation();
        brick[i] = density;
        shapes[i] = {s.xx, s.yy, s.zz, s.xy, s.xz, s.yz};
      }
    });
    if (job.is_cancelled()) return make_error(ErrorCode::Cancelled, "bake: cancelled");
    if (std::ranges::none_of(brick, [](float density) { return density > 0; })) continue;
    grid.brick_table[entry] = static_cast<uint32_t>(grid.bricks.size());
    grid.bricks.push_back(brick);
    if (!source.shapes.empty()) grid.shapes.push_back(shapes);
  }
  FARFIELD_TRY(match_fog(source, level, grid, job));
  return grid;
}

}  // namespace farfield
