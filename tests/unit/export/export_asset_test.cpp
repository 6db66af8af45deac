// SPDX-License-Identifier: Apache-2.0
// What an export refuses, and that it writes all or nothing.
#include "export/export_asset.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "base/hash.h"
#include "base/random.h"
#include "cache/level_format.h"
#include "cache/manifest.h"
#include "tests/support/asset_writer.h"
#include "tests/support/file_size_limit.h"
#include "tests/support/files.h"
#include "tests/support/level_builder.h"

namespace farfield {
namespace {

namespace fs = std::filesystem;

const std::vector<std::string> kNames = {"a.vdb", "a.obj", "a.ply", "a.glb"};

class ExportAsset : public testing::Test {
 protected:
  fs::path path(const std::string& name) const { return folder_.path() / name; }
  fs::path asset() const { return path("a.farfield"); }
  fs::path write(const std::vector<LevelData>& levels) const {
    test::write_asset(asset(), levels, [](const LevelView&) { return LevelCost{1 << 22, 100}; });
    return asset();
  }
  Manifest write_sample() const {
    fs::create_directories(asset());
    return test::write_sample_asset(asset());
  }
  void expect_error(const std::string& name, std::vector<uint32_t> levels, ErrorCode code, const std::string& words) {
    const auto report = export_asset(asset(), path(name), {std::move(levels)});
    ASSERT_FALSE(report) << name;
    EXPECT_EQ(report.error().code, code) << report.error().message;
    EXPECT_NE(report.error().message.find(words), std::string::npos) << report.error().message;
    EXPECT_FALSE(fs::exists(path(name)));
  }
  const test::TemporaryFolder folder_;
};

TEST_F(ExportAsset, KnowsFormatsByTheirEndings) {
  EXPECT_EQ(export_format_of("a.vdb").value(), ExportFormat::Vdb);
  EXPECT_EQ(export_format_of("b/a.PLY").value(), ExportFormat::Ply);
  for (const char* name : {"a", "a.gltf", "a.obj.gz", "vdb", ".obj", "a.farfield", ""})
    EXPECT_EQ(export_format_of(name).error().code, ErrorCode::InvalidArgument) << name;
  EXPECT_EQ(files_of_export("b/a.obj"), (std::vector<fs::path>{"b/a.obj", "b/a.mtl"}));
  EXPECT_EQ(files_of_export("a.glb"), (std::vector<fs::path>{"a.glb"}));
}

TEST_F(ExportAsset, RefusesWhatIsNotThereAndSaysWhatIs) {
  expect_error("a.vdb", {0}, ErrorCode::NotFound, "a.farfield");
  LevelData haze = test::empty_level(5, 0.5f);
  test::set_volume(haze, {1, 1, 1}, {0, 0, 0}, [](int, int, int) { return 1.0f; });
  write({test::sphere_level({0, 0, 0}, 1, 8, 0, 0.1f), test::sphere_level({0, 0, 0}, 1, 8, 2, 0.4f), haze});
  expect_error("a.vdb", {4}, ErrorCode::InvalidArgument, "there is no level 4; it has 0, 2, 5");
  expect_error("a.vdb", {5, 2}, ErrorCode::InvalidArgument, "level 2 has no volume");
  expect_error("a.vdb", {0}, ErrorCode::InvalidArgument, "levels with one: 5");
  expect_error("a.glb", {5}, ErrorCode::InvalidArgument, "levels with one: 0, 2");
  expect_error("a.ply", {0, 2}, ErrorCode::InvalidArgument, "choose one of 0, 2");
  expect_error("a.obj", {}, ErrorCode::InvalidArgument, "choose one of 0, 2");
  expect_error("a.stl", {0}, ErrorCode::InvalidArgument, "must end in .vdb");
  const auto all = export_asset(asset(), path("a.vdb"), {});
  ASSERT_TRUE(all) << all.error().message;
  ASSERT_EQ(all->notes.size(), 1u);
  EXPECT_NE(all->notes[0].find("left out: 0, 2"), std::string::npos) << all->notes[0];
}

TEST_F(ExportAsset, OfSurfacesAloneHasNoVolume) {
  write({test::sphere_level({0, 0, 0}, 1, 8, 0, 0.1f)});
  expect_error("a.vdb", {}, ErrorCode::InvalidArgument, "no level has a volume");
  expect_error("a.vdb", {0}, ErrorCode::InvalidArgument, "no level has one");
}

TEST_F(ExportAsset, IsWholeOrAbsentOnAFullDisk) {
  write({test::random_level(6, 3000, 40)});
  const uint32_t level = read_manifest(asset()).value().levels[0].level;
  for (const std::string& name : kNames) {
    test::write_text(path(name), "before");
    {
      const test::FileSizeLimit limit(20000);
      const auto report = export_asset(asset(), path(name), {{level}});
      ASSERT_FALSE(report) << name;
      EXPECT_EQ(report.error().code, ErrorCode::Io);
      EXPECT_NE(report.error().message.find("cannot write"), std::string::npos) << report.error().message;
      EXPECT_NE(report.error().message.find("ulimit"), std::string::npos) << report.error().message;
    }
    EXPECT_EQ(fs::file_size(path(name)), 6u) << name;
    EXPECT_TRUE(export_asset(asset(), path(name), {{level}})) << name;
    EXPECT_GT(fs::file_size(path(name)), 20000u) << name;
  }
  EXPECT_EQ(folder_.names(), (std::vector<std::string>{"a.farfield", "a.glb", "a.mtl", "a.obj", "a.ply", "a.vdb"}));
}

TEST_F(ExportAsset, StopsWhenAsked) {
  write({test::random_level(6, 300, 4)});
  const uint32_t level = read_manifest(asset()).value().levels[0].level;
  const std::atomic<bool> cancel{true};
  for (const std::string& name : kNames) {
    const auto report = export_asset(asset(), path(name), {{level}}, Job{{}, &cancel});
    ASSERT_FALSE(report) << name;
    EXPECT_EQ(report.error().code, ErrorCode::Cancelled) << report.error().message;
  }
  EXPECT_EQ(folder_.names(), (std::vector<std::string>{"a.farfield"}));
}

/// A few bytes become others, or the file ends early.
void damage(std::vector<std::byte>& bytes, Rng& rng) {
  if (rng.next_uint() % 16 == 0) bytes.resize(rng.next_uint() % bytes.size());
  const size_t range = rng.next_uint() % 2 == 0 ? std::min<size_t>(bytes.size(), 1200) : bytes.size();
  for (uint32_t change = 0; range > 0 && change <= rng.next_uint() % 4; ++change)
    bytes[rng.next_uint() % range] = static_cast<std::byte>(rng.next_uint() % 3 == 0 ? 0xff : rng.next_uint());
}

// Half of the damage has its checksums made right, as somebody would who means harm: then the level may even be sound.
TEST_F(ExportAsset, DamagedLevelsAreErrorsAndWriteNothing) {
  const Manifest sound = write_sample();
  Rng rng(3);
  int refused = 0, written = 0;
  for (int round = 0; round < 150; ++round) {
    const LevelEntry& entry = sound.levels[rng.next_uint() % sound.levels.size()];
    const std::vector<std::byte> original = test::read_bytes(asset() / entry.file);
    std::vector<std::byte> bytes = original;
    damage(bytes, rng);
    const bool is_sealed = round % 2 == 0;
    if (is_sealed) {
      seal_head(bytes);
      Manifest manifest = sound;
      for (LevelEntry& e : manifest.levels)
        if (e.level == entry.level) e.file_hash = hash_bytes(bytes), e.file_bytes = bytes.size();
      if (!write_manifest(asset(), manifest)) continue;  // an empty file
    }
    test::write_bytes(asset() / entry.file, bytes);
    const bool as_volume = entry.triangles == 0 || (entry.voxels > 0 && rng.next_uint() % 2 == 0);
    const fs::path target = path(as_volume ? "a.vdb" : kNames[1 + rng.next_uint() % 3]);
    const auto report = export_asset(asset(), target, {{entry.level}});
    report ? ++written : ++refused;
    if (!is_sealed && bytes != original) {
      EXPECT_FALSE(report) << round;
      // Unsupported: the format's version was hit.
      const ErrorCode code = report ? ErrorCode::BadFile : report.error().code;
      EXPECT_TRUE(code == ErrorCode::BadFile || code == ErrorCode::Unsupported) << round;
    }
    EXPECT_EQ(fs::exists(target), report.has_value()) << round;
    fs::remove(target);
    test::write_bytes(asset() / entry.file, original);
    ASSERT_TRUE(write_manifest(asset(), sound));
  }
  EXPECT_GT(refused, 75);
  EXPECT_GT(written, 2);
}

TEST_F(ExportAsset, AnotherLevelsFileIsNotTheOneThatTheManifestMeans) {
  Manifest manifest = write_sample();
  std::swap(manifest.levels[1].file, manifest.levels[2].file);
  std::swap(manifest.levels[1].file_hash, manifest.levels[2].file_hash);
  std::swap(manifest.levels[1].file_bytes, manifest.levels[2].file_bytes);
  ASSERT_TRUE(write_manifest(asset(), manifest));
  expect_error("a.ply", {1}, ErrorCode::BadFile, "is not the level that the manifest describes");
}

}  // namespace
}  // namespace farfield
