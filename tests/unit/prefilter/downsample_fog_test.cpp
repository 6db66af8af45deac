// SPDX-License-Identifier: Apache-2.0
#include "prefilter/downsample_fog.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "base/parallel.h"
#include "prefilter/fog_shape.h"
#include "prefilter/isotropic_lines.h"
#include "prefilter/layer_walk.h"
#include "prefilter/match_fog.h"
#include "scattering/albedo.h"
#include "scattering/carlson.h"
#include "scattering/sggx.h"
#include "tests/support/volumes.h"

namespace farfield {
namespace {

using test::make_volume;

constexpr Downsampling kMethods[] = {Downsampling::Linear, Downsampling::Transp, Downsampling::Iso,
                                     Downsampling::Aniso};

TEST(DownsampleFog, HomogeneousBlocksAreExact) {
  for (const float g : {0.0f, 0.7f}) {
    SourceVolume volume = make_volume(ivec3(16), 0.25, [](const ivec3&) { return 3; });
    volume.albedo = vec3(0.8f, 0.9f, 0.3f);
    volume.anisotropy = g;
    for (const uint32_t level : {1u, 2u, 3u, 4u}) {
      for (const Downsampling method : kMethods) {
        const FogVoxel voxel = FogDownsampler(volume, level, method).voxel({0, 0, 0});
        EXPECT_NEAR(voxel.density, 3, 3e-6) << name_of(method) << level;
        EXPECT_EQ(voxel.self_shadowing, 1.0f);
        for (int c = 0; c < 3; ++c) EXPECT_NEAR(voxel.albedo[c], volume.albedo[c], 1e-6);
        EXPECT_NEAR(voxel.shape.yy, 1, 1e-6);
      }
      const FogVoxel matched = FogDownsampler(volume, level, Downsampling::Matched).voxel({0, 0, 0}, 3.0f);
      EXPECT_EQ(matched.anisotropy, g);
      EXPECT_EQ(matched.self_shadowing, 1.0f);
    }
  }
}

/// Fibres along (1, 1, 0), as a source has them; `other`: along another axis in every other voxel along x.
void add_fibres(SourceVolume& volume, bool mixed) {
  volume.shapes.resize(volume.bricks.size());
  for (ShapeBrick& brick : volume.shapes)
    for (size_t i = 0; i < brick.size(); ++i) {
      brick[i] = {0.25f, 0.25f, 0.5f, -0.24f, 0, 0};
      if (mixed && i % 2 == 1) brick[i] = {0.5f, 0.25f, 0.25f, 0, 0, -0.24f};
    }
}

// sigma_t(w) = density sqrt(w^T S w), whatever the scale of S.
double attenuation(const FogVoxel& voxel, const vec3& w) {
  return double(voxel.density) * std::sqrt(double(voxel.shape.quadratic(w)));
}

TEST(DownsampleFog, HomogeneousFibresStayWhatTheyAre) {
  SourceVolume volume = make_volume(ivec3(16), 0.25, [](const ivec3&) { return 3; });
  add_fibres(volume, false);
  const SymMat3 s = {0.25f, 0.25f, 0.5f, -0.24f, 0, 0};
  for (const Downsampling method : kMethods) {
    const FogVoxel voxel = FogDownsampler(volume, 2, method).voxel({0, 0, 0});
    for (const vec3& w : {vec3(1, 0, 0), vec3(0, 0, 1), vec3(0.8f, 0.6f, 0), vec3(0.6f, -0.8f, 0), vec3(0, 0.6f, 0.8f)})
      EXPECT_NEAR(attenuation(voxel, w), 3 * std::sqrt(double(s.quadratic(w))), 1e-4) << name_of(method);
    EXPECT_EQ(voxel.self_shadowing, 1.0f);
  }
  const auto matched = matched_densities(volume, 2);
  ASSERT_TRUE(matched);
  const FogVoxel voxel = FogDownsampler(volume, 2, Downsampling::Matched).voxel({1, 1, 1}, matched->bricks[0][73]);
  EXPECT_NEAR(attenuation(voxel, vec3(0, 0, 1)), 3 * std::sqrt(0.5), 0.02);
}

// What a mixture stops in the mean over directions is what its parts stop, and along the axes, of Aniso, too.
TEST(DownsampleFog, MixedFibresStopWhatTheyDid) {
  SourceVolume volume = make_volume(ivec3(8), 0.25, [](const ivec3&) { return 0.01; });
  add_fibres(volume, true);
  const FogVoxel linear = FogDownsampler(volume, 3, Downsampling::Linear).voxel({0, 0, 0});
  const double one = carlson_rg(0.49, 0.01, 0.5);  // eigenvalues of either
  const dvec3 eigen = eigenvalues(linear.shape);
  EXPECT_NEAR(double(linear.density) * carlson_rg(eigen.x, eigen.y, eigen.z), 0.01 * one, 1e-6);
  const FogVoxel aniso = FogDownsampler(volume, 3, Downsampling::Aniso).voxel({0, 0, 0});
  const double half = std::sqrt(0.5);  // thin: depths are means
  EXPECT_NEAR(attenuation(aniso, vec3(1, 0, 0)), 0.01 * (0.5 + half) / 2, 1e-5);
  EXPECT_NEAR(attenuation(aniso, vec3(0, 1, 0)), 0.01 * 0.5, 1e-5);
  EXPECT_NEAR(attenuation(aniso, vec3(0, 0, 1)), 0.01 * (0.5 + half) / 2, 1e-5);
}

/// -log of the mean of exp(-depths).
double depth_of_mean(std::initializer_list<double> depths) {
  double sum = 0;
  for (const double depth : depths) sum += std::exp(-depth);
  return -std::log(sum / static_cast<double>(depths.size()));
}

// Columns along z are 2 x 4 deep or empty, in a checkerboard; along x and y every column is half of that.
TEST(DownsampleFog, ACheckerboardOfColumnsIsExactAlongTheAxes) {
  const SourceVolume volume = make_volume(ivec3(2), 0.5, [](const ivec3& v) { return (v.x + v.y) % 2 == 0 ? 8 : 0; });
  const FogVoxel aniso = FogDownsampler(volume, 1, Downsampling::Aniso).voxel({0, 0, 0});
  const double along_z = depth_of_mean({8, 0, 8, 0}), along_x = 4;
  EXPECT_NEAR(double(aniso.density) * std::sqrt(double(aniso.shape.zz)), along_z, 1e-5);
  EXPECT_NEAR(double(aniso.density) * std::sqrt(double(aniso.shape.xx)), along_x, 1e-5);
  EXPECT_NEAR(double(aniso.density) * std::sqrt(double(aniso.shape.yy)), along_x, 1e-5);
  EXPECT_NEAR(FogDownsampler(volume, 1, Downsampling::Transp).voxel({0, 0, 0}).density, (along_z + 2 * along_x) / 3,
              1e-5);
  EXPECT_NEAR(FogDownsampler(volume, 1, Downsampling::Linear).voxel({0, 0, 0}).density, 4, 1e-5);
}

TEST(DownsampleFog, AnOpaqueVoxelInAnEmptyBlockCoversItsShareAndNoMore) {
  const SourceVolume volume = make_volume(ivec3(4), 1, [](const ivec3& v) { return v == ivec3(1, 2, 3) ? 1e8 : 0; });
  const double depth = -std::log(15.0 / 16.0);
  for (const Downsampling method : {Downsampling::Transp, Downsampling::Iso})
    EXPECT_NEAR(FogDownsampler(volume, 2, method).voxel({0, 0, 0}).density, depth / 4, 1e-6);
  EXPECT_NEAR(FogDownsampler(volume, 2, Downsampling::Linear).voxel({0, 0, 0}).density, 1e8 / 64, 1);  // a wall
}

TEST(DownsampleFog, ExtremesStayFinite) {
  for (const double density : {1e-30, 1e8, 1e30})
    for (const float albedo : {0.0f, 0.999f, 1.0f})
      for (const float g : {0.0f, -0.9f}) {
        SourceVolume volume = make_volume(ivec3(5, 3, 4), 2, [&](const ivec3& v) { return v.x % 2 ? density : 0; });
        volume.albedo = vec3(albedo);
        volume.anisotropy = g;
        for (const Downsampling method : kMethods) {
          const FogVoxel voxel = FogDownsampler(volume, 2, method).voxel({0, 0, 0});
          EXPECT_TRUE(std::isfinite(voxel.density) && voxel.density > 0) << name_of(method) << density;
          EXPECT_TRUE(voxel.self_shadowing > 0 && voxel.self_shadowing <= 1) << voxel.self_shadowing;
          EXPECT_TRUE(is_finite(voxel.albedo));
        }
        const auto matched = matched_densities(volume, 1);
        ASSERT_TRUE(matched);
        const float d = matched->bricks[0][0];
        EXPECT_TRUE(std::isfinite(d)) << density;
        const FogVoxel voxel = FogDownsampler(volume, 1, Downsampling::Matched).voxel({0, 0, 0}, d);
        EXPECT_TRUE(std::abs(voxel.anisotropy) <= 0.98f) << voxel.anisotropy;
      }
}

/// Of a block as one path tracer sees it: grey fog in clumps.
SourceVolume clumps(float albedo) {
  SourceVolume volume =
      make_volume(ivec3(8), 1, [](const ivec3& v) { return (v.x / 2 + v.y / 2 + v.z / 2) % 2 ? 4 : 0; });
  volume.albedo = vec3(albedo);
  return volume;
}

TEST(DownsampleFog, ClumpsAreDarkerThanTheFogTheyAreMadeOf) {
  const SourceVolume volume = clumps(0.9f);
  const FogVoxel voxel = FogDownsampler(volume, 3, Downsampling::Iso).voxel({0, 0, 0});
  EXPECT_LT(voxel.self_shadowing, 0.9f);
  const float albedo = cluster_albedo(vec3(0.9f), voxel.self_shadowing).x;
  // The cube with that albedo is as bright as the block is, up to the noise of 1024 rays: their albedos differ by less
  // than 2 %.
  const BlockRays rays{30000, 7, 0};
  const BlockLight block = follow_light(FogBlock(volume, ivec3(0), 8), rays);
  const BlockLight cube = follow_light(FogCube{static_cast<double>(voxel.density) * 8, 8, vec3(albedo)}, rays);
  EXPECT_NEAR(cube.albedo.x, block.albedo.x, 0.02);
  EXPECT_EQ(FogDownsampler(clumps(1.0f), 3, Downsampling::Iso).voxel({0, 0, 0}).self_shadowing, 1.0f);
}

TEST(DownsampleFog, AlbedosThatVaryAreStored) {
  SourceVolume volume = clumps(0.9f);
  volume.albedos.resize(volume.bricks.size());
  for (AlbedoBrick& brick : volume.albedos) brick.fill({65535, 32768, 0});
  const FogVoxel voxel = FogDownsampler(volume, 3, Downsampling::Iso).voxel({0, 0, 0});
  EXPECT_EQ(voxel.self_shadowing, 1.0f);
  EXPECT_EQ(voxel.albedo.x, 1.0f);
  EXPECT_GT(voxel.albedo.y, 0.2f);
  EXPECT_LT(voxel.albedo.y, 0.5f);
  EXPECT_EQ(voxel.albedo.z, 0.0f);
}

TEST(DownsampleFog, FogBehindAWallSendsLightBack) {
  const SourceVolume volume = make_volume(ivec3(8), 1, [](const ivec3& v) { return v.x < 2 ? 20 : 0; });
  const auto densities = matched_densities(volume, 3);
  ASSERT_TRUE(densities);
  const FogVoxel voxel = FogDownsampler(volume, 3, Downsampling::Matched).voxel({0, 0, 0}, densities->bricks[0][0]);
  EXPECT_LT(voxel.anisotropy, -0.2f);
}

// ---- light in blocks

TEST(BlockLight, WhiteFogLosesNothing) {
  const BlockLight light = follow_light(FogBlock(clumps(1), ivec3(0), 8), {6000, 1, 0.5f});
  EXPECT_EQ(light.albedo, dvec3(1.0));
  double sum = 0;
  for (const double share : light.events) sum += share;
  EXPECT_NEAR(sum, 1, 1e-12);
}

TEST(BlockLight, ACubeIsAHomogeneousBlock) {
  SourceVolume volume = make_volume(ivec3(8), 0.5, [](const ivec3&) { return 1.5; });
  volume.albedo = vec3(0.7f);
  const BlockRays rays{6000, 3, -0.4f};
  const BlockLight block = follow_light(FogBlock(volume, ivec3(0), 8), rays);
  const BlockLight cube = follow_light(FogCube{1.5 * 0.5 * 8, 8, vec3(0.7f)}, rays);
  EXPECT_NEAR(block.albedo.y, cube.albedo.y, 2e-3);
  EXPECT_NEAR(block.cosine, cube.cosine, 2e-3);
  EXPECT_NEAR(block.single.y, cube.single.y, 2e-3);
}

// Thin fog: a ray is scattered with probability 1 - exp(-depth) and once, so single scattering is all there is of it.
TEST(BlockLight, SingleScatteringOfThinFogIsItsOpacity) {
  const BlockLight light = follow_light(FogCube{0.01, 1, vec3(1.0f)}, {60000, 5, 0});
  EXPECT_NEAR(light.single_if_white, -std::expm1(-0.01), 0.01 * 0.01);
  EXPECT_NEAR(light.events[0], 1, 0.01);
}

// ---- along lines

/// What a grid lets through along isotropic lines, and how that differs from the source, in the mean and as rms.
struct LineErrors {
  double mean = 0, rms = 0;
};
LineErrors line_errors(const SourceVolume& source, uint32_t level, const DensityGrid& grid) {
  const VoxelBox box{dvec3(0.0), dvec3(source.dims)};
  LineErrors errors;
  double stopped = 0;
  constexpr int kLines = 20000;
  for (uint64_t i = 0; i < kLines; ++i) {
    const VoxelRay ray = isotropic_line(box, even_coordinates(i, 99));
    const auto through = [&](const DensityGrid& in, int side) {
      double depth = 0;
      walk_cells(ray, side, ivec3(0), in.brick_dims * 8, [&](const ivec3& voxel, double t, double end) {
        const uint32_t brick = in.brick_at(voxel / 8);
        if (brick == kEmptyBrick) return true;
        const size_t n = index_in_brick(voxel);
        depth += double(in.bricks[brick][n]) * source_sigma(in, brick, n, ray.direction) * (end - t);
        return true;
      });
      return std::exp(-depth * source.voxel_size);
    };
    const double in_source = through(source, 1), error = through(grid, 1 << level) - in_source;
    errors.mean += error / kLines;
    errors.rms += error * error / kLines;
    stopped += (1 - in_source) / kLines;
  }
  return {errors.mean / stopped, std::sqrt(errors.rms)};
}

/// The densities of one of the thesis's methods as a grid.
DensityGrid downsampled(const SourceVolume& source, uint32_t level, Downsampling method) {
  const FogDownsampler downsampler(source, level, method);
  return make_volume(downsampler.dims(), std::ldexp(source.voxel_size, int(level)),
                     [&](const ivec3& v) { return double(downsampler.voxel(v).density); });
}

SourceVolume filaments() {
  return make_volume(ivec3(64), 0.1, [](const ivec3& v) {
    const bool inside = glm::length(dvec3(v) - 31.5) < 28;
    return inside && test::smooth_noise(v) > 0.62 ? 30 : 0;
  });
}

TEST(MatchedFog, LetsThroughWhatTheSourceDoes) {
  const SourceVolume source = filaments();
  for (const uint32_t level : {1u, 2u, 3u, 4u}) {
    const auto matched = matched_densities(source, level);
    ASSERT_TRUE(matched);
    const LineErrors errors = line_errors(source, level, *matched);
    EXPECT_LT(std::abs(errors.mean), 0.01) << level;
    const LineErrors transp = line_errors(source, level, downsampled(source, level, Downsampling::Transp));
    const LineErrors linear = line_errors(source, level, downsampled(source, level, Downsampling::Linear));
    EXPECT_LT(errors.rms, transp.rms) << level;
    EXPECT_LT(transp.rms, linear.rms) << level;
    EXPECT_LT(linear.mean, transp.mean - 0.01) << level;  // too opaque
  }
}

TEST(MatchedFog, LetsThroughWhatFibresDo) {
  SourceVolume source = filaments();
  add_fibres(source, true);
  for (const uint32_t level : {2u, 3u}) {
    const auto matched = matched_densities(source, level);
    ASSERT_TRUE(matched);
    ASSERT_EQ(matched->shapes.size(), matched->bricks.size());
    EXPECT_LT(std::abs(line_errors(source, level, *matched).mean), 0.01) << level;
  }
}

TEST(MatchedFog, LeavesWhatIsRight) {
  const SourceVolume source = make_volume(ivec3(32), 0.1, [](const ivec3&) { return 2; });
  const auto matched = matched_densities(source, 2);
  ASSERT_TRUE(matched);
  for (const float density : matched->bricks[0]) EXPECT_NEAR(density, 2, 0.02);
}

TEST(MatchedFog, DoesNotDependOnThreads) {
  const SourceVolume source = filaments();
  std::vector<DensityGrid> grids;
  for (const int threads : {1, 3}) {
    const ThreadLimit limit(threads);
    grids.push_back(matched_densities(source, 3).value());
  }
  EXPECT_EQ(grids[0].bricks, grids[1].bricks);
}

TEST(MatchedFog, DoesNotDependOnWhatIsInMemoryAtATime) {
  SourceVolume source = filaments();
  add_fibres(source, true);
  for (const uint32_t level : {1u, 2u}) {
    DensityGrid whole;
    for (const uint64_t region_bytes : {uint64_t{1} << 40, uint64_t{300000}, uint64_t{1}}) {
      DensityGrid grid = downsampled(source, level, Downsampling::Transp);
      grid.shapes.assign(grid.bricks.size(), source.shapes[0]);
      ASSERT_TRUE(match_fog(source, level, grid, {}, region_bytes));
      if (whole.bricks.empty())
        whole = grid;
      else
        EXPECT_EQ(grid.bricks, whole.bricks) << level << ' ' << region_bytes;
    }
  }
}

// ---- layers of cells

/// What a walk says, with the ends of the first and the last cell of each stretch of layers as they are.
std::vector<std::array<double, 5>> walked(const VoxelRay& ray, const ivec3& dims, const std::vector<int>& walls) {
  std::vector<std::array<double, 5>> all;
  for (size_t i = 0; i + 1 < walls.size(); ++i)
    walk_layers(ray, 8, dims, {walls[i], walls[i + 1]}, [&](const ivec3& cell, double enter, double leave) {
      all.push_back({double(cell.x), double(cell.y), double(cell.z), enter, leave});
    });
  return all;
}

TEST(LayerWalk, LayersOneAfterTheOtherAreAllOfThem) {
  const ivec3 dims(7, 5, 9);
  const VoxelBox box{dvec3(-3.0), dvec3(60.0, 41.0, 80.0)};  // larger than the lattice
  for (uint64_t i = 0; i < 3000; ++i) {
    VoxelRay ray = upwards(isotropic_line(box, even_coordinates(i, 7)));
    if (i % 5 == 0) ray.direction = {i % 2 == 0 ? 1 : 0, i % 2, 0};   // within a layer
    if (i % 7 == 0) ray.origin = glm::round(ray.origin / 8.0) * 8.0;  // through edges and corners
    if (i % 11 == 0) ray.direction = glm::normalize(dvec3(int(i % 3) - 1, 1, 1));
    const auto all = walked(ray, dims, {0, 9});
    EXPECT_EQ(all, walked(ray, dims, {0, 1, 2, 3, 4, 5, 6, 7, 8, 9})) << i;
    EXPECT_EQ(all, walked(ray, dims, {0, 4, 9})) << i;
    for (size_t n = 0; n < all.size(); ++n) {
      EXPECT_LT(all[n][3], all[n][4]);
      EXPECT_EQ(n == 0 ? all[0][3] : all[n - 1][4], all[n][3]);
      const dvec3 middle = ray.origin + 0.5 * (all[n][3] + all[n][4]) * ray.direction;
      for (int a = 0; a < 3; ++a) {
        EXPECT_GE(middle[a], 8 * all[n][size_t(a)] - 1e-9);
        EXPECT_LE(middle[a], 8 * all[n][size_t(a)] + 8 + 1e-9);
      }
    }
  }
}

TEST(Downsampling, NamesAreRead) {
  for (const Downsampling method : kMethods) EXPECT_EQ(parse_downsampling(name_of(method)).value(), method);
  EXPECT_EQ(parse_downsampling("matched").value(), Downsampling::Matched);
  EXPECT_NE(parse_downsampling("nearest").error().message.find("linear, transp"), std::string::npos);
}

}  // namespace
}  // namespace farfield
