// SPDX-License-Identifier: Apache-2.0
// Volumes on the way out and back: what OpenVDB reads, and what a bake of it gives.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <map>

#include "bake/bake.h"
#include "cache/level_file.h"
#include "cache/level_values.h"
#include "export/export_asset.h"
#include "tests/support/asset_writer.h"
#include "tests/support/files.h"
#include "tests/support/level_builder.h"
#include "tests/support/vdb_files.h"
#include "tests/support/volumes.h"

namespace farfield {
namespace {

namespace fs = std::filesystem;
using test::VdbContent;
using test::VdbGrid;

double cloud(const ivec3& v) {
  const double inside = 1 - glm::length(dvec3(v) - 15.5) / 15;
  return std::max(0.0, 3 * inside * (test::smooth_noise(v) - 0.2));
}

/// Turned, moved and scaled, with albedos that vary.
std::vector<VdbGrid> cloud_grids() {
  VdbGrid density;
  density.voxels = test::filled_cube({-7, 3, 11}, 32, cloud);
  const double angle = 0.4, size = 0.25;
  const glm::dmat3 rotation(dvec3(std::cos(angle), 0, std::sin(angle)), dvec3(0, 1, 0),
                            dvec3(-std::sin(angle), 0, std::cos(angle)));
  density.index_to_source = glm::dmat4(size * rotation);
  density.index_to_source[3] = glm::dvec4(50, -3, 8, 1);
  VdbGrid albedo = density;
  albedo.name = "albedo", albedo.kind = VdbGrid::Kind::Color;
  for (test::VdbVoxel& voxel : albedo.voxels)
    voxel.color = vec3(0.5f, 0.9f, 0.99f) - 0.4f * static_cast<float>(test::smooth_noise(voxel.at)) * vec3(1, 0.5f, 0);
  return {density, albedo};
}

/// A baked level, by places in the source's space.
struct BakedLevel {
  Manifest manifest;
  std::unique_ptr<LevelFile> file;

  BakedLevel(const fs::path& asset, uint32_t number) : manifest(read_manifest(asset).value()) {
    for (const LevelEntry& entry : manifest.levels)
      if (entry.level == number) file = LevelFile::open(asset / entry.file, LevelCheck::Full).value();
  }
  const LevelView& view() const { return file->view(); }

