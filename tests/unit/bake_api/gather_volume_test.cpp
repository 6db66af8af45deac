// SPDX-License-Identifier: Apache-2.0
#include "bake_api/gather_volume.h"

#include <gtest/gtest.h>

#include <cmath>

#include "cache/manifest.h"
#include "import/read_volume.h"
#include "tests/support/files.h"
#include "tests/support/vdb_files.h"
#include "tests/support/volumes.h"

namespace farfield {
namespace {

namespace fs = std::filesystem;

/// A ball of fog in a box that is a little larger, in colours, turned and mirrored.
struct Ball {
  static constexpr uint32_t kWidth = 21, kHeight = 19, kDepth = 17;
  std::vector<float> density, anisotropy;
  std::vector<vec3> albedo, fibre;
  glm::dmat4x3 to_asset{1.0};

  Ball() {
    for (uint32_t z = 0; z < kDepth; ++z)
      for (uint32_t y = 0; y < kHeight; ++y)
        for (uint32_t x = 0; x < kWidth; ++x) {
          const ivec3 voxel(x, y, z);
          const double inside = 1 - glm::length(dvec3(voxel) - dvec3(9, 9, 8)) / 7.5;
          density.push_back(static_cast<float>(std::max(0.0, inside * (0.5 + test::smooth_noise(voxel)))));
          albedo.push_back(0.5f + 0.4f * static_cast<float>(test::smooth_noise(voxel)) * vec3(1, 0.5f, 0));
          fibre.push_back(x % 4 == 0 ? vec3(0.0f) : vec3(y, 2, z));
          anisotropy.push_back(0.5f - static_cast<float>(test::smooth_noise(voxel)));
        }
    const double angle = 0.7;
    to_asset[0] = 0.5 * dvec3(std::cos(angle), std::sin(angle), 0);
    to_asset[1] = 0.5 * dvec3(-std::sin(angle), std::cos(angle), 0);
    to_asset[2] = 0.5 * dvec3(0, 0, -1);
    to_asset[3] = {10, -3, 2};
  }

  BakeVolume volume() const {
    BakeVolume volume;
    volume.name = "ball.vdb";
    volume.width = kWidth, volume.height = kHeight, volume.depth = kDepth;
    volume.density = density;
    volume.albedo = albedo;
    volume.to_asset = to_asset;
    return volume;
  }

  /// With fibres and anisotropies that vary.
  BakeVolume fibre_volume() const {
    BakeVolume all = volume();
    all.fibre = fibre;
    all.anisotropy = anisotropy;
    return all;
  }

