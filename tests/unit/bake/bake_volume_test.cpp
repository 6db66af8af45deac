// SPDX-License-Identifier: Apache-2.0
#include "bake/bake_volume.h"

#include <gtest/gtest.h>

#include <cmath>

#include "bake/bake.h"
#include "bake/pack_fog.h"
#include "base/parallel.h"
#include "cache/level_file.h"
#include "cache/level_values.h"
#include "cache/verify.h"
#include "import/read_volume.h"
#include "tests/support/files.h"
#include "tests/support/optical_depth.h"
#include "tests/support/random_unit.h"
#include "tests/support/vdb_files.h"
#include "tests/support/volumes.h"

namespace farfield {
namespace {

namespace fs = std::filesystem;
using test::VdbGrid;

double cloud(const ivec3& v) {
  const double inside = 1 - glm::length(dvec3(v) - 19.5) / 19;
  return std::max(0.0, 3 * inside * (test::smooth_noise(v) - 0.2));
}

VdbGrid cloud_grid(const ivec3& lower = {-7, 3, 11}) {
  VdbGrid grid;
  grid.voxels = test::filled_cube(lower, 40, cloud);
  return grid;
}

class BakeVolume : public testing::Test {
 protected:
  fs::path write(const std::string& name, const VdbGrid& grid) const {
    const fs::path path = folder_.path() / name;
    test::write_vdb(path, {grid});
    return path;
  }
  BakeReport bake_to(const fs::path& source, const fs::path& out, const BakeOptions& options = {}) const {
    const auto report = bake(source, out, options);
    EXPECT_TRUE(report) << report.error().message;
    return report.value_or(BakeReport());
  }
  static std::vector<std::byte> level_bytes(const fs::path& asset, const LevelEntry& entry) {
    return test::read_bytes(asset / entry.file);
  }

