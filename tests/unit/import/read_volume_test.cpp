// SPDX-License-Identifier: Apache-2.0
#include "import/read_volume.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "base/random.h"
#include "tests/support/files.h"
#include "tests/support/vdb_files.h"
#include "tests/support/volumes.h"

namespace farfield {
namespace {

namespace fs = std::filesystem;
using test::density_at;
using test::VdbGrid;

/// A folder with files of its own for each test.
class ReadVolume : public testing::Test {
 protected:
  fs::path write(const std::vector<VdbGrid>& grids) const {
    const fs::path path = folder_.path() / "cloud.vdb";
    test::write_vdb(path, grids);
    return path;
  }
  static SourceVolume read(const fs::path& path, const FogOptions& options = {}) {
    auto volume = read_volume(path, options);
    EXPECT_TRUE(volume) << volume.error().message;
    return volume ? std::move(*volume) : SourceVolume();
  }
  /// The message of an error, which names the file.
  static std::string failure(const fs::path& path, ErrorCode code, const FogOptions& options = {}) {
    const auto volume = read_volume(path, options);
    if (volume) return "no error";
    EXPECT_EQ(volume.error().code, code) << volume.error().message;
    EXPECT_EQ(volume.error().message.find('\n'), std::string::npos);
    return volume.error().message;
  }
  static bool has_warning(const SourceVolume& volume, const std::string& words) {
    for (const std::string& warning : volume.warnings)
      if (warning.find(words) != std::string::npos) return true;
    return false;
  }