  void write_vdb(const fs::path& path, bool has_fibres = false) const {
    test::VdbGrid grid;
    grid.index_to_source = glm::dmat4(to_asset);
    // OpenVDB's whole numbers are centres.
    grid.index_to_source[3] = glm::dvec4(to_asset[3] + glm::dmat3(to_asset) * dvec3(0.5), 1);
    test::VdbGrid colors = grid, fibres = grid, cosines = grid;
    colors.name = "albedo", colors.kind = test::VdbGrid::Kind::Color;
    fibres.name = "fibre", fibres.kind = test::VdbGrid::Kind::Color;
    cosines.name = "anisotropy";
    for (size_t i = 0; i < density.size(); ++i) {
      if (density[i] == 0) continue;
      const int at = static_cast<int>(i), width = kWidth, height = kHeight;
      const ivec3 voxel(at % width, at / width % height, at / (width * height));
      grid.voxels.push_back({voxel, static_cast<double>(density[i]), vec3(0.0f)});
      colors.voxels.push_back({voxel, 0, albedo[i]});
      fibres.voxels.push_back({voxel, 0, fibre[i]});
      cosines.voxels.push_back({voxel, static_cast<double>(anisotropy[i]), vec3(0.0f)});
    }
    test::write_vdb(path, has_fibres ? std::vector{grid, colors, fibres, cosines} : std::vector{grid, colors});
  }
};

TEST(GatherVolume, IsWhatTheFileThatHoldsItIsReadAs) {
  const test::TemporaryFolder folder;
  const Ball ball;
  ball.write_vdb(folder.path() / "ball.vdb");
  BakeFog fog;
  fog.density_scale = 3;
  fog.anisotropy = 0.25;
  const SourceVolume read = read_volume(folder.path() / "ball.vdb", fog_options(fog)).value();
  const SourceVolume ours = gather_volume(ball.volume(), fog).value();
  EXPECT_EQ(ours.voxel_size, read.voxel_size);
  EXPECT_EQ(ours.dims, read.dims);
  EXPECT_EQ(ours.brick_dims, read.brick_dims);
  EXPECT_EQ(ours.rotation, read.rotation);
  EXPECT_LT(glm::distance(ours.origin, read.origin), 1e-12);
  EXPECT_EQ(ours.active_voxels, read.active_voxels);
  EXPECT_EQ(ours.filled_bricks, read.filled_bricks);
  EXPECT_EQ(ours.densest, read.densest);
  EXPECT_EQ(ours.anisotropy, read.anisotropy);
  EXPECT_TRUE(ours.warnings.empty());
  for (size_t entry = 0; entry < ours.brick_table.size(); ++entry) {
    ASSERT_EQ(ours.brick_table[entry] == kEmptyBrick, read.brick_table[entry] == kEmptyBrick);
    if (ours.brick_table[entry] == kEmptyBrick) continue;
    const size_t a = ours.brick_table[entry], b = read.brick_table[entry];
    EXPECT_EQ(ours.bricks[a], read.bricks[b]);
    for (size_t i = 0; i < kVolumeBrickVoxels; ++i) {
      if (!(ours.bricks[a][i] > 0)) continue;
      for (size_t c = 0; c < 3; ++c) EXPECT_NEAR(ours.albedos[a][i][c], read.albedos[b][i][c], 1);  // a rounding
    }
  }
}

TEST(GatherVolume, ResamplesVoxelsThatAreNoCubes) {
  const Ball ball;
  BakeVolume tall = ball.volume();
  const SourceVolume cubes = gather_volume(tall, {}).value();
  tall.to_asset[1] *= 2.0;
  const SourceVolume resampled = gather_volume(tall, {}).value();
  ASSERT_EQ(resampled.warnings.size(), 1u);
  EXPECT_NE(resampled.warnings[0].find("resampled onto cubes of"), std::string::npos);
  EXPECT_EQ(resampled.dims, cubes.dims * ivec3(1, 2, 1));
  EXPECT_EQ(resampled.active_voxels, 2 * cubes.active_voxels);
  EXPECT_EQ(resampled.densest, cubes.densest);
  EXPECT_NE(resampled.source_hash, cubes.source_hash);
}

TEST(GatherVolume, BakesToTheSameBytesAsTheFile) {
  const test::TemporaryFolder folder;
  const Ball ball;
  ball.write_vdb(folder.path() / "ball.vdb");
  BakeSettings settings;
  settings.coarsest_grid = 4;
  settings.fog.density_scale = 2;
  settings.fog.albedo = glm::vec3(0.5f, 0.75f, 1);
  settings.downsampling = BakeDownsampling::Iso;
  const auto of_file = bake_file(folder.path() / "ball.vdb", folder.path() / "file", settings);
  const auto of_arrays = bake_volume(ball.volume(), folder.path() / "arrays", settings);
  ASSERT_TRUE(of_file) << of_file.error().message;
  ASSERT_TRUE(of_arrays) << of_arrays.error().message;
  const Manifest a = read_manifest(folder.path() / "file").value(), b = read_manifest(folder.path() / "arrays").value();
  ASSERT_EQ(a.levels.size(), b.levels.size());
  ASSERT_GT(a.levels.size(), 1u);
  for (size_t i = 0; i < a.levels.size(); ++i) EXPECT_EQ(a.levels[i].file_hash, b.levels[i].file_hash) << i;
  EXPECT_EQ(a.options, b.options);
  EXPECT_NE(a.options.find("downsampling=iso"), std::string::npos) << a.options;
  EXPECT_NE(a.options.find("density_scale=2 albedo=0.5,0.75,1"), std::string::npos) << a.options;
  EXPECT_TRUE(bake_volume(ball.volume(), folder.path() / "arrays", settings)->is_up_to_date);
  settings.downsampling = BakeDownsampling::Matched;
  EXPECT_FALSE(bake_volume(ball.volume(), folder.path() / "arrays", settings)->is_up_to_date);
}

/// sigma_t of a voxel along the grid's axes.
std::array<double, 3> attenuation_along_axes(const SourceVolume& volume, size_t brick, size_t voxel) {
  std::array<double, 3> result{};
  for (size_t axis = 0; axis < 3; ++axis)
    result[axis] = static_cast<double>(volume.bricks[brick][voxel]) *
                   std::sqrt(static_cast<double>(volume.shapes[brick][voxel][axis]));
  return result;
}

TEST(GatherVolume, TakesFibresAndAnisotropiesAsTheFileHasThem) {
  const test::TemporaryFolder folder;
  const Ball ball;
  ball.write_vdb(folder.path() / "ball.vdb", true);
  BakeFog fog;
  fog.fibre_roughness = 0.25;
  const SourceVolume read = read_volume(folder.path() / "ball.vdb", fog_options(fog)).value();
  const SourceVolume ours = gather_volume(ball.fibre_volume(), fog).value();
  ASSERT_EQ(ours.warnings.size(), 1u);
  EXPECT_NE(ours.warnings[0].find("440 voxels have no direction"), std::string::npos) << ours.warnings[0];
  ASSERT_EQ(read.warnings.size(), 1u);
  ASSERT_EQ(ours.shapes.size(), ours.bricks.size());
  ASSERT_EQ(ours.brick_table.size(), read.brick_table.size());
  for (size_t entry = 0; entry < ours.brick_table.size(); ++entry) {
    if (ours.brick_table[entry] == kEmptyBrick) continue;
    const size_t a = ours.brick_table[entry], b = read.brick_table[entry];
    EXPECT_EQ(ours.anisotropies[a], read.anisotropies[b]);
    for (size_t i = 0; i < kVolumeBrickVoxels; ++i) {
      if (!(ours.bricks[a][i] > 0)) continue;
      EXPECT_NEAR(ours.bricks[a][i], read.bricks[b][i], 1e-6f * read.bricks[b][i]);
      for (size_t e = 0; e < 6; ++e) EXPECT_NEAR(ours.shapes[a][i][e], read.shapes[b][i][e], 1e-6f);
    }
  }
}

TEST(GatherVolume, TakesTheMostAnisotropyAsAFloat) {
  Ball ball;
  ball.anisotropy.assign(ball.anisotropy.size(), 0.98f);
  ball.anisotropy[0] = -0.98f;
  EXPECT_TRUE(gather_volume(ball.fibre_volume(), {}));
}

TEST(GatherVolume, EllipsoidsAndSelfShadowingAreKeptAlongTheAxesOfTheAsset) {
  const std::vector<float> density = {2, 2}, self_shadowing = {0.5f, 0},
                           sggx = {1, 4, 0.25f, 0, 0, 0, 0, 0, 0, 0, 0, 0};
  BakeVolume volume;
  volume.width = 2, volume.height = volume.depth = 1;
  volume.density = density;
  volume.self_shadowing = self_shadowing;
  volume.sggx = BakeRows<6>(sggx.data(), 2);
  volume.to_asset = glm::dmat4x3(dvec3(0, 1, 0), dvec3(-1, 0, 0), dvec3(0, 0, 1), dvec3(0.0));  // the grid's x is y
  BakeFog fog;
  fog.albedo = glm::vec3(0.9f);
  const SourceVolume kept = gather_volume(volume, fog).value();
  const auto first = attenuation_along_axes(kept, 0, 0), second = attenuation_along_axes(kept, 0, 1);
  EXPECT_NEAR(first[0], 4, 1e-6);
  EXPECT_NEAR(first[1], 2, 1e-6);
  EXPECT_NEAR(first[2], 1, 1e-6);
  for (const double along : second) EXPECT_NEAR(along, 2, 1e-6);
  EXPECT_EQ(kept.self_shadowing[0][0], 0.5f);
  EXPECT_EQ(kept.self_shadowing[0][1], 1.0f / 255);  // the least that levels can say
  ASSERT_EQ(kept.warnings.size(), 1u);
  EXPECT_EQ(kept.warnings[0], "volume memory: 1 voxels have no SGGX: they stop alike from all sides");
}

TEST(GatherVolume, HasAHashOfAllThatItSays) {
  const Ball ball;
  std::vector<uint64_t> hashes;
  const auto add = [&](const Ball& changed, const BakeFog& fog) {
    hashes.push_back(gather_volume(changed.volume(), fog).value().source_hash);
  };
  add(ball, {});
  Ball other = ball;
  other.density[9 + 21 * (9 + 19 * 8)] *= 0.5f;
  add(other, {});
  other = ball;
  other.albedo[9 + 21 * (9 + 19 * 8)].x = 1;
  add(other, {});
  other = ball;
  other.to_asset[3].x += 1e-9;
  add(other, {});
  hashes.push_back(gather_volume(ball.fibre_volume(), {}).value().source_hash);
  other = ball;
  other.fibre[9 + 21 * (9 + 19 * 8)].x += 1;
  hashes.push_back(gather_volume(other.fibre_volume(), {}).value().source_hash);
  other = ball;
  other.anisotropy[9 + 21 * (9 + 19 * 8)] = 0;
  hashes.push_back(gather_volume(other.fibre_volume(), {}).value().source_hash);
  BakeFog fog;
  fog.anisotropy = 0.1;
  add(ball, fog);
  fog = {};
  fog.albedo = glm::vec3(1.0f);
  add(ball, fog);
  add(ball, {});
  EXPECT_EQ(hashes.back(), hashes.front());
  hashes.pop_back();
  for (size_t i = 0; i < hashes.size(); ++i)
    for (size_t j = 0; j < i; ++j) EXPECT_NE(hashes[i], hashes[j]) << i << " " << j;
}

TEST(GatherVolume, SaysWhatItGuesses) {
  const Ball ball;
  BakeVolume volume = ball.volume();
  volume.albedo = {};
  const SourceVolume white = gather_volume(volume, {}).value();
  EXPECT_EQ(white.albedo, vec3(kDefaultAlbedo));
  ASSERT_EQ(white.warnings.size(), 1u);
  EXPECT_EQ(white.warnings[0], "volume ball.vdb: it says no albedo: 0.99 is taken");
  BakeFog fog;
  fog.albedo = glm::vec3(0.5f);
  EXPECT_TRUE(gather_volume(volume, fog).value().warnings.empty());
  EXPECT_EQ(gather_volume(ball.volume(), fog).value().warnings.size(), 1u);
}

TEST(GatherVolume, RefusesWhatIsNoVolumeAndSaysWhere) {
  const Ball ball;
  const auto expect_refusal = [&](auto spoil, const std::string& words) {
    Ball changed = ball;
    BakeVolume volume = changed.volume();
    BakeFog fog;
    spoil(changed, volume, fog);
    const auto result = gather_volume(volume, fog);
    ASSERT_FALSE(result) << words;
    EXPECT_EQ(result.error().code, ErrorCode::InvalidArgument);
    EXPECT_NE(result.error().message.find(words), std::string::npos) << result.error().message;
  };
  const size_t at = 3 + 21 * (4 + 19 * 5);
  expect_refusal([&](Ball& b, BakeVolume&, BakeFog&) { b.density[at] = NAN; }, "the density of voxel (3, 4, 5) is nan");
  expect_refusal([&](Ball& b, BakeVolume&, BakeFog&) { b.density[at] = -1; }, "the density of voxel (3, 4, 5) is -1");
  expect_refusal([&](Ball& b, BakeVolume&, BakeFog&) { b.density[at] = INFINITY; }, "(3, 4, 5) is inf");
  expect_refusal([&](Ball& b, BakeVolume&, BakeFog&) { b.albedo[at].y = 1.5f; },
                 "the albedo of voxel (3, 4, 5) has 1.5");
  expect_refusal([](Ball& b, BakeVolume&, BakeFog&) { b.density.assign(b.density.size(), 0.0f); }, "nothing to see");
  expect_refusal([](Ball&, BakeVolume& v, BakeFog&) { v.depth = 0; }, "21 x 19 x 0 voxels");
  expect_refusal([](Ball&, BakeVolume& v, BakeFog&) { v.depth = 18; }, "6783 densities for 21 x 19 x 18 voxels");
  expect_refusal([](Ball& b, BakeVolume& v, BakeFog&) { v.albedo = {&b.albedo[0].x, 7}; }, "7 albedos");
  expect_refusal([](Ball& b, BakeVolume& v, BakeFog&) { v.fibre = {&b.fibre[0].x, 7}; }, "7 fibres for 6783 densities");
  expect_refusal([](Ball& b, BakeVolume& v, BakeFog&) { v.sggx = {&b.fibre[0].x, 6}; }, "6 SGGX matrices");
  expect_refusal(
      [](Ball& b, BakeVolume& v, BakeFog&) {
        v.sggx = {&b.fibre[0].x, 6783, 0};
        v.fibre = b.fibre;
      },
      "it has sggx and fibre");
  expect_refusal(
      [&](Ball& b, BakeVolume& v, BakeFog&) {
        b.fibre[at].y = NAN;
        v.fibre = b.fibre;
      },
      "the fibre of voxel (3, 4, 5) has nan");
  expect_refusal(
      [&](Ball& b, BakeVolume& v, BakeFog&) {
        b.anisotropy[at] = 0.99f;
        v.anisotropy = b.anisotropy;
      },
      "the anisotropy of voxel (3, 4, 5) has 0.99");
  expect_refusal([](Ball& b, BakeVolume& v, BakeFog&) { v.self_shadowing = v.anisotropy = b.anisotropy; },
                 "it has self_shadowing and anisotropy");
  expect_refusal([](Ball&, BakeVolume&, BakeFog& f) { f.fibre_roughness = 2; }, "fibre-roughness");
  expect_refusal([](Ball&, BakeVolume& v, BakeFog&) { v.to_asset[1] = dvec3(0.0); }, "singular");
  expect_refusal([](Ball&, BakeVolume& v, BakeFog&) { v.to_asset[3].z = NAN; }, "not finite");
  expect_refusal([](Ball&, BakeVolume&, BakeFog& f) { f.density_scale = 0; }, "density-scale");
  expect_refusal([](Ball&, BakeVolume&, BakeFog& f) { f.anisotropy = 1; }, "anisotropy");
  expect_refusal([](Ball&, BakeVolume&, BakeFog& f) { f.level_set = true; }, "choose from a file");
}

TEST(GatherVolume, StopsWhenTold) {
  const std::atomic<bool> cancel{true};
  const auto result = gather_volume(Ball().volume(), {}, Job{{}, &cancel});
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().code, ErrorCode::Cancelled);
}

}  // namespace
}  // namespace farfield