  const test::TemporaryFolder folder_;
};

TEST_F(BakeVolume, GivesAnAssetLikeAnyOther) {
  const fs::path source = write("cloud.vdb", cloud_grid()), out = folder_.path() / "cloud.farfield";
  const BakeReport report = bake_to(source, out);
  ASSERT_EQ(report.manifest.levels.size(), 4u);  // 38 voxels, then 19, 10, 5
  EXPECT_EQ(report.manifest.levels[0].level, 0u);
  EXPECT_EQ(report.manifest.levels[3].grid, 5u);
  EXPECT_EQ(report.manifest.base_resolution, 1.0);
  EXPECT_EQ(report.manifest.warnings.size(), 1u);
  EXPECT_EQ(report.manifest.warnings[0].find("cloud.vdb"), 0u);  // without its folder
  const VerifyResult verified = verify_asset(out);
  EXPECT_TRUE(verified.is_sound());
  EXPECT_TRUE(verified.findings.empty());
  EXPECT_TRUE(bake_to(source, out).up_to_date);
  BakeOptions options;
  options.import.fog.density_scale = 2;
  EXPECT_FALSE(bake_to(source, out, options).up_to_date);
  options.downsampling = Downsampling::Linear;
  EXPECT_FALSE(bake_to(source, out, options).up_to_date);
  EXPECT_TRUE(bake_to(source, out, options).up_to_date);
}

TEST_F(BakeVolume, TheSourceAloneIsLevelZero) {
  const fs::path source = write("cloud.vdb", cloud_grid());
  BakeOptions options;
  const fs::path whole = folder_.path() / "whole.farfield", alone = folder_.path() / "alone.farfield";
  const BakeReport all = bake_to(source, whole);
  options.source_only = true;
  const BakeReport first = bake_to(source, alone, options);
  ASSERT_EQ(first.manifest.levels.size(), 1u);
  EXPECT_EQ(first.manifest.levels[0].file_hash, all.manifest.levels[0].file_hash);
}

TEST_F(BakeVolume, BytesDoNotDependOnThreadsNorOnWhereTheGridLies) {
  VdbGrid turned = cloud_grid({100, -200, 33});
  const double angle = 0.4;
  turned.index_to_source = glm::dmat4(glm::dmat3(dvec3(std::cos(angle), 0, std::sin(angle)), dvec3(0, 1, 0),
                                                 dvec3(-std::sin(angle), 0, std::cos(angle))));
  turned.index_to_source[3] = glm::dvec4(5, -3, 8, 1);
  const fs::path a = folder_.path() / "a.farfield", b = folder_.path() / "b.farfield";
  Manifest first, second;
  {
    const ThreadLimit limit(1);
    first = bake_to(write("cloud.vdb", cloud_grid()), a).manifest;
  }
  {
    const ThreadLimit limit(3);
    second = bake_to(write("turned.vdb", turned), b).manifest;
  }
  ASSERT_EQ(first.levels.size(), second.levels.size());
  for (size_t i = 0; i < first.levels.size(); ++i)
    EXPECT_EQ(level_bytes(a, first.levels[i]), level_bytes(b, second.levels[i])) << i;
  EXPECT_EQ(first.rotation, glm::dmat3(1.0));
  EXPECT_NEAR(second.rotation[0].z, std::sin(angle), 1e-12);
  const auto read = read_manifest(b);
  ASSERT_TRUE(read);
  EXPECT_EQ(read->rotation, second.rotation);
}

/// What 200 rays say of level 0 and of its file.
struct MarchedRays {
  double mean = 0;           ///< transmittance of the file
  double bias = 0;           ///< of level 0's
  double mean_error = 0;     ///< mean of absolute differences
  double largest_error = 0;  ///< of them
};

/// An independent way from a file to a transmittance: OpenVDB's sampler, in small steps.
MarchedRays march(const fs::path& source, double scale, int steps) {
  FogOptions options;
  options.density_scale = scale;
  const SourceVolume volume = read_volume(source, options).value();
  const LevelData level = copy_of(view_of(pack_source_fog(volume).value()));
  std::vector<test::VdbRay> rays;
  Rng rng(5);
  const dvec3 middle = volume.origin + 0.5 * volume.voxel_size * (volume.rotation * dvec3(volume.dims));
  for (int i = 0; i < 200; ++i) {
    const dvec3 through = middle + 4.0 * (dvec3(rng.next(), rng.next(), rng.next()) - 0.5);
    const dvec3 direction(glm::normalize(dvec3(test::random_unit(rng))));
    rays.push_back({through - 10.0 * direction, direction, 20});
  }
  const std::vector<double> marched = test::march_vdb(source, rays, scale, steps);
  const glm::dmat3 to_local = glm::transpose(volume.rotation);
  const auto count = static_cast<double>(rays.size());
  MarchedRays out;
  for (size_t i = 0; i < rays.size(); ++i) {
    const vec3 local(to_local * (rays[i].origin - volume.origin)), direction(to_local * rays[i].direction);
    const double ours = std::exp(-test::optical_depth(level, local, direction, 20, steps));
    out.mean += marched[i] / count;
    out.bias += (ours - marched[i]) / count;
    out.mean_error += std::abs(ours - marched[i]) / count;
    out.largest_error = std::max(out.largest_error, std::abs(ours - marched[i]));
  }
  return out;
}

TEST_F(BakeVolume, LevelZeroLetsThroughWhatOpenVdbSays) {
  VdbGrid grid = cloud_grid();
  grid.index_to_source = glm::dmat4(glm::dmat3(0.25));
  const MarchedRays rays = march(write("cloud.vdb", grid), 0.17, 40000);
  EXPECT_LT(rays.largest_error, 2e-3);
  EXPECT_LT(rays.mean_error, 1e-3 * rays.mean);
  EXPECT_GT(rays.mean, 0.05);
  EXPECT_LT(rays.mean, 0.95);
}

// Cubes have the mean of the voxels that they lie in, so lines are a little off each and right together.
TEST_F(BakeVolume, AStretchedOrShearedGridLetsThroughWhatOpenVdbSays) {
  const double c = std::cos(0.4), s = std::sin(0.4);
  const glm::dmat3 turn(dvec3(c, 0, s), dvec3(0, 1, 0), dvec3(-s, 0, c));
  const glm::dmat3 stretch(dvec3(0.2, 0, 0), dvec3(0, 0.25, 0), dvec3(0, 0, 0.33));
  const glm::dmat3 shear(dvec3(0.25, 0, 0), dvec3(0.1, 0.25, 0), dvec3(-0.08, 0.06, 0.25));
  for (const glm::dmat3& matrix : {turn * stretch, turn * shear}) {
    VdbGrid grid = cloud_grid();
    grid.index_to_source = glm::dmat4(matrix);
    grid.index_to_source[3] = glm::dvec4(7, -9, 2, 1);
    const MarchedRays rays = march(write("cloud.vdb", grid), 0.17, 8000);
    EXPECT_LT(rays.largest_error, 0.04);
    EXPECT_LT(rays.mean_error, 0.01 * rays.mean);
    EXPECT_LT(std::abs(rays.bias), 2e-3 * rays.mean);
    EXPECT_GT(rays.mean, 0.05);
    EXPECT_LT(rays.mean, 0.95);
  }
}

TEST_F(BakeVolume, OnlyTheChannelsThatAreNeededAreStored) {
  SourceVolume volume = test::make_volume(ivec3(40), 1, cloud);
  const FogLevel grey = pack_source_fog(volume).value();
  EXPECT_TRUE(grey.voxel_albedo.empty() && grey.voxel_self_shadowing.empty() && grey.voxel_sggx.empty() &&
              grey.voxel_anisotropy.empty());
  const FogLevel white = pack_fog(volume, 2, Downsampling::Iso).value();
  EXPECT_TRUE(white.voxel_albedo.empty() && white.voxel_self_shadowing.empty());
  volume.albedo = vec3(0.5f);
  const FogLevel darker = pack_fog(volume, 2, Downsampling::Iso).value();
  EXPECT_EQ(darker.voxel_self_shadowing.size(), voxel_count(darker));
  EXPECT_TRUE(darker.voxel_albedo.empty());
  const FogLevel shaped = pack_fog(volume, 2, Downsampling::Aniso).value();
  EXPECT_EQ(shaped.voxel_sggx.size(), voxel_count(shaped));
  EXPECT_EQ(pack_fog(volume, 2, Downsampling::Matched).value().voxel_anisotropy.empty(), false);
  volume.albedos.resize(volume.bricks.size());
  for (AlbedoBrick& brick : volume.albedos) brick.fill({1000, 30000, 65535});
  EXPECT_EQ(pack_source_fog(volume).value().voxel_albedo.size(), voxel_count(grey));
}

TEST_F(BakeVolume, CoarserLevelsOfFlakesAreFlakes) {
  SourceVolume volume = test::make_volume(ivec3(16), 0.25, [](const ivec3&) { return 1.0; });
  SourceFlakes& flakes = volume.flakes.emplace();
  flakes.hot_spot = 0.5f;
  flakes.diffuse.resize(volume.bricks.size());
  for (ColorBrick& brick : flakes.diffuse)
    for (size_t i = 0; i < brick.size(); ++i) brick[i] = vec3(i % 2 == 0 ? 0.25f : 0.75f, 1, 0);
  volume.shapes.assign(volume.bricks.size(), ShapeBrick());
  for (ShapeBrick& brick : volume.shapes) brick.fill({0.5f, 0.25f, 0.25f, 0, 0, 0});
  volume.self_shadowing.assign(volume.bricks.size(), NumberBrick());
  for (NumberBrick& brick : volume.self_shadowing) brick.fill(0.5f);
  for (const Downsampling method : {Downsampling::Linear, Downsampling::Matched}) {
    const FogLevel level = pack_fog(volume, 2, method).value();
    EXPECT_EQ(level.header.medium, Medium::Flakes);
    EXPECT_EQ(level.header.hot_spot, 0.5f);
    ASSERT_EQ(voxel_count(level), 64u);
    const FlakeParams params = flake_params(view_of(level), 21);
    EXPECT_NEAR(params.diffuse.x, 0.5, 0.01);
    EXPECT_EQ(params.diffuse.y, 1.0f);
    EXPECT_NEAR(params.self_shadowing, 0.5, 0.01);
    EXPECT_NEAR(params.sggx.yy, 0.5, 0.01);
    EXPECT_NEAR(level.bricks[0].density_scale, std::sqrt(0.5f), 0.02);  // along the largest axis
    EXPECT_TRUE(level.voxel_albedo.empty() && level.voxel_anisotropy.empty());
  }
}

TEST_F(BakeVolume, DensitiesKeepTheirSums) {
  const SourceVolume volume = test::make_volume(ivec3(8), 1, [](const ivec3& v) { return v == ivec3(7) ? 255 : 0.3; });
  const FogLevel level = pack_source_fog(volume).value();
  double sum = 0;
  for (const uint8_t density : level.bricks[0].density) sum += density;
  EXPECT_NEAR(sum, 511 * 0.3 + 255, 0.6);  // each alone would be nothing
  EXPECT_EQ(level.bricks[0].density[511], 255);
}

TEST_F(BakeVolume, ExtremesBake) {
  VdbGrid one;
  one.voxels = {{{5, 5, 5}, 1e8}};
  VdbGrid tiles;
  tiles.tiles = {{{0, 0, 0}, {63, 63, 63}, 0.01}};
  for (const float albedo : {0.0f, 1.0f}) {
    BakeOptions options;
    options.import.fog.albedo = vec3(albedo);
    const Manifest single = bake_to(write("one.vdb", one), folder_.path() / "one.farfield", options).manifest;
    ASSERT_EQ(single.levels.size(), 1u);
    EXPECT_EQ(single.levels[0].voxels, 1u);
    const fs::path out = folder_.path() / "tiles.farfield";
    const Manifest even = bake_to(write("tiles.vdb", tiles), out, options).manifest;
    ASSERT_EQ(even.levels.size(), 4u);  // 64, 32, 16, 8
    EXPECT_EQ(even.levels[0].voxels, 64u * 64 * 64);
    for (const LevelEntry& entry : even.levels) {
      const auto file = LevelFile::open(out / entry.file, LevelCheck::Full);
      ASSERT_TRUE(file);
      const Brick& brick = (*file)->view().bricks[0];
      EXPECT_NEAR(brick.density_scale, 0.01f, 2e-4f) << entry.level;
      EXPECT_GE(brick.density[0], 250) << entry.level;
    }
  }
}

TEST_F(BakeVolume, ErrorsLeaveNothingBehind) {
  VdbGrid grid = cloud_grid();
  grid.voxels.push_back({{0, 0, 0}, NAN});
  const fs::path source = write("cloud.vdb", grid), out = folder_.path() / "cloud.farfield";
  const auto report = bake(source, out, {});
  ASSERT_FALSE(report);
  EXPECT_EQ(report.error().code, ErrorCode::BadFile);
  EXPECT_EQ(folder_.names(), std::vector<std::string>{"cloud.vdb"});

  std::atomic<bool> cancel = false;
  BakeOptions options;
  options.job.cancel = &cancel;
  options.job.progress = [&](double done, const std::string&) { cancel = done > 0.3; };
  const auto cancelled = bake(write("cloud.vdb", cloud_grid()), out, options);
  ASSERT_FALSE(cancelled);
  EXPECT_EQ(cancelled.error().code, ErrorCode::Cancelled);
  EXPECT_EQ(folder_.names(), std::vector<std::string>{"cloud.vdb"});
}

}  // namespace
}  // namespace farfield
