// SPDX-License-Identifier: Apache-2.0
#include "prefilter/voxelize.h"

#include <gtest/gtest.h>

#include <cmath>
#include <tuple>

#include "base/parallel.h"
#include "base/random.h"
#include "prefilter/density.h"
#include "prefilter/thin_out.h"
#include "tests/support/random_unit.h"
#include "tests/support/ray_scenes.h"
#include "tests/support/surfaces.h"

namespace farfield {
namespace {

using test::leaf_cloud;
using test::LeafCloud;
using test::random_unit;
using test::total_area;

VoxelLattice lattice_of(double voxel_size) { return {dvec3(0), voxel_size}; }

SparseVolume voxelized(const Surface& geometry, double voxel_size, uint32_t rays = 200) {
  VoxelizeOptions options;
  options.rays_per_voxel = rays;
  auto volume = voxelize(geometry, lattice_of(voxel_size), options);
  EXPECT_TRUE(volume.has_value());
  return std::move(*volume);
}

/// Flake area: rho R_G(S) is half of the one-sided area per volume (docs/theory.md, section 1).
double flake_area(const SparseVolume& volume) {
  double sum = 0;
  for (const Voxel& v : volume.voxels) {
    // R_G(S), the mean of sigma, is the slope of the opacity of a very thin medium.
    sum += v.density * mean_opacity(v.sggx, 1e-9, 1.0) / 1e-9;
  }
  return 2 * sum * std::pow(volume.lattice.voxel_size, 3);
}

TEST(Voxelize, OfNothingIsEmpty) {
  const auto volume = voxelize({}, lattice_of(1), {});
  ASSERT_TRUE(volume.has_value());
  EXPECT_TRUE(volume->bricks.empty());
  EXPECT_TRUE(volume->voxels.empty());
}

TEST(Voxelize, RefusesSenselessOptions) {
  const Surface cloud = leaf_cloud({});
  EXPECT_EQ(voxelize(cloud, lattice_of(0), {}).error().code, ErrorCode::InvalidArgument);
  EXPECT_EQ(voxelize(cloud, lattice_of(std::nan("")), {}).error().code, ErrorCode::InvalidArgument);
  VoxelizeOptions no_rays;
  no_rays.rays_per_voxel = 0;
  EXPECT_EQ(voxelize(cloud, lattice_of(1), no_rays).error().code, ErrorCode::InvalidArgument);
  EXPECT_EQ(voxelize(cloud, lattice_of(1e-9), {}).error().code, ErrorCode::InvalidArgument);
}

TEST(Voxelize, OfASparseCloudKeepsItsTotalArea) {
  // Rays of one voxel see almost no leaf behind another, so extinction adds up to half the leaves' one-sided area.
  // 4000 leaves in 16^3 voxels, seed in leaf_cloud: 0.2 % of noise from 10^5 hits; 2 % allowed for blurred overlaps.
  for (const float flatness : {0.0f, 1.0f}) {
    LeafCloud cloud;
    cloud.leaf_size = 0.012f;
    cloud.flatness = flatness;
    const Surface leaves = leaf_cloud(cloud);
    const double area = total_area(leaves);
    EXPECT_NEAR(flake_area(voxelized(leaves, 1.0 / 16)) / area, 1, 0.02) << "flatness " << flatness;
  }
}

TEST(Voxelize, FacesCountByTheirOpacity) {
  LeafCloud cloud;
  cloud.leaf_size = 0.012f;
  Surface leaves = leaf_cloud(cloud);
  for (FaceMaterial& material : leaves.materials) material.opacity = 0.3f, material.emission = {8, 4, 2};
  const SparseVolume volume = voxelized(leaves, 1.0 / 16);
  EXPECT_NEAR(flake_area(volume) / total_area(leaves), 0.3, 0.01);
  for (const Voxel& v : volume.voxels) EXPECT_NEAR(v.emission.x, 8, 1e-3f);
}

TEST(EstimateVolume, IsAboutWhatIsStored) {
  VoxelizeOptions options;
  options.rays_per_voxel = 20;
  const Surface leaves = leaf_cloud({});
  const auto size = estimate_volume(leaves, lattice_of(1.0 / 96), options);
  const auto volume = voxelize(leaves, lattice_of(1.0 / 96), options);
  const SparseVolume kept = thin_out(*volume, 0);
  EXPECT_NEAR(double(size->voxels) / double(kept.voxels.size()), 1, 0.1);
  EXPECT_NEAR(double(size->bricks) / double(kept.bricks.size()), 1, 0.1);
}

TEST(EstimateVolume, DoesNotBotherWithSmallOnes) {
  const Surface leaves = leaf_cloud({});
  EXPECT_EQ(estimate_volume(leaves, lattice_of(1.0 / 8), {})->voxels, 0u);
  EXPECT_EQ(estimate_volume({}, lattice_of(1), {})->voxels, 0u);
  EXPECT_FALSE(estimate_volume(leaves, lattice_of(-1), {}).has_value());
}

TEST(Voxelize, LetsAsMuchLightThroughAsTheLeavesDo) {
  // Random rays through the cloud: transmittance of the volume against the share of rays that miss all leaves.
  // 20000 rays each: standard error 0.0035. A dense cloud, optical depth about 1.5 across.
  for (const float flatness : {0.0f, 1.0f}) {
    LeafCloud cloud;
    cloud.leaf_size = 0.025f;
    cloud.count = 5000;
    cloud.flatness = flatness;
    const Surface leaves = leaf_cloud(cloud);
    for (const double side : {8.0, 16.0, 32.0}) {
      const SparseVolume volume = voxelized(leaves, 1 / side);
      Rng rng(11);
      double through_mesh = 0, through_volume = 0;
      constexpr int kRays = 20000;
      const test::MeshScene mesh(leaves);
      test::VolumeScene scene(volume);
      for (int i = 0; i < kRays; ++i) {
        const vec3 direction = random_unit(rng);
        const vec3 target(rng.next(), rng.next(), rng.next());
        through_mesh += mesh.is_hit(target - 3.0f * direction, direction) ? 0 : 1;
        through_volume += scene.transmittance(target - 3.0f * direction, direction);
      }
      // The kernel blurs the cloud's sharp faces over a voxel and a half: a bias that falls with the voxel size.
      EXPECT_NEAR(through_volume / kRays, through_mesh / kRays, 0.008 + 0.2 / side)
          << "flatness " << flatness << " side " << side;
    }
  }
}

TEST(Voxelize, FindsTheNormalsAndColoursOfWhatItHits) {
  LeafCloud cloud;
  cloud.flatness = 1;  // all normals along z
  Surface leaves = leaf_cloud(cloud);
  for (FaceMaterial& m : leaves.materials) {
    m.diffuse = vec3(0.1f, 0.5f, 0.2f);
    m.transmission = vec3(0.0f, 0.25f, 0.0f);
  }
  for (const Voxel& v : voxelized(leaves, 1.0 / 8).voxels) {
    EXPECT_NEAR(v.sggx.zz, 1, 1e-5);
    EXPECT_NEAR(v.sggx.xx + v.sggx.yy, 0, 1e-5);
    EXPECT_NEAR(v.diffuse.y, 0.5f, 1e-6f);
    EXPECT_NEAR(v.transmission.y, 0.5f * v.diffuse.y, 1e-6f);
    EXPECT_EQ(v.specular, vec3(0));
    EXPECT_EQ(v.roughness2, 1.0f);
  }
}

TEST(Voxelize, WeighsRoughnessByTheLobeThatHasIt) {
  Surface leaves = leaf_cloud({});
  for (size_t i = 0; i < leaves.materials.size(); ++i) {  // two triangles per leaf: every second leaf is glossy
    const bool glossy = i / 2 % 2 == 0;
    leaves.materials[i].specular = vec3(glossy ? 0.04f : 0.0f);
    leaves.materials[i].roughness2 = glossy ? 0.01f : 0.9f;
  }
  double specular = 0, weight = 0;
  for (const Voxel& v : voxelized(leaves, 1.0 / 8).voxels) {
    if (v.specular.x > 0) {
      EXPECT_NEAR(v.roughness2, 0.01f, 1e-6f);
    }
    specular += v.specular.x * v.density, weight += v.density;
  }
  EXPECT_NEAR(specular / weight, 0.02, 0.002);
}

TEST(Voxelize, IsTheSameForAnyNumberOfThreads) {
  const Surface leaves = leaf_cloud({});
  std::vector<SparseVolume> results;
  for (const int threads : {1, 2, 4}) {
    const ThreadLimit limit(threads);
    results.push_back(voxelized(leaves, 1.0 / 16, 50));
  }
  for (size_t i = 1; i < results.size(); ++i) {
    ASSERT_EQ(results[i].voxels.size(), results[0].voxels.size());
    ASSERT_EQ(results[i].bricks.size(), results[0].bricks.size());
    for (size_t v = 0; v < results[0].voxels.size(); ++v) {
      ASSERT_EQ(results[i].voxels[v].density, results[0].voxels[v].density);
      ASSERT_EQ(results[i].voxels[v].sggx, results[0].voxels[v].sggx);
      ASSERT_EQ(results[i].voxels[v].diffuse, results[0].voxels[v].diffuse);
    }
    for (size_t b = 0; b < results[0].bricks.size(); ++b) {
      ASSERT_EQ(results[i].bricks[b].coordinate, results[0].bricks[b].coordinate);
      ASSERT_EQ(results[i].bricks[b].mask, results[0].bricks[b].mask);
    }
  }
}

TEST(Voxelize, PartsGiveTogetherWhatTheWholeGives) {
  const Surface leaves = leaf_cloud({});
  const VoxelLattice lattice{dvec3(0), 1.0 / 32};
  const auto whole = voxelize(leaves, lattice, {});
  ASSERT_TRUE(whole);
  const uint64_t count = candidate_bricks(leaves, lattice);
  ASSERT_GT(count, 8u);
  size_t brick = 0, voxel = 0;
  for (const BrickRange range : {BrickRange{0, 5}, {5, count - 7}, {count - 2, ~uint64_t{0}}, {count, 3}}) {
    const auto part = voxelize(leaves, lattice, {.bricks = range});
    ASSERT_TRUE(part);
    for (const VoxelBrick& of_part : part->bricks) {
      ASSERT_LT(brick, whole->bricks.size());
      EXPECT_EQ(of_part.coordinate, whole->bricks[brick].coordinate);
      EXPECT_EQ(of_part.mask, whole->bricks[brick].mask);
      ++brick;
    }
    for (const Voxel& of_part : part->voxels) {
      ASSERT_LT(voxel, whole->voxels.size());
      EXPECT_EQ(of_part.density, whole->voxels[voxel].density);
      EXPECT_EQ(of_part.diffuse, whole->voxels[voxel].diffuse);
      ++voxel;
    }
  }
  EXPECT_EQ(brick, whole->bricks.size());
  EXPECT_EQ(voxel, whole->voxels.size());
}

TEST(Voxelize, SortsItsBricksAndFillsEach) {
  const SparseVolume volume = voxelized(leaf_cloud({}), 1.0 / 32);
  uint64_t next = 0;
  for (size_t b = 0; b < volume.bricks.size(); ++b) {
    const VoxelBrick& brick = volume.bricks[b];
    EXPECT_EQ(brick.first_voxel, next);
    uint64_t stored = 0;
    for (const uint64_t word : brick.mask) stored += static_cast<uint64_t>(__builtin_popcountll(word));
    EXPECT_GT(stored, 0u);
    next += stored;
    if (b == 0) continue;
    const ivec3 &p = volume.bricks[b - 1].coordinate, &c = brick.coordinate;
    EXPECT_TRUE(std::tie(p.z, p.y, p.x) < std::tie(c.z, c.y, c.x));
  }
  EXPECT_EQ(next, volume.voxels.size());
  for (const Voxel& v : volume.voxels) EXPECT_TRUE(v.density > 0 && std::isfinite(v.density));
}

TEST(Voxelize, MissesNoHitsBeyondItsReach) {
  // The same triangle with candidates of a lattice twice and four times as fine covers all that a coarse voxel could
  // see; what the reach cuts off must not show in the extinction of a plane: mean opacity integrates to 1/2 per side.
  Surface plane;
  plane.positions = {vec3(-40, -40, 0.3f), vec3(40, -40, 0.3f), vec3(0, 60, 0.3f)};
  plane.triangles = {uvec3(0, 1, 2)};
  plane.materials.resize(1);
  plane.materials[0].sggx = SymMat3::outer(vec3(0, 0, 1));
  const SparseVolume volume = voxelized(plane, 1.0, 400);
  // A ray of length 1 from a height that is anywhere crosses the plane with probability E|cos| = 1/2 per unit height.
  // Sum the opacity (not the density: its log is not linear) over the voxels of columns near the middle.
  double opacity = 0;
  int columns = 0;
  for (const VoxelBrick& brick : volume.bricks) {
    uint64_t index = brick.first_voxel;
    for (int i = 0; i < kBrickVoxels; ++i) {
      if (!(brick.mask[static_cast<size_t>(i >> 6)] >> (i & 63) & 1)) continue;
      const Voxel& voxel = volume.voxels[index++];
      const ivec3 c = brick.coordinate * kBrickSide + ivec3(i & 7, i >> 3 & 7, i >> 6);
      if (std::abs(c.x) > 10 || std::abs(c.y) > 10) continue;
      opacity += mean_opacity(voxel.sggx, voxel.density, 1.0);
      columns += c.z == 0;
    }
  }
  EXPECT_EQ(columns, 21 * 21);
  EXPECT_NEAR(opacity / columns, 0.5, 0.003);  // about 44000 hits: standard error 0.0018
}

TEST(Voxelize, MeasuresTheSameFarFromTheOrigin) {
  // 1000 units out at 1/16 a unit per voxel: positions keep 2^-14 of a unit, a thousandth of a voxel.
  Surface leaves = leaf_cloud({});
  const double area = total_area(leaves);
  for (vec3& p : leaves.positions) p += vec3(1000, -1000, 1000);
  EXPECT_NEAR(flake_area(voxelized(leaves, 1.0 / 16)) / area, 1, 0.03);
}

TEST(Voxelize, GivesANearlyOpaqueVoxelAFiniteDensity) {
  LeafCloud cloud;
  cloud.count = 60000;
  cloud.leaf_size = 0.25f;
  for (const Voxel& v : voxelized(leaf_cloud(cloud), 1.0).voxels) {
    EXPECT_TRUE(std::isfinite(v.density));
    EXPECT_LE(v.density, kMaxDensityLength);
  }
}

TEST(Voxelize, StopsWhenCancelled) {
  std::atomic<bool> cancel{false};
  VoxelizeOptions options;
  options.job.cancel = &cancel;
  int calls = 0;
  options.job.progress = [&](double done, const std::string&) {
    EXPECT_GT(done, 0);
    EXPECT_LT(done, 1);
    ++calls;
    cancel = true;
  };
  const auto volume = voxelize(leaf_cloud({}), lattice_of(1.0 / 64), options);
  ASSERT_FALSE(volume.has_value());
  EXPECT_EQ(volume.error().code, ErrorCode::Cancelled);
  EXPECT_GE(calls, 1);
}

TEST(Voxelize, ReportsProgressUpToTheEnd) {
  VoxelizeOptions options;
  double last = 0;
  options.job.progress = [&](double done, const std::string&) {
    EXPECT_GE(done, last);
    last = done;
  };
  ASSERT_TRUE(voxelize(leaf_cloud({}), lattice_of(1.0 / 16), options).has_value());
  EXPECT_EQ(last, 1);
}

}  // namespace
}  // namespace farfield
