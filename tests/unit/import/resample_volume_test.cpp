// SPDX-License-Identifier: Apache-2.0
#include "import/resample_volume.h"

#include <gtest/gtest.h>

#include <atomic>
#include <cmath>

#include "base/parallel.h"
#include "tests/support/volumes.h"

namespace farfield {
namespace {

using test::density_at;

double cloud(const ivec3& v) {
  const double inside = 1 - glm::length((dvec3(v) - 11.5) / 12.0);
  return std::max(0.0, inside * test::smooth_noise(v));
}

VoxelShape shape_of(const dvec3& x, const dvec3& y, const dvec3& z) { return voxel_shape({x, y, z}); }
VoxelShape sheared_shape() { return shape_of({0.5, 0, 0}, {0.2, 0.6, 0}, {-0.1, 0.3, 0.7}); }

SourceVolume resampled(const SourceVolume& volume, const VoxelShape& shape) {
  auto cubes = resample_to_cubes(volume, shape);
  EXPECT_TRUE(cubes) << cubes.error().message;
  return cubes ? std::move(*cubes) : SourceVolume();
}

double sum_of(const SourceVolume& volume) {
  double sum = 0;
  for (const uint32_t brick : volume.brick_table) {
    if (brick == kEmptyBrick) continue;
    for (const float density : volume.bricks[brick]) sum += static_cast<double>(density);
  }
  return sum;
}

TEST(ResampleVolume, EdgesThatAreMultiplesAreExact) {
  const SourceVolume volume = test::make_volume(ivec3(24), 1, cloud);
  const VoxelShape shape = shape_of({0.25, 0, 0}, {0, 0.5, 0}, {0, 0, 0.75});
  const SourceVolume cubes = resampled(volume, shape);
  ASSERT_EQ(cubes.dims, volume.dims * ivec3(1, 2, 3));
  EXPECT_EQ(cubes.voxel_size, 0.25);
  EXPECT_EQ(cubes.active_voxels, 6 * volume.active_voxels);
  ivec3 v;
  for (v.z = 0; v.z < cubes.dims.z; ++v.z)
    for (v.y = 0; v.y < cubes.dims.y; ++v.y)
      for (v.x = 0; v.x < cubes.dims.x; ++v.x) ASSERT_EQ(density_at(cubes, v), density_at(volume, v / ivec3(1, 2, 3)));
}

// The mean optical depth of all lines of one direction is the sum of density times volume by the area they pass.
TEST(ResampleVolume, MeanOpticalDepthsAreKept) {
  const SourceVolume volume = test::make_volume(ivec3(24), 1, cloud);
  for (const VoxelShape& shape : {shape_of({1, 0, 0}, {0, 1.37, 0}, {0, 0, 2.9}), sheared_shape()}) {
    const SourceVolume cubes = resampled(volume, shape);
    const double kept = sum_of(cubes) * std::pow(shape.size, 3) / (sum_of(volume) * glm::determinant(shape.edges));
    EXPECT_NEAR(kept, 1, 1e-7);
    uint64_t active = 0;
    for (const uint32_t brick : cubes.brick_table)
      for (int i = 0; brick != kEmptyBrick && i < kVolumeBrickVoxels; ++i) active += cubes.bricks[brick][i] > 0;
    EXPECT_EQ(cubes.active_voxels, active);
  }
}

// Line by line, in the smooth cloud: what is left of a line's error is that of means over cubes as wide as voxels.
TEST(ResampleVolume, LinesAreNearlyWhatTheyWere) {
  const SourceVolume volume = test::make_volume(ivec3(24), 1, cloud);
  const VoxelShape shape = sheared_shape();
  const SourceVolume cubes = resampled(volume, shape);
  const glm::dmat3 to_index = glm::inverse(shape.rotation * shape.edges), to_cubes = glm::transpose(cubes.rotation);
  const dvec3 middle = shape.rotation * (shape.edges * dvec3(12)), direction = glm::normalize(dvec3(0.3, 0.5, 0.8));
  double error = 0, bias = 0, mean = 0;
  for (int i = 0; i < 25; ++i) {
    const dvec3 through = middle + 0.6 * dvec3(i % 5 - 2, 0, i / 5 - 2);
    double was = 0, is = 0;
    for (double t = -12; t < 12; t += 0.01) {
      const dvec3 p = through + t * direction;
      was += 0.01 * static_cast<double>(density_at(volume, ivec3(glm::floor(to_index * p))));
      is += 0.01 *
            static_cast<double>(density_at(cubes, ivec3(glm::floor(to_cubes * (p - cubes.origin) / cubes.voxel_size))));
    }
    error += std::abs(was - is) / 25;
    bias += (is - was) / 25;
    mean += was / 25;
  }
  EXPECT_GT(mean, 0.5);
  EXPECT_LT(error, 0.02 * mean);
  EXPECT_LT(std::abs(bias), 0.01 * mean);
}

TEST(ResampleVolume, EvenFogStaysEven) {
  const SourceVolume even = test::make_volume(ivec3(40), 1, [](const ivec3&) { return 2.0; });
  const VoxelShape shape = sheared_shape();
  const SourceVolume cubes = resampled(even, shape);
  for (int i = 0; i < 8; ++i) {
    const dvec3 point = shape.edges * (8.0 + 24.0 * dvec3(i & 1, i >> 1 & 1, i >> 2));
    const dvec3 lower = glm::transpose(cubes.rotation) * cubes.origin;
    EXPECT_NEAR(density_at(cubes, ivec3(glm::floor((point - lower) / cubes.voxel_size))), 2, 2e-3);
  }
}

TEST(ResampleVolume, TilesStillShareBricks) {
  SourceVolume tile = test::make_volume(ivec3(8), 1, [](const ivec3&) { return 0.5; });
  tile.dims = ivec3(128);
  tile.brick_dims = ivec3(16);
  tile.brick_table.assign(size_t{16} * 16 * 16, 0);
  tile.active_voxels = uint64_t{128} * 128 * 128;
  const SourceVolume cubes = resampled(tile, shape_of({1, 0, 0}, {0, 1, 0}, {0, 0, 3}));
  EXPECT_EQ(cubes.dims, ivec3(128, 128, 384));
  EXPECT_EQ(cubes.active_voxels, 3 * tile.active_voxels);
  EXPECT_EQ(cubes.filled_bricks, 3u * 16 * 16 * 16);
  EXPECT_LT(cubes.bricks.size(), cubes.filled_bricks / 2);  // those at the border are their own
}

TEST(ResampleVolume, AlbedosAreWeightedByDensity) {
  SourceVolume volume = test::make_volume(ivec3(2, 1, 1), 1, [](const ivec3& v) { return v.x == 0 ? 1.0 : 3.0; });
  volume.albedos.resize(1);
  volume.albedos[0][0] = {0, 65535, 6553};
  volume.albedos[0][1] = {65535, 65535, 13107};
  const SourceVolume cubes = resampled(volume, shape_of({1.5, 0, 0}, {0, 1, 0}, {0, 0, 1}));
  ASSERT_EQ(cubes.dims, ivec3(3, 1, 1));
  EXPECT_EQ(density_at(cubes, {1, 0, 0}), 2.0f);  // half of either
  const vec3 albedo = unpack_albedo(cubes.albedos[0][1]);
  EXPECT_NEAR(albedo.x, 0.75, 1e-4);
  EXPECT_EQ(albedo.y, 1.0f);
  EXPECT_NEAR(albedo.z, 0.175, 1e-4);
}

TEST(ResampleVolume, KeepsShapesAndPhaseFunctions) {
  SourceVolume volume = test::make_volume(ivec3(2, 1, 1), 1, [](const ivec3&) { return 1.0; });
  volume.shapes.resize(1);
  volume.anisotropies.resize(1);
  volume.self_shadowing.resize(1);
  volume.shapes[0][0] = {0.5f, 0.25f, 0.25f, 0.1f, 0, 0};
  volume.shapes[0][1] = {0.25f, 0.5f, 0.25f, 0.1f, 0, 0};
  volume.anisotropies[0][0] = 0.5f, volume.self_shadowing[0][0] = volume.self_shadowing[0][1] = 0.75f;
  const SourceVolume cubes = resampled(volume, shape_of({1.5, 0, 0}, {0, 1, 0}, {0, 0, 1}));
  EXPECT_EQ(cubes.shapes[0][0], volume.shapes[0][0]);
  EXPECT_NEAR(cubes.shapes[0][1][0], 0.375f, 1e-6f);
  EXPECT_NEAR(cubes.shapes[0][1][3], 0.1f, 1e-6f);
  EXPECT_NEAR(cubes.anisotropies[0][1], 0.25f, 1e-6f);
  EXPECT_NEAR(cubes.self_shadowing[0][2], 0.75f, 1e-6f);
}

TEST(ResampleVolume, FlakesAreMeansWeightedByDensity) {
  SourceVolume volume = test::make_volume(ivec3(2, 1, 1), 1, [](const ivec3& v) { return v.x == 0 ? 1.0 : 3.0; });
  SourceFlakes& flakes = volume.flakes.emplace();
  flakes.diffuse.resize(1), flakes.emission.resize(1), flakes.roughness.resize(1), flakes.octants.resize(1);
  flakes.diffuse[0][0] = vec3(1, 0.5f, 0), flakes.diffuse[0][1] = vec3(0, 0.5f, 1);
  flakes.emission[0][1] = vec3(8.0f);
  flakes.roughness[0][0] = 1;
  flakes.hot_spot = 0.25f, flakes.highlight_lean = 0.125f, flakes.open_side = vec3(0, 0.1f, 0);
  const SourceVolume cubes = resampled(volume, shape_of({1.5, 0, 0}, {0, 1, 0}, {0, 0, 1}));
  ASSERT_TRUE(cubes.flakes);
  ASSERT_EQ(cubes.flakes->diffuse.size(), cubes.bricks.size());
  EXPECT_EQ(cubes.flakes->diffuse[0][0], flakes.diffuse[0][0]);
  EXPECT_LT(glm::distance(cubes.flakes->diffuse[0][1], vec3(0.25f, 0.5f, 0.75f)), 1e-6f);  // the one between
  EXPECT_LT(glm::distance(cubes.flakes->emission[0][1], vec3(6.0f)), 1e-5f);
  EXPECT_NEAR(cubes.flakes->roughness[0][1], 0.25f, 1e-6f);
  EXPECT_TRUE(cubes.flakes->specular.empty() && cubes.flakes->transmission.empty() && cubes.flakes->octants.empty());
  EXPECT_EQ(cubes.flakes->hot_spot, 0.25f);
  EXPECT_EQ(cubes.flakes->highlight_lean, 0.125f);
  EXPECT_EQ(cubes.flakes->open_side, flakes.open_side);
}

TEST(ResampleVolume, DoesNotDependOnThreads) {
  const SourceVolume volume = test::make_volume(ivec3(24), 1, cloud);
  const auto with = [&](int threads) {
    const ThreadLimit limit(threads);
    return resampled(volume, sheared_shape());
  };
  const SourceVolume one = with(1), three = with(3);
  EXPECT_EQ(one.brick_table, three.brick_table);
  EXPECT_EQ(one.bricks, three.bricks);
}

TEST(ResampleVolume, StopsWhenTold) {
  const std::atomic<bool> cancel{true};
  Job job;
  job.cancel = &cancel;
  const auto cubes = resample_to_cubes(test::make_volume(ivec3(24), 1, cloud), sheared_shape(), job);
  ASSERT_FALSE(cubes);
  EXPECT_EQ(cubes.error().code, ErrorCode::Cancelled);
}

}  // namespace
}  // namespace farfield
