// SPDX-License-Identifier: Apache-2.0
// The whole way from geometry to voxels, judged by lines that other code casts at both.
#include "prefilter/measure_volume.h"

#include <gtest/gtest.h>

#include <cmath>

#include "base/parallel.h"
#include "base/random.h"
#include "prefilter/density.h"
#include "prefilter/isotropic_lines.h"
#include "prefilter/voxelize.h"
#include "tests/support/ray_scenes.h"
#include "tests/support/surfaces.h"

namespace farfield {
namespace {

using test::leaf_cloud;
using test::LeafCloud;

SparseVolume measured(const Surface& geometry, double voxel_size, const Surface& macrosurface = {}) {
  auto volume = measure_volume(geometry, macrosurface, {dvec3(0), voxel_size}, {});
  EXPECT_TRUE(volume.has_value());
  return std::move(*volume);
}

double mean_density(const Voxel& v) { return static_cast<double>(v.density) * mean_share(v.octants); }

/// Share of isotropic lines through a box around the unit cube that are stopped: the volume's by the geometry's.
double coverage_ratio(const Surface& geometry, const SparseVolume& volume) {
  const test::MeshScene mesh(geometry);
  test::VolumeScene scene(volume);
  double of_mesh = 0, of_volume = 0;
  for (uint64_t i = 0; i < 40000; ++i) {
    const VoxelRay line = isotropic_line({dvec3(-0.2), dvec3(1.2)}, even_coordinates(i, 11));
    of_mesh += mesh.is_hit(vec3(line.origin), vec3(line.direction)) ? 1 : 0;
    of_volume += 1 - scene.transmittance(vec3(line.origin), vec3(line.direction));
  }
  return of_volume / of_mesh;
}

/// Leaves in tufts, one per cell of a grid of this many a side.
Surface tufts(int side, float tightness) {
  LeafCloud cloud;
  cloud.count = 8000, cloud.leaf_size = 0.025f;
  Surface leaves = leaf_cloud(cloud);
  for (size_t i = 0; i < leaves.positions.size(); i += 4) {  // four corners of a leaf
    const vec3 middle = 0.5f * (leaves.positions[i] + leaves.positions[i + 2]);
    const vec3 tuft = (glm::floor(static_cast<float>(side) * middle) + 0.5f) / static_cast<float>(side);
    for (size_t k = i; k < i + 4; ++k) leaves.positions[k] += tightness * (tuft - middle);
  }
  return leaves;
}

/// A closed box of quads.
Surface box(const vec3& lower, const vec3& upper) {
  Surface surface;
  for (int i = 0; i < 8; ++i)
    surface.positions.push_back({i & 1 ? upper.x : lower.x, i & 2 ? upper.y : lower.y, i & 4 ? upper.z : lower.z});
  for (const uvec4& q : {uvec4(0, 2, 3, 1), uvec4(4, 5, 7, 6), uvec4(0, 1, 5, 4), uvec4(2, 6, 7, 3), uvec4(0, 4, 6, 2),
                         uvec4(1, 3, 7, 5)}) {
    surface.triangles.emplace_back(q.x, q.y, q.z);
    surface.triangles.emplace_back(q.x, q.z, q.w);
    FaceMaterial material;
    material.diffuse = vec3(0.5f);
    material.sggx = SymMat3::outer(glm::normalize(
        glm::cross(surface.positions[q.y] - surface.positions[q.x], surface.positions[q.z] - surface.positions[q.x])));
    surface.materials.insert(surface.materials.end(), 2, material);
  }
  return surface;
}

/// Thin rods along an axis, each of four sides, at random places.
Surface fibres(const vec3& axis, int count) {
  Rng rng(5);
  Surface surface;
  const Frame frame(axis);
  for (int i = 0; i < count; ++i) {
    const vec3 middle = vec3(0.5f) + (rng.next() - 0.5f) * 0.6f * frame.x + (rng.next() - 0.5f) * 0.6f * frame.y;
    for (int side = 0; side < 4; ++side) {
      const vec3 a = side & 1 ? frame.x : frame.y, sign = vec3(side & 2 ? -1.0f : 1.0f);
      const vec3 b = side & 1 ? frame.y : frame.x;
      const auto first = static_cast<uint32_t>(surface.positions.size());
      for (const vec2 corner : {vec2(-1, -1), vec2(1, -1), vec2(1, 1), vec2(-1, 1)}) {
        surface.positions.push_back(middle + 0.004f * (sign * a + corner.x * b) + 0.3f * corner.y * axis);
      }
      surface.triangles.push_back({first, first + 1, first + 2});
      surface.triangles.push_back({first, first + 2, first + 3});
      FaceMaterial material;
      material.sggx = SymMat3::outer(a);
      surface.materials.insert(surface.materials.end(), 2, material);
    }
  }
  return surface;
}

TEST(MeasureVolume, OfNothingIsEmpty) {
  EXPECT_TRUE(measured({}, 1).voxels.empty());
  EXPECT_TRUE(measured({}, 1, box(vec3(0), vec3(1))).voxels.empty());
}

// A medium is what random leaves are: half of their one-sided area per volume, in every voxel.
TEST(MeasureVolume, OfRandomLeavesHasTheirDensity) {
  LeafCloud cloud;
  cloud.count = 20000, cloud.leaf_size = 0.012f;
  const Surface leaves = leaf_cloud(cloud);
  const SparseVolume volume = measured(leaves, 1.0 / 4);
  double area = 0;
  for (const Voxel& v : volume.voxels) area += 2 * mean_density(v) * mean_opacity(v.sggx, 1e-9, 1) / 1e-9 / 64;
  EXPECT_NEAR(area / test::total_area(leaves), 1, 0.02);
  EXPECT_NEAR(coverage_ratio(leaves, volume), 1, 0.01);
}

// Tufts let more through than a medium of their mean density: measured alone, voxels of half a tuft to two tufts are
// too opaque together by 6 to 20 %.
TEST(MeasureVolume, StopsAsManyLinesAsTuftsDo) {
  for (const double voxel_size : {1.0 / 4, 1.0 / 8}) {
    const Surface leaves = tufts(4, 0.6f);
    EXPECT_GT(coverage_ratio(leaves, *voxelize(leaves, {dvec3(0), voxel_size}, {})), 1.04);
    EXPECT_NEAR(coverage_ratio(leaves, measured(leaves, voxel_size)), 1, 0.015) << voxel_size;
  }
}

// An opaque block in an empty voxel.
TEST(MeasureVolume, StopsAsManyLinesAsOneOpaqueBlock) {
  const Surface block = box(vec3(0.3f), vec3(0.7f));
  EXPECT_NEAR(coverage_ratio(block, measured(block, 1)), 1, 0.015);
  EXPECT_NEAR(coverage_ratio(block, measured(block, 0.5)), 1, 0.015);
}

TEST(MeasureVolume, StopsAsManyLinesAsAlignedFibres) {
  for (const vec3 axis : {vec3(0, 0, 1), glm::normalize(vec3(1, 2, 3))}) {
    const Surface rods = fibres(axis, 60);
    const SparseVolume volume = measured(rods, 1.0 / 8);
    EXPECT_NEAR(coverage_ratio(rods, volume), 1, 0.02);
    for (const Voxel& v : volume.voxels) EXPECT_TRUE(std::isfinite(v.density) && v.density > 0);
  }
}

TEST(MeasureVolume, StopsAsManyLinesAsParallelPlanes) {
  Surface planes;
  for (const float z : {0.2f, 0.5f, 0.8f}) planes = test::join(planes, box({0.1f, 0.1f, z}, {0.9f, 0.9f, z + 1e-4f}));
  EXPECT_NEAR(coverage_ratio(planes, measured(planes, 1.0 / 8)), 1, 0.015);
}

// Half of the cloud in a closed box that stays a surface: the other half is seen as without it.
TEST(MeasureVolume, LooksOnlyAsFarAsTheMacrosurface) {
  LeafCloud cloud;
  cloud.count = 4000;
  const Surface leaves = leaf_cloud(cloud);
  const Surface shell = box({-0.2f, -0.2f, -0.2f}, {0.5f, 1.2f, 1.2f});
  double beside[2] = {}, inside[2] = {};
  const SparseVolume with = measured(leaves, 1.0 / 8, shell), without = measured(leaves, 1.0 / 8);
  for (int i = 0; i < 2; ++i) {
    const SparseVolume& volume = i == 0 ? without : with;
    for (const VoxelBrick& brick : volume.bricks) {
      uint64_t index = brick.first_voxel;
      for (int v = 0; v < kBrickVoxels; ++v) {
        if (!(brick.mask[static_cast<size_t>(v >> 6)] >> (v & 63) & 1)) continue;
        const int x = brick.coordinate.x * kBrickSide + (v & 7);
        (x >= 4 ? beside : inside)[i] += mean_density(volume.voxels[index++]);
      }
    }
  }
  EXPECT_NEAR(beside[1] / beside[0], 1, 0.03);
  EXPECT_NEAR(inside[1] / inside[0], 1, 0.1);  // measured alone
}

TEST(MeasureVolume, KeepsTheLocalMeasurementOfWhatNobodySees) {
  const Surface leaves = leaf_cloud({});
  const Surface shell = box(vec3(-1), vec3(2));
  const SparseVolume hidden = measured(leaves, 1.0 / 4, shell);
  const SparseVolume local = *voxelize(leaves, {dvec3(0), 1.0 / 4}, {.rays_per_voxel = 100});  // the same rays
  double of_hidden = 0, of_local = 0;
  for (const Voxel& v : hidden.voxels) of_hidden += mean_density(v);
  for (const Voxel& v : local.voxels) of_local += mean_density(v);
  EXPECT_NEAR(of_hidden / of_local, 1, 0.01);  // thinned out
}

TEST(MeasureVolume, AveragesWhatIsSeen) {
  // White leaves with black ones inside, behind enough white ones that hardly a line gets there.
  LeafCloud cloud;
  cloud.count = 30000, cloud.leaf_size = 0.05f;
  Surface leaves = leaf_cloud(cloud);
  for (size_t f = 0; f < leaves.triangles.size(); ++f) {
    const vec3& p = leaves.positions[leaves.triangles[f].x];
    const bool is_inside = min_component(p) > 0.15f && max_component(p) < 0.85f;
    leaves.materials[f].diffuse = vec3(is_inside ? 0.0f : 1.0f);
  }
  const auto mean_diffuse = [](const SparseVolume& volume) {
    double sum = 0;
    for (const Voxel& v : volume.voxels) sum += v.diffuse.x;
    return sum / double(volume.voxels.size());
  };
  EXPECT_GT(mean_diffuse(measured(leaves, 1)), mean_diffuse(*voxelize(leaves, {dvec3(0), 1}, {})) + 0.02);
}

TEST(MeasureVolume, IsTheSameForAnyNumberOfThreads) {
  Surface leaves = leaf_cloud({});
  for (size_t f = 0; f < leaves.materials.size(); f += 3) leaves.materials[f].opacity = 0.5f;
  std::vector<SparseVolume> results;
  for (const int threads : {1, 2, 4}) {
    const ThreadLimit limit(threads);
    results.push_back(
        *measure_volume(leaves, box(vec3(0.4f), vec3(0.6f)), {dvec3(0), 1.0 / 8}, {.rays_per_voxel = 20}));
  }
  for (size_t i = 1; i < results.size(); ++i) {
    ASSERT_EQ(results[i].voxels.size(), results[0].voxels.size());
    for (size_t v = 0; v < results[0].voxels.size(); ++v) {
      ASSERT_EQ(results[i].voxels[v].density, results[0].voxels[v].density);
      ASSERT_EQ(results[i].voxels[v].octants, results[0].voxels[v].octants);
      ASSERT_EQ(results[i].voxels[v].sggx, results[0].voxels[v].sggx);
      ASSERT_EQ(results[i].voxels[v].diffuse, results[0].voxels[v].diffuse);
      ASSERT_EQ(results[i].voxels[v].self_shadowing, results[0].voxels[v].self_shadowing);
    }
  }
}

// At 1e7 units floats are whole units: nothing can be right there, but all must be numbers.
TEST(MeasureVolume, GivesNumbersFarFromTheOrigin) {
  Surface leaves = leaf_cloud({});
  for (vec3& p : leaves.positions) p += vec3(1e7f);
  const auto volume = measure_volume(leaves, {}, {dvec3(1e7), 1.0 / 8}, {.rays_per_voxel = 20});
  ASSERT_TRUE(volume.has_value());
  for (const Voxel& v : volume->voxels) EXPECT_TRUE(std::isfinite(v.density) && v.density > 0);
}

TEST(MeasureVolume, StopsWhenCancelled) {
  std::atomic<bool> cancel{false};
  VolumeOptions options;
  options.job.cancel = &cancel;
  options.job.progress = [&](double done, const std::string&) { cancel = done > 0.7; };  // among the long lines
  const auto volume = measure_volume(leaf_cloud({}), {}, {dvec3(0), 1.0 / 8}, options);
  ASSERT_FALSE(volume.has_value());
  EXPECT_EQ(volume.error().code, ErrorCode::Cancelled);
}

TEST(MeasureVolume, ReportsProgressUpToTheEnd) {
  VolumeOptions options;
  options.rays_per_voxel = 20;
  double last = 0;
  options.job.progress = [&](double done, const std::string&) {
    EXPECT_GE(done, last);
    last = done;
  };
  ASSERT_TRUE(measure_volume(leaf_cloud({}), {}, {dvec3(0), 1.0 / 8}, options).has_value());
  EXPECT_NEAR(last, 1, 0.02);
}

TEST(MeasureVolume, RefusesSenselessOptions) {
  EXPECT_EQ(measure_volume(leaf_cloud({}), {}, {dvec3(0), 0}, {}).error().code, ErrorCode::InvalidArgument);
  EXPECT_EQ(measure_volume(leaf_cloud({}), {}, {dvec3(0), 1}, {.rays_per_voxel = 0}).error().code,
            ErrorCode::InvalidArgument);
}

}  // namespace
}  // namespace farfield