  const test::TemporaryFolder folder_;
};

VdbGrid one_voxel(const ivec3& at = {0, 0, 0}, double value = 1) {
  VdbGrid grid;
  grid.voxels = {{at, value}};
  return grid;
}

glm::dmat4 scaled(double size) { return glm::dmat4(glm::dmat3(size)); }

void expect_near(const dvec3& a, const dvec3& b, double tolerance) {
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(a[c], b[c], tolerance);
}

TEST_F(ReadVolume, VoxelsHaveTheirCentresAtWholeNumbers) {
  VdbGrid grid = one_voxel({3, -2, 5}, 2);
  grid.index_to_source = scaled(0.5);
  const SourceVolume volume = read(write({grid}), {.density_scale = 3});
  expect_near(volume.origin, {1.25, -1.25, 2.25}, 1e-12);
  EXPECT_EQ(volume.dims, ivec3(1));
  EXPECT_NEAR(volume.voxel_size, 0.5, 1e-12);
  EXPECT_EQ(density_at(volume, {0, 0, 0}), 6.0f);
  EXPECT_EQ(volume.active_voxels, 1u);
  EXPECT_EQ(volume.densest, 6.0f);
  const auto extent = read_volume_extent(folder_.path() / "cloud.vdb");
  ASSERT_TRUE(extent);
  expect_near(extent->lower, {1.25, -1.25, 2.25}, 1e-12);
  expect_near(extent->upper, {1.75, -0.75, 2.75}, 1e-12);
}

TEST_F(ReadVolume, HalfAndDoubleGridsAreFloatGrids) {
  const auto value = [](const ivec3& v) { return 0.1 + 0.013 * v.x + 0.17 * v.y * v.z; };
  VdbGrid grid;
  grid.voxels = test::filled_cube({-3, 1, 7}, 11, value);
  const SourceVolume as_float = read(write({grid}));
  for (const auto kind : {VdbGrid::Kind::Half, VdbGrid::Kind::Double}) {
    grid.kind = kind;
    const SourceVolume other = read(write({grid}));
    ASSERT_EQ(other.dims, as_float.dims);
    EXPECT_EQ(other.active_voxels, as_float.active_voxels);
    for (const ivec3 voxel : {ivec3(0), ivec3(10), ivec3(3, 9, 2)})
      EXPECT_NEAR(density_at(other, voxel), value(voxel), 1e-3 * value(voxel));
  }
}

TEST_F(ReadVolume, TilesShareTheirBricksAndAreNeverFilledOut) {
  VdbGrid grid;
  grid.tiles = {{{-128, 0, 0}, {383, 511, 511}, 0.25}};
  const SourceVolume volume = read(write({grid}));
  EXPECT_EQ(volume.dims, ivec3(512));
  EXPECT_EQ(volume.active_voxels, 512u * 512 * 512);
  EXPECT_EQ(volume.filled_bricks, 64u * 64 * 64);
  EXPECT_EQ(volume.bricks.size(), 1u);
  for (const ivec3 voxel : {ivec3(0), ivec3(511), ivec3(99, 300, 7)}) EXPECT_EQ(density_at(volume, voxel), 0.25f);
}

TEST_F(ReadVolume, TransformsThatTurnMirrorAndMoveAreKept) {
  const double angle = 0.7;
  const glm::dmat3 turn(dvec3(std::cos(angle), std::sin(angle), 0), dvec3(-std::sin(angle), std::cos(angle), 0),
                        dvec3(0, 0, -1));  // mirrors as well
  VdbGrid grid = one_voxel({2, 0, 0});
  grid.voxels.push_back({{4, 3, 9}, 0.5});
  grid.index_to_source = glm::dmat4(0.25 * turn);
  grid.index_to_source[3] = glm::dvec4(10, 20, 30, 1);
  const SourceVolume volume = read(write({grid}));
  EXPECT_NEAR(volume.voxel_size, 0.25, 1e-12);
  EXPECT_EQ(volume.dims, ivec3(3, 4, 10));
  for (int c = 0; c < 3; ++c) expect_near(volume.rotation[c], turn[c], 1e-12);
  expect_near(volume.origin, dvec3(10, 20, 30) + 0.25 * (turn * dvec3(1.5, -0.5, -0.5)), 1e-12);
  VdbGrid plain = one_voxel();
  EXPECT_EQ(read(write({plain})).rotation, glm::dmat3(1.0));
}

TEST_F(ReadVolume, VoxelsThatAreNoCubesAreResampled) {
  VdbGrid grid = one_voxel({3, 0, 5}, 0.75);
  grid.index_to_source[2][2] = 2;
  const SourceVolume tall = read(write({grid}));
  EXPECT_TRUE(has_warning(tall, "cloud.vdb: voxels are 1 x 1 x 2: resampled onto cubes of 1"));
  EXPECT_EQ(tall.dims, ivec3(1, 1, 2));
  EXPECT_EQ(tall.active_voxels, 2u);
  EXPECT_EQ(density_at(tall, {0, 0, 0}), 0.75f);
  EXPECT_EQ(density_at(tall, {0, 0, 1}), 0.75f);
  expect_near(tall.origin, {2.5, -0.5, 9}, 1e-12);
  EXPECT_NE(tall.source_hash, 0u);
  grid.index_to_source = glm::dmat4(1.0);
  grid.index_to_source[1][0] = 0.3;
  EXPECT_TRUE(has_warning(read(write({grid})), "1 x 1.04403 x 1, sheared: resampled onto cubes of 1"));
  grid.index_to_source = glm::dmat4(1.0);
  grid.index_to_source[2][2] = 1e11;
  EXPECT_NE(failure(write({grid}), ErrorCode::Unsupported).find("cloud.vdb: as cubes of 1 it has more than"),
            std::string::npos);
  grid.voxels.push_back({{4000000, 4000000, 5}, 1});
  grid.index_to_source[2][2] = 2000;
  EXPECT_NE(failure(write({grid}), ErrorCode::Unsupported).find("extends over"), std::string::npos);
}

TEST_F(ReadVolume, FrustaAreRefused) {
  const fs::path frustum = folder_.path() / "frustum.vdb";
  test::write_frustum_vdb(frustum);
  EXPECT_NE(failure(frustum, ErrorCode::Unsupported).find("frustum"), std::string::npos);
}

TEST_F(ReadVolume, TheDensityIsFoundByNameOrBecauseThereIsNoOther) {
  VdbGrid smoke = one_voxel();
  smoke.name = "smoke";
  VdbGrid color = one_voxel();
  color.name = "colour", color.kind = VdbGrid::Kind::Color;
  const SourceVolume only = read(write({smoke, color}));
  EXPECT_TRUE(has_warning(only, "ignored: \"colour\""));

  VdbGrid other = one_voxel({0, 0, 0}, 5);
  other.name = "dust";
  const fs::path two = write({smoke, other});
  const std::string message = failure(two, ErrorCode::Unsupported);
  for (const char* words :
       {"several float grids", "--density-grid", "\"smoke\" (float)", "\"dust\" (float)", "cloud.vdb"})
    EXPECT_NE(message.find(words), std::string::npos) << message;
  EXPECT_EQ(read(two, {.density_grid = "dust"}).densest, 5.0f);
  EXPECT_NE(failure(two, ErrorCode::Unsupported, {.density_grid = "fog"}).find("there is no grid \"fog\""),
            std::string::npos);
  EXPECT_NE(failure(write({smoke, color}), ErrorCode::Unsupported, {.density_grid = "colour"}).find("vec3s"),
            std::string::npos);
}

TEST_F(ReadVolume, EmissionIsRefusedAsADensityAndIgnoredBesideOne) {
  VdbGrid hot = one_voxel();
  hot.name = "temperature";
  EXPECT_NE(failure(write({hot}), ErrorCode::Unsupported).find("no float grid is a fog volume"), std::string::npos);
  EXPECT_NE(failure(write({hot}), ErrorCode::Unsupported, {.density_grid = "temperature"}).find("emission"),
            std::string::npos);
  EXPECT_TRUE(has_warning(read(write({one_voxel(), hot})), "emission is not modelled yet; ignored: \"temperature\""));
}

TEST_F(ReadVolume, ValuesThatAreNoDensitiesAreErrorsWithTheirPlace) {
  const auto with = [&](double value) {
    VdbGrid grid = one_voxel();
    grid.voxels.push_back({{4, 5, 6}, value});
    return write({grid});
  };
  EXPECT_NE(failure(with(NAN), ErrorCode::BadFile).find("density nan at voxel (4, 5, 6)"), std::string::npos);
  EXPECT_NE(failure(with(INFINITY), ErrorCode::BadFile).find("density inf at voxel (4, 5, 6)"), std::string::npos);
  EXPECT_NE(failure(with(-0.5), ErrorCode::BadFile).find("negative density -0.5 at voxel (4, 5, 6)"),
            std::string::npos);
  EXPECT_TRUE(has_warning(read(with(-1e-6)), "taken as 0"));
  EXPECT_NE(failure(write({one_voxel({0, 0, 0}, 0)}), ErrorCode::BadFile).find("nothing to see"), std::string::npos);
  EXPECT_NE(failure(write({VdbGrid()}), ErrorCode::BadFile).find("nothing to see"), std::string::npos);
  EXPECT_NE(failure(write({one_voxel()}), ErrorCode::BadFile, {.density_scale = 1e38}).find("--density-scale"),
            std::string::npos);
  VdbGrid endless = one_voxel();
  endless.background = 0.1;
  EXPECT_NE(failure(write({endless}), ErrorCode::Unsupported).find("must end somewhere"), std::string::npos);
}

TEST_F(ReadVolume, ExtremeDensitiesAreRead) {
  EXPECT_EQ(read(write({one_voxel({0, 0, 0}, 1e8)})).densest, 1e8f);
  EXPECT_EQ(read(write({one_voxel({0, 0, 0}, 1e-20)})).densest, 1e-20f);
}

/// Noise, a tile, a turn: all that trees of both kinds have.
VdbGrid varied_grid() {
  VdbGrid grid;
  grid.voxels = test::filled_cube({-30, 120, 4090}, 20, [](const ivec3& v) { return 0.1 + test::smooth_noise(v); });
  grid.tiles = {{{128, 0, 0}, {255, 127, 127}, 0.25}, {{64, 8, 8}, {71, 15, 15}, 0.5}};
  grid.index_to_source = glm::dmat4(0.5 * glm::dmat3(dvec3(0, 1, 0), dvec3(-1, 0, 0), dvec3(0, 0, 1)));
  grid.index_to_source[3] = glm::dvec4(1, 2, 3, 1);
  return grid;
}

TEST_F(ReadVolume, NanoVdbIsWhatOpenVdbIs) {
  const VdbGrid grid = varied_grid();
  const SourceVolume open = read(write({grid}));
  const fs::path path = folder_.path() / "cloud.nvdb";
  for (const bool fp8 : {false, true})
    for (const bool zip : {false, true}) {
      test::write_nvdb(path, grid, fp8, zip);
      ASSERT_TRUE(is_volume_file(path));
      const SourceVolume nano = read(path);
      EXPECT_EQ(nano.dims, open.dims);
      EXPECT_EQ(nano.rotation, open.rotation);
      EXPECT_EQ(nano.origin, open.origin);
      EXPECT_EQ(nano.voxel_size, open.voxel_size);
      EXPECT_EQ(nano.active_voxels, open.active_voxels);
      ASSERT_EQ(nano.brick_table.size(), open.brick_table.size());
      for (size_t entry = 0; entry < open.brick_table.size(); ++entry) {
        ASSERT_EQ(nano.brick_table[entry] == kEmptyBrick, open.brick_table[entry] == kEmptyBrick);
        if (open.brick_table[entry] == kEmptyBrick) continue;
        const DensityBrick &a = nano.bricks[nano.brick_table[entry]], &b = open.bricks[open.brick_table[entry]];
        for (size_t i = 0; i < a.size(); ++i) ASSERT_NEAR(a[i], b[i], fp8 ? 0.005 : 0);
      }
      const auto extent = read_volume_extent(path);
      ASSERT_TRUE(extent);
      EXPECT_EQ(extent->lower, read_volume_extent(folder_.path() / "cloud.vdb")->lower);
    }
  EXPECT_NE(failure(path, ErrorCode::Unsupported, {.density_grid = "smoke"}).find("there is no grid \"smoke\""),
            std::string::npos);
}

// Every cut and every byte: an error or a volume, in bounded memory.
TEST_F(ReadVolume, DamagedNanoVdbIsRefusedOrRead) {
  const fs::path whole = folder_.path() / "cloud.nvdb", damaged = folder_.path() / "damaged.nvdb";
  VdbGrid grid;
  grid.voxels = test::filled_cube({0, 0, 0}, 9, [](const ivec3&) { return 1; });
  test::write_nvdb(whole, grid, false, false);
  const auto bytes = test::read_bytes(whole);
  for (const size_t cut : {size_t{9}, size_t{17}, size_t{200}, size_t{900}, bytes.size() / 2, bytes.size() - 1}) {
    test::write_bytes(damaged, std::span(bytes).first(cut));
    const auto volume = read_volume(damaged);
    ASSERT_FALSE(volume) << cut;
    EXPECT_EQ(volume.error().code, ErrorCode::BadFile) << volume.error().message;
  }
  int refused = 0;
  Rng rng(11);
  for (int i = 0; i < 400; ++i) {
    auto broken = bytes;
    // Headers, tree, root and the first words of each node have the offsets; half of the damage goes there.
    const size_t range = i % 2 == 0 ? 1200 : broken.size();
    const auto at = static_cast<size_t>(rng.next() * static_cast<float>(range - 1));
    for (size_t k = at; k < std::min(at + 8, broken.size()); ++k)
      broken[k] ^= static_cast<std::byte>(1 + static_cast<int>(rng.next() * 254));
    test::write_bytes(damaged, broken);
    if (!read_volume(damaged)) ++refused;
  }
  EXPECT_GT(refused, 20);
  // Two parents of one node, which would make much out of little.
  constexpr size_t kHeaders = 16 + 176 + 8;  // and the name, "density"
  uint64_t counts = 0;
  std::memcpy(&counts, &bytes[kHeaders + 672 + 32], 4);
  EXPECT_EQ(counts, 8u);  // leaves
  auto twice = bytes;
  const std::vector<std::byte> first(twice.begin(), twice.begin() + 8);
  uint64_t lower_offset = 0;
  std::memcpy(&lower_offset, &bytes[kHeaders + 672 + 8], 8);
  const size_t table = kHeaders + 672 + lower_offset + 1088;  // of a lower node: boxes, masks and statistics are before
  int64_t child = 0;
  std::memcpy(&child, &twice[table], 8);
  std::memcpy(&twice[table + 8], &child, 8);
  test::write_bytes(damaged, twice);
  EXPECT_NE(failure(damaged, ErrorCode::BadFile).find("second parent"), std::string::npos);
}

double attenuation_at(const SourceVolume& volume, const ivec3& voxel, const dvec3& in_source) {
  const uint32_t brick = volume.brick_at(voxel / 8);
  const auto& s = volume.shapes[brick][index_in_brick(voxel)];
  const dvec3 w = glm::transpose(volume.rotation) * in_source;
  const double square = double{s[0]} * w.x * w.x + double{s[1]} * w.y * w.y + double{s[2]} * w.z * w.z +
                        2 * (double{s[3]} * w.x * w.y + double{s[4]} * w.x * w.z + double{s[5]} * w.y * w.z);
  return double{density_at(volume, voxel)} * std::sqrt(std::max(square, 0.0));
}

VdbGrid vector_grid(const char* name, const VdbGrid& like, const vec3& value) {
  VdbGrid grid = like;
  grid.name = name, grid.kind = VdbGrid::Kind::Color;
  for (test::VdbVoxel& voxel : grid.voxels) voxel.color = value;
  return grid;
}

TEST_F(ReadVolume, FibresStopAcrossThemselves) {
  VdbGrid density = one_voxel({0, 0, 0}, 2);
  density.voxels.push_back({{1, 0, 0}, 1});
  const double c = std::cos(0.3), s = std::sin(0.3);
  density.index_to_source = glm::dmat4(glm::dmat3(dvec3(c, s, 0), dvec3(-s, c, 0), dvec3(0, 0, 1)));
  VdbGrid fibre = vector_grid("direction", density, vec3(0, 3, 0));  // in the source's space, of any length
  fibre.voxels[1].color = vec3(0.0f);
  const SourceVolume volume = read(write({density, fibre}), {.fibre_roughness = 0.25});
  EXPECT_NEAR(attenuation_at(volume, {0, 0, 0}, {0, 1, 0}), 0.5, 1e-6);
  EXPECT_NEAR(attenuation_at(volume, {0, 0, 0}, {1, 0, 0}), 2, 1e-6);
  EXPECT_NEAR(attenuation_at(volume, {0, 0, 0}, {0, 0, 1}), 2, 1e-6);
  EXPECT_NEAR(attenuation_at(volume, {1, 0, 0}, {0, 0.6, 0.8}), 1, 1e-6);
  EXPECT_TRUE(has_warning(volume, "1 voxels have no direction"));
  EXPECT_NE(failure(folder_.path() / "cloud.vdb", ErrorCode::InvalidArgument, {.fibre_roughness = 1.5})
                .find("--fibre-roughness"),
            std::string::npos);
}

TEST_F(ReadVolume, EllipsoidsAreWhatSggxGridsSay) {
  const VdbGrid density = one_voxel({0, 0, 0}, 2);
  const VdbGrid diagonal = vector_grid("sggx_diagonal", density, vec3(1, 0.25f, 4)),
                rest = vector_grid("sggx_off_diagonal", density, vec3(0.25f, 0, -0.5f));
  const SourceVolume volume = read(write({density, diagonal, rest}));
  EXPECT_NEAR(attenuation_at(volume, {0, 0, 0}, {0, 1, 0}), 1, 1e-6);
  EXPECT_NEAR(attenuation_at(volume, {0, 0, 0}, {0, 0, 1}), 4, 1e-6);
  EXPECT_NEAR(attenuation_at(volume, {0, 0, 0}, {0, 0.6, -0.8}), 2 * std::sqrt(0.09 + 2.56 + 0.48), 1e-6);
  EXPECT_FALSE(has_warning(volume, "sggx"));
  EXPECT_NE(failure(write({density, diagonal}), ErrorCode::Unsupported).find("belong together"), std::string::npos);
  EXPECT_NE(
      failure(write({density, diagonal, vector_grid("sggx_off_diagonal", density, vec3(NAN))}), ErrorCode::BadFile)
          .find("\"sggx_off_diagonal\" has the value (nan, nan, nan) at voxel (0, 0, 0)"),
      std::string::npos);
  const SourceVolume mended =
      read(write({density, diagonal, vector_grid("sggx_off_diagonal", density, vec3(9, 0, 0))}));
  EXPECT_TRUE(has_warning(mended, "1 voxels have matrices that are no SGGX"));
  EXPECT_TRUE(has_warning(read(write({density, vector_grid("sggx_diagonal", density, vec3(0.0f)), rest})),
                          "1 voxels have no SGGX"));
}

TEST_F(ReadVolume, LevelSetsBecomeFogOnlyWhenAsked) {
  VdbGrid grid;
  grid.kind = VdbGrid::Kind::LevelSet;
  grid.name = "surface";
  grid.background = 3;
  grid.voxels = test::filled_cube({-8, -8, -8}, 17, [](const ivec3& v) {
    const double d = glm::length(dvec3(v) - 8.0) - 5;
    return std::abs(d) < 3 ? d : 0;
  });
  const fs::path path = write({grid});
  EXPECT_NE(failure(path, ErrorCode::Unsupported, {.density_grid = "surface"}).find("--level-set"), std::string::npos);
  const SourceVolume fog = read(path, {.level_set = true});
  EXPECT_GT(fog.active_voxels, 100u);
  EXPECT_LE(fog.densest, 1.0f);
}

TEST_F(ReadVolume, AnExtentThatNoLevelCanHoldIsRefusedBeforeMemoryIsTaken) {
  VdbGrid grid = one_voxel();
  grid.voxels.push_back({{1000000, 1000000, 1000000}, 1});
  EXPECT_NE(failure(write({grid}), ErrorCode::Unsupported).find("crop it or split it"), std::string::npos);
  grid.voxels.back().at = {2000000000, 0, 0};
  grid.voxels.push_back({{-2000000000, 0, 0}, 1});
  EXPECT_NE(failure(write({grid}), ErrorCode::Unsupported).find("4000000001 x 1 x 1"), std::string::npos);
}

TEST_F(ReadVolume, AlbedosComeFromTheOptionOrTheFileOrAreGuessedAloud) {
  VdbGrid density = one_voxel();
  density.voxels.push_back({{9, 0, 0}, 1});
  VdbGrid color;
  color.kind = VdbGrid::Kind::Color, color.name = "Cd";
  color.voxels = {{{0, 0, 0}, 0, vec3(0.25f, 0.5f, 1.0f)}, {{9, 0, 0}, 0, vec3(1.5f, 0, 0)}};
  const fs::path path = write({density, color});
  const SourceVolume colored = read(path);
  ASSERT_EQ(colored.albedos.size(), colored.bricks.size());
  const vec3 first = unpack_albedo(colored.albedos[colored.brick_at({0, 0, 0})][0]);
  EXPECT_NEAR(first.x, 0.25f, 1e-4f);
  EXPECT_NEAR(first.z, 1.0f, 1e-4f);
  EXPECT_TRUE(has_warning(colored, "1 albedos outside [0, 1]"));
  const SourceVolume chosen = read(path, {.albedo = vec3(0.5f)});
  EXPECT_TRUE(chosen.albedos.empty());
  EXPECT_EQ(chosen.albedo, vec3(0.5f));

  const SourceVolume guessed = read(write({density}));
  EXPECT_EQ(guessed.albedo, vec3(kDefaultAlbedo));
  EXPECT_TRUE(has_warning(guessed, "says no albedo"));
  color.index_to_source = scaled(2);
  EXPECT_NE(failure(write({density, color}), ErrorCode::Unsupported).find("other transforms"), std::string::npos);
}

TEST_F(ReadVolume, OptionsAreChecked) {
  const fs::path path = write({one_voxel()});
  for (const FogOptions& options :
       {FogOptions{.density_scale = 0}, FogOptions{.density_scale = NAN}, FogOptions{.anisotropy = 0.99},
        FogOptions{.albedo = vec3(1.1f)}, FogOptions{.albedo = vec3(0.5f, NAN, 0.5f)}, FogOptions{.anisotropy = NAN}})
    failure(path, ErrorCode::InvalidArgument, options);
}

TEST_F(ReadVolume, OptionsAreInTheHash) {
  const fs::path path = write({one_voxel()});
  const uint64_t plain = hash_volume(path, {}).value();
  EXPECT_EQ(read(path).source_hash, plain);
  for (const FogOptions& options : {FogOptions{.density_scale = 2}, FogOptions{.albedo = vec3(1.0f)},
                                    FogOptions{.anisotropy = 0.5}, FogOptions{.density_grid = "density"}})
    EXPECT_NE(hash_volume(path, options).value(), plain);
}

TEST_F(ReadVolume, DamagedFilesAreErrors) {
  VdbGrid grid;
  grid.voxels = test::filled_cube({0, 0, 0}, 20, [](const ivec3& v) { return 1.0 + v.x; });
  const fs::path path = write({grid}), broken = folder_.path() / "broken.vdb";
  const std::vector<std::byte> bytes = test::read_bytes(path);
  for (size_t cut = 8; cut < bytes.size(); cut += bytes.size() / 37) {
    test::write_bytes(broken, std::span(bytes).first(cut));
    const auto volume = read_volume(broken);
    ASSERT_FALSE(volume) << cut;
    EXPECT_EQ(volume.error().code, ErrorCode::BadFile) << cut << ' ' << volume.error().message;
  }
  failure(folder_.path() / "none.vdb", ErrorCode::NotFound);
  failure(folder_.path(), ErrorCode::Io);
  failure(folder_.write("text.vdb", "this is no volume at all"), ErrorCode::BadFile);
  failure(folder_.write("empty.vdb", ""), ErrorCode::BadFile);
}

TEST_F(ReadVolume, FilesAreKnownByTheirFirstBytes) {
  const fs::path path = write({one_voxel()});
  const fs::path other = folder_.path() / "cloud";
  fs::rename(path, other);
  EXPECT_TRUE(is_volume_file(other));
  EXPECT_TRUE(is_volume_file(folder_.path() / "gone.VDB"));
  EXPECT_FALSE(is_volume_file(folder_.write("model.obj", "v 0 0 0\nv 1 0 0\n")));
}

}  // namespace
}  // namespace farfield