  dvec3 place_of(const ivec3& voxel) const {
    const double r = double{view().header.resolution};
    return manifest.origin + manifest.rotation * (dvec3(view().header.volume_origin) + r * (dvec3(voxel) + 0.5));
  }
  ivec3 voxel_at(const dvec3& place) const {
    const dvec3 local = glm::transpose(manifest.rotation) * (place - manifest.origin);
    return ivec3(glm::floor((local - dvec3(view().header.volume_origin)) / double{view().header.resolution}));
  }
  struct Value {
    float density = 0, step = 0;  ///< of the density's bytes
    vec3 albedo{0.0f};
    uint32_t payload = 0;
  };
  Value at(const ivec3& voxel) const {
    const ivec3 brick = voxel >> ivec3(3);
    const ivec3& dims = view().header.brick_dims;
    if (glm::any(glm::lessThan(voxel, ivec3(0))) || glm::any(glm::greaterThanEqual(brick, dims))) return {};
    const uint32_t index = view().brick_table[brick_table_index(dims, brick)];
    if (index == kNoBrick) return {};
    const Brick& b = view().bricks[index];
    const int i = (voxel.x & 7) | (voxel.y & 7) << 3 | (voxel.z & 7) << 6;
    const uint8_t byte = b.density[static_cast<size_t>(i)];
    const float step = b.density_scale / 255;
    if (byte == 0) return {0, step, vec3(0.0f)};
    return {step * static_cast<float>(byte), step, fog_params(view(), b.payload_index(i)).albedo, b.payload_index(i)};
  }
  /// sigma_t of a voxel along a direction of the source's space.
  float attenuation(const Value& value, const dvec3& direction) const {
    if (value.density == 0 || view().voxel_sggx.empty()) return value.density;
    const vec3 w(glm::transpose(manifest.rotation) * direction);
    return value.density * std::sqrt(std::max(0.0f, unpack(view().voxel_sggx[value.payload]).quadratic(w)));
  }
  template <typename Visit>
  void for_each_voxel(const Visit& visit) const {
    for_each_brick(view(), [&](const Brick& brick, const ivec3& coordinates) {
      for (int i = 0; i < kBrickVoxels; ++i) {
        if (brick.density[static_cast<size_t>(i)] != 0)
          visit(coordinates * kBrickSide + ivec3(i & 7, i >> 3 & 7, i >> 6));
      }
    });
  }
};

class ExportVolume : public testing::Test {
 protected:
  fs::path path(const std::string& name) const { return folder_.path() / name; }
  ExportReport export_to(const fs::path& target, std::vector<uint32_t> levels, const fs::path& asset) const {
    const auto report = export_asset(asset, target, {std::move(levels)});
    EXPECT_TRUE(report) << report.error().message;
    return report.value_or(ExportReport());
  }
  fs::path bake_cloud() const {
    test::write_vdb(path("cloud.vdb"), cloud_grids());
    const auto baked = bake(path("cloud.vdb"), path("cloud.farfield"), {});
    EXPECT_TRUE(baked) << baked.error().message;
    return path("cloud.farfield");
  }
  const test::TemporaryFolder folder_;
};

TEST_F(ExportVolume, ABakeOfAnExportedLevelGivesItBack) {
  const fs::path asset = bake_cloud();
  for (const uint32_t level : {0u, 1u, 2u}) {
    const fs::path exported = path(fmt::format("level_{}.vdb", level)), again = path(fmt::format("{}.farfield", level));
    const ExportReport report = export_to(exported, {level}, asset);
    EXPECT_TRUE(report.notes.empty());
    ASSERT_EQ(report.levels.size(), 1u);
    EXPECT_EQ(report.levels[0].grids[0], "density");
    BakeOptions options;
    options.source_only = true;
    const auto baked = bake(exported, again, options);
    ASSERT_TRUE(baked) << baked.error().message;

    const BakedLevel before(asset, level), after(again, 0);
    EXPECT_EQ(after.view().header.resolution, before.view().header.resolution);
    EXPECT_EQ(report.levels[0].voxels, voxel_count(before.view()));
    double sum_before = 0, sum_after = 0;
    before.for_each_voxel([&](const ivec3& voxel) {
      const auto ours = before.at(voxel), theirs = after.at(after.voxel_at(before.place_of(voxel)));
      EXPECT_NEAR(theirs.density, ours.density, 1.01f * theirs.step);
      if (theirs.density > 0) {
        EXPECT_LT(max_component(glm::abs(theirs.albedo - ours.albedo)), 0.005f);
      }
      sum_before += double{ours.density};
    });
    after.for_each_voxel([&](const ivec3& voxel) {
      EXPECT_GT(before.at(before.voxel_at(after.place_of(voxel))).density, 0.0f);
      sum_after += double{after.at(voxel).density};
    });
    EXPECT_GT(sum_before, 10);
    EXPECT_NEAR(sum_after, sum_before, 1e-3 * sum_before);
  }
  // Level 0 is a fixed point: its bytes are what they were.
  const BakedLevel before(asset, 0), after(path("0.farfield"), 0);
  EXPECT_TRUE(std::ranges::equal(before.file->bytes(), after.file->bytes()));
}

/// Grids of level 3 of an asset with that level alone.
std::map<std::string, VdbContent> grids_of(const fs::path& folder, const LevelData& level) {
  test::write_asset(
      folder / "a.farfield", {level},
      [](const LevelView&) {
        return LevelCost{1 << 20, 100};
      },
      dvec3(10, 0, 0));
  const auto report = export_asset(folder / "a.farfield", folder / "a.vdb", {{3}});
  EXPECT_TRUE(report) << report.error().message;
  std::map<std::string, VdbContent> grids;
  for (VdbContent& grid : test::read_vdb(folder / "a.vdb")) grids[grid.name] = grid;
  return grids;
}

/// Directions that see all six numbers of an ellipsoid.
const std::array<dvec3, 6> kDirections = {dvec3(1, 0, 0),
                                          dvec3(0, 1, 0),
                                          dvec3(0, 0, 1),
                                          glm::normalize(dvec3(1, 1, 0)),
                                          glm::normalize(dvec3(1, 0, -1)),
                                          glm::normalize(dvec3(0, 1, 1))};

// A step of sigma is 1 / 255 of the largest, one of a correlation 1 / 127: together 1.5 % of the largest.
TEST_F(ExportVolume, ABakeGivesBackPhaseFunctionsAndEllipsoidsOfFog) {
  test::write_vdb(path("cloud.vdb"), cloud_grids());
  struct Case {
    Downsampling method;
    double anisotropy;
  };
  for (const Case& c : {Case{Downsampling::Aniso, 0}, Case{Downsampling::Iso, 0.6}, Case{Downsampling::Matched, 0}}) {
    BakeOptions options;
    options.downsampling = c.method;
    options.import.fog.anisotropy = c.anisotropy;
    ASSERT_TRUE(bake(path("cloud.vdb"), path("cloud.farfield"), options));
    export_to(path("2.vdb"), {2}, path("cloud.farfield"));
    BakeOptions again;
    again.source_only = true;
    const auto baked = bake(path("2.vdb"), path("again.farfield"), again);
    ASSERT_TRUE(baked) << baked.error().message;
    EXPECT_TRUE(baked->warnings.empty()) << baked->warnings.front();
    const BakedLevel before(path("cloud.farfield"), 2), after(path("again.farfield"), 0);
    EXPECT_EQ(after.view().header.fog_anisotropy, before.view().header.fog_anisotropy);
    EXPECT_EQ(after.view().voxel_sggx.empty(), before.view().voxel_sggx.empty());
    EXPECT_EQ(after.view().voxel_anisotropy.empty(), before.view().voxel_anisotropy.empty());
    int compared = 0;
    before.for_each_voxel([&](const ivec3& voxel) {
      const auto ours = before.at(voxel), theirs = after.at(after.voxel_at(before.place_of(voxel)));
      if (theirs.density == 0) return;
      for (const dvec3& w : kDirections)
        EXPECT_NEAR(after.attenuation(theirs, w), before.attenuation(ours, w),
                    1.1f * theirs.step + 0.015f * ours.density);
      const FogParams a = fog_params(before.view(), ours.payload), b = fog_params(after.view(), theirs.payload);
      EXPECT_NEAR(b.anisotropy, a.anisotropy, 1.01f / 127);
      EXPECT_NEAR(b.self_shadowing, a.self_shadowing, 1.01f / 255);
      EXPECT_LT(max_component(glm::abs(b.albedo - a.albedo)), 0.005f);
      ++compared;
    });
    EXPECT_GT(compared, 100);
  }
}

// What volumes of meshes are.
TEST_F(ExportVolume, ABakeGivesFlakesBack) {
  LevelData level = test::full_level_of_version_5();
  for (size_t i = 0; i < level.voxel_sggx.size(); ++i) {  // as bakes make them
    const float f = static_cast<float>(i);
    level.voxel_emission[i] = pack_radiance(vec3(0.5f, 2, f));
    level.voxel_sggx[i] = pack_flake_sggx({1, 0.3f + 0.1f * f, 0.5f, 0.2f, -0.1f * f, 0.1f});
  }
  grids_of(folder_.path(), level);
  const auto baked = bake(path("a.vdb"), path("again.farfield"), {});
  ASSERT_TRUE(baked) << baked.error().message;
  EXPECT_TRUE(baked->warnings.empty()) << baked->warnings.front();
  const BakedLevel before(path("a.farfield"), 3), after(path("again.farfield"), 0);
  const LevelHeader &was = before.view().header, &is = after.view().header;
  EXPECT_EQ(is.medium, Medium::Flakes);
  EXPECT_EQ(is.hot_spot, was.hot_spot);
  EXPECT_EQ(is.highlight_lean, was.highlight_lean);
  EXPECT_EQ(is.open_side, was.open_side);
  EXPECT_EQ(voxel_count(after.view()), voxel_count(before.view()));
  before.for_each_voxel([&](const ivec3& voxel) {
    const auto ours = before.at(voxel), theirs = after.at(after.voxel_at(before.place_of(voxel)));
    for (const dvec3& w : kDirections)
      EXPECT_NEAR(after.attenuation(theirs, w), before.attenuation(ours, w),
                  1.1f * theirs.step + 0.015f * ours.density);
    const FlakeParams a = flake_params(before.view(), ours.payload), b = flake_params(after.view(), theirs.payload);
    EXPECT_EQ(b.diffuse, a.diffuse);
    EXPECT_EQ(b.specular, a.specular);
    EXPECT_EQ(b.transmission, a.transmission);
    EXPECT_NEAR(b.roughness2, a.roughness2, 1e-6);
    EXPECT_EQ(b.self_shadowing, a.self_shadowing);
    EXPECT_EQ(after.view().voxel_octants[theirs.payload], before.view().voxel_octants[ours.payload]);
    EXPECT_EQ(after.view().voxel_emission[theirs.payload], before.view().voxel_emission[ours.payload]);
  });
}

TEST_F(ExportVolume, SeveralLevelsAreGridsAsOpenVdbNamesThem) {
  const fs::path asset = bake_cloud();
  const ExportReport report = export_to(path("all.vdb"), {}, asset);
  const Manifest manifest = read_manifest(asset).value();
  ASSERT_EQ(report.levels.size(), manifest.levels.size());
  std::map<std::string, VdbContent> grids;
  for (VdbContent& grid : test::read_vdb(path("all.vdb"))) grids[grid.name] = grid;
  for (const LevelEntry& entry : manifest.levels) {
    const VdbContent& density = grids[fmt::format("density_level_{}", entry.level)];
    EXPECT_EQ(density.voxels.size(), entry.voxels);
    EXPECT_TRUE(density.is_fog);
    EXPECT_EQ(density.metadata.at("farfield_level"), std::to_string(entry.level));
    EXPECT_EQ(density.metadata.at("MultiResGrid_Level"), std::to_string(entry.level));
    EXPECT_EQ(density.metadata.at("farfield_source"), "cloud.vdb");
    EXPECT_EQ(density.metadata.at("farfield_version").find("farfield "), 0u);
    EXPECT_EQ(density.metadata.at("units"), "1 / length unit of the source");
    EXPECT_EQ(density.metadata.at("farfield_medium"), "fog");
    EXPECT_TRUE(density.metadata.contains("file_bbox_max"));
    // A voxel of level k is 2^k wide; voxel (0, 0, 0) of each level starts in the same corner.
    const glm::dmat4& m = density.index_to_source;
    EXPECT_NEAR(glm::length(dvec3(m[0])), entry.resolution, 1e-12);
    const dvec3 corner = dvec3(m * glm::dvec4(-0.5, -0.5, -0.5, 1));
    EXPECT_LT(glm::distance(corner, manifest.origin), 1e-6);
    EXPECT_TRUE(grids.contains(fmt::format("albedo_level_{}", entry.level)));
  }
  // One of several levels is a source, albedos included.
  BakeOptions options;
  options.import.fog.density_grid = "density_level_1";
  options.source_only = true;
  const auto baked = bake(path("all.vdb"), path("one.farfield"), options);
  ASSERT_TRUE(baked) << baked.error().message;
  export_to(path("1.vdb"), {1}, asset);
  options.import.fog.density_grid = "";
  const auto alone = bake(path("1.vdb"), path("alone.farfield"), options);
  ASSERT_TRUE(alone) << alone.error().message;
  EXPECT_EQ(baked->manifest.levels[0].file_hash, alone->manifest.levels[0].file_hash);
}

const test::VdbVoxel& voxel_at(const VdbContent& grid, const ivec3& at) {
  for (const test::VdbVoxel& voxel : grid.voxels)
    if (voxel.at == at) return voxel;
  ADD_FAILURE() << grid.name << " has no such voxel";
  return grid.voxels.front();
}

TEST_F(ExportVolume, OfFlakesHasAllThatTheLevelHas) {
  const LevelData level = test::full_level_of_version_5();
  const auto grids = grids_of(folder_.path(), level);
  std::string names;
  for (const auto& [name, grid] : grids) {
    names += name + " ";
    EXPECT_EQ(grid.voxels.size(), 5u) << name;
  }
  EXPECT_EQ(names,
            "albedo density density_isotropic diffuse emission octants roughness self_shadowing sggx_diagonal "
            "sggx_off_diagonal specular transmission ");
  // The second of the first brick: voxel 70 of 512.
  const ivec3 at(70 & 7, 70 >> 3 & 7, 70 >> 6);
  const LevelView view = view_of(level);
  const FlakeParams params = flake_params(view, 1);
  const float share = mean_share(level.voxel_octants[1]);
  EXPECT_NEAR(voxel_at(grids.at("density"), at).value, 2.5 / 255 * double{share}, 1e-7);
  EXPECT_EQ(voxel_at(grids.at("octants"), at).value, static_cast<double>(level.voxel_octants[1]));
  EXPECT_EQ(voxel_at(grids.at("diffuse"), at).color, params.diffuse);
  EXPECT_EQ(voxel_at(grids.at("specular"), at).color, params.specular);
  EXPECT_EQ(voxel_at(grids.at("transmission"), at).color, params.transmission);
  EXPECT_EQ(voxel_at(grids.at("sggx_diagonal"), at).color, vec3(params.sggx.xx, params.sggx.yy, params.sggx.zz));
  EXPECT_EQ(voxel_at(grids.at("sggx_off_diagonal"), at).color, vec3(params.sggx.xy, params.sggx.xz, params.sggx.yz));
  EXPECT_NEAR(voxel_at(grids.at("self_shadowing"), at).value, double{params.self_shadowing}, 1e-7);
  EXPECT_EQ(voxel_at(grids.at("emission"), at).color, unpack_radiance(level.voxel_emission[1]));
  EXPECT_LE(voxel_at(grids.at("density_isotropic"), at).value, voxel_at(grids.at("density"), at).value);
  // Voxel centres: the lower corner of the volume is (-1, -2, -3), a voxel 0.25 wide, the asset moved by (10, 0, 0).
  EXPECT_EQ(dvec3(grids.at("density").index_to_source[3]), dvec3(9.125, -1.875, -2.875));
  EXPECT_EQ(grids.at("density").metadata.at("farfield_medium"), "flakes");
  EXPECT_EQ(grids.at("density").metadata.at("farfield_highlight_lean"), "-0.25");
}

TEST_F(ExportVolume, OfFogHasAllThatTheLevelHas) {
  LevelData level = test::full_level_of_version_6();
  const auto grids = grids_of(folder_.path(), level);
  EXPECT_TRUE(grids.contains("albedo") && grids.contains("anisotropy") && grids.contains("sggx_diagonal"));
  EXPECT_FALSE(grids.contains("self_shadowing"));  // the anisotropy is of all light, so albedos are, too
  const ivec3 at(70 & 7, 70 >> 3 & 7, 70 >> 6);
  const FogParams params = fog_params(view_of(level), 1);
  EXPECT_EQ(voxel_at(grids.at("albedo"), at).color, params.albedo);
  EXPECT_NEAR(voxel_at(grids.at("anisotropy"), at).value, double{params.anisotropy}, 1e-7);
}

TEST_F(ExportVolume, TheSameAssetGivesTheSameBytes) {
  const fs::path asset = bake_cloud();
  export_to(path("a.vdb"), {}, asset);
  export_to(path("b.vdb"), {}, asset);
  EXPECT_EQ(test::read_bytes(path("a.vdb")), test::read_bytes(path("b.vdb")));
}

}  // namespace
}  // namespace farfield
