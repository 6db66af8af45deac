// SPDX-License-Identifier: Apache-2.0
#include "cache/verify.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <functional>

#include "base/hash.h"
#include "cache/level_file.h"
#include "cache/level_format.h"
#include "cache/manifest.h"
#include "tests/support/asset_writer.h"
#include "tests/support/files.h"

namespace farfield {
namespace {

using test::TemporaryFolder;

std::string text_of(const VerifyResult& result) {
  std::string text;
  for (const Finding& finding : result.findings) text += finding.message + "\n";
  return text;
}

/// Expects errors whose messages contain `words`.
void expect_error(const VerifyResult& result, const std::string& words) {
  EXPECT_FALSE(result.is_sound());
  EXPECT_NE(text_of(result).find(words), std::string::npos) << "expected: " << words << "\n" << text_of(result);
}

TEST(VerifyAsset, FindsNothingInASoundAsset) {
  const TemporaryFolder folder;
  const Manifest manifest = test::write_sample_asset(folder.path());
  const VerifyResult result = verify_asset(folder.path());
  EXPECT_TRUE(result.findings.empty()) << text_of(result);
  EXPECT_TRUE(result.is_sound());
  EXPECT_EQ(result.levels_checked, 3u);
  EXPECT_EQ(result.bytes_checked,
            manifest.levels[0].file_bytes + manifest.levels[1].file_bytes + manifest.levels[2].file_bytes);
}

TEST(VerifyAsset, HoldsWhatLevelsTakeAgainstTheManifest) {
  const TemporaryFolder folder;
  const Manifest manifest = test::write_sample_asset(folder.path());
  const auto with_factor = [&](double factor) {
    const auto measure = [&, i = size_t{0}](const LevelView&) mutable -> Result<LevelCost> {
      const LevelEntry& entry = manifest.levels[i++];
      const auto times = [&](uint64_t bytes) { return static_cast<uint64_t>(factor * static_cast<double>(bytes)); };
      return LevelCost{times(entry.resident_bytes), times(entry.build_peak_bytes)};
    };
    return verify_asset(folder.path(), {measure, {}});
  };
  EXPECT_TRUE(with_factor(1.0).findings.empty()) << text_of(with_factor(1.0));
  EXPECT_TRUE(with_factor(1.2).is_sound());
  EXPECT_EQ(with_factor(1.2).findings.size(), 3u);
  expect_error(with_factor(1.7), "more while it is loaded; the manifest says");
  const auto fails = [](const LevelView&) -> Result<LevelCost> { return make_error(ErrorCode::Io, "no luck"); };
  expect_error(verify_asset(folder.path(), {fails, {}}), "it cannot be loaded: no luck");
}

TEST(VerifyAsset, HoldsWhatMorphsTakeAgainstTheManifest) {
  const TemporaryFolder folder;
  Manifest manifest = test::write_sample_asset(folder.path());
  manifest.levels[1].morph = LevelCost{3000, 600};  // from level 0; none was measured from level 1
  ASSERT_TRUE(write_manifest(folder.path(), manifest));
  const auto with = [&](const Result<LevelCost>& cost) {
    return verify_asset(folder.path(), {{}, [&](const LevelView& fine, const LevelView& coarse) {
                                          EXPECT_EQ(fine.header.level, manifest.levels[0].level);
                                          EXPECT_EQ(coarse.header.level, manifest.levels[1].level);
                                          return cost;
                                        }});
  };
  EXPECT_TRUE(with(LevelCost{3000, 600}).findings.empty()) << text_of(with(LevelCost{3000, 600}));
  const VerifyResult other = with(LevelCost{3100, 600});
  EXPECT_TRUE(other.is_sound());
  ASSERT_EQ(other.findings.size(), 1u);
  EXPECT_EQ(other.findings[0].file, manifest.levels[1].file);
  expect_error(with(LevelCost{6000, 600}),
               manifest.levels[1].file +
                   ": its morph from the next finer level takes 6000 bytes, and 600 more while it "
                   "is loaded; the manifest says 3000 and 600; bake the asset again");
  expect_error(with(make_error(ErrorCode::Io, "no luck")),
               "its morph from the next finer level cannot be loaded: no luck");
}

TEST(VerifyAsset, FindsEveryFigureOfTheManifestThatTheFilesContradict) {
  using Change = std::function<void(Manifest&)>;
  const std::vector<std::pair<std::string, Change>> cases = {
      {"the file's size is", [](Manifest& m) { ++m.levels[1].file_bytes; }},
      {"the file's hash is", [](Manifest& m) { m.levels[2].file_hash ^= 1; }},
      {"the number of triangles is", [](Manifest& m) { ++m.levels[0].triangles; }},
      {"the number of voxels is", [](Manifest& m) { --m.levels[1].voxels; }},
      {"the number of bricks is", [](Manifest& m) { ++m.levels[2].bricks; }},
      {"the level's number is", [](Manifest& m) { m.levels[2].level = 4; }},
      {"the resolution is", [](Manifest& m) { m.levels[2].resolution *= 1.01; }},
      {"expected 0.25", [](Manifest& m) { m.base_resolution *= 2; }},
      {"resident bytes", [](Manifest& m) { m.levels[0].resident_bytes = 10; }},
      {"out of the manifest's bounds", [](Manifest& m) { m.bounds.upper.x *= 0.9f; }},
      {"out of the manifest's hull", [](Manifest& m) { m.hull.resize(5); }},
      {"level_1.ffl: the file's hash", [](Manifest& m) { std::swap(m.levels[0].file, m.levels[1].file); }},
  };
  for (const auto& [words, change] : cases) {
    const TemporaryFolder folder;
    Manifest manifest = test::write_sample_asset(folder.path());
    change(manifest);
    ASSERT_TRUE(write_manifest(folder.path(), manifest)) << words;
    expect_error(verify_asset(folder.path()), words);
  }
}

TEST(VerifyAsset, FindsAFlippedBitInAnyFile) {
  const TemporaryFolder folder;
  const Manifest manifest = test::write_sample_asset(folder.path());
  for (const LevelEntry& level : manifest.levels) {
    const auto path = folder.path() / level.file;
    const std::vector<std::byte> sound = test::read_bytes(path);
    std::vector<std::byte> bytes = sound;
    bytes[bytes.size() / 2] ^= std::byte{4};
    test::write_bytes(path, bytes);
    expect_error(verify_asset(folder.path()), level.file);
    test::write_bytes(path, sound);
  }
  EXPECT_TRUE(verify_asset(folder.path()).is_sound());
}

TEST(VerifyAsset, FindsMissingTruncatedAndLinkedFilesAndGoesOn) {
  const TemporaryFolder folder;
  const Manifest manifest = test::write_sample_asset(folder.path());
  std::filesystem::remove(folder.path() / manifest.levels[0].file);
  std::filesystem::resize_file(folder.path() / manifest.levels[1].file, 1000);
  const auto linked = folder.path() / manifest.levels[2].file;
  const TemporaryFolder elsewhere;
  std::filesystem::rename(linked, elsewhere.path() / "x");
  std::filesystem::create_symlink(elsewhere.path() / "x", linked);
  const VerifyResult result = verify_asset(folder.path());
  EXPECT_EQ(result.findings.size(), 3u) << text_of(result);
  expect_error(result, "No such file");
  expect_error(result, "1000");
  expect_error(result, "symbolic link");
}

TEST(VerifyAsset, FindsMorphMapsOfAnotherLevel) {
  const TemporaryFolder folder;
  Manifest manifest = test::write_sample_asset(folder.path());
  // Level 1 becomes a copy of itself with one vertex less in its map.
  const auto path = folder.path() / manifest.levels[1].file;
  LevelData level;
  {
    const auto file = LevelFile::open(path, LevelCheck::Full);
    ASSERT_TRUE(file);
    const LevelView& view = (*file)->view();
    level.header = view.header;
    level.positions.assign(view.positions.begin(), view.positions.end());
    level.quads.assign(view.quads.begin(), view.quads.end());
    level.quad_first_face.assign(view.quad_first_face.begin(), view.quad_first_face.end());
    level.header.brick_dims = {0, 0, 0};
    level.morph_vertex.assign(view.morph_vertex.begin(), view.morph_vertex.end() - 1);
  }
  ASSERT_TRUE(write_level(path, level));
  const VerifyResult result = verify_asset(folder.path());
  expect_error(result, "its morph map has 52 vertices, and the next finer level has 53");
  expect_error(result, "its morph map has 0 faces");
}

TEST(VerifyAsset, WarnsOfFilesThatDoNotBelong) {
  const TemporaryFolder folder;
  test::write_sample_asset(folder.path());
  test::write_text(folder.path() / "b.tmp-1-2", "x");
  test::write_text(folder.path() / "a.txt", "x");
  const VerifyResult result = verify_asset(folder.path());
  EXPECT_TRUE(result.is_sound());
  ASSERT_EQ(result.findings.size(), 2u);
  EXPECT_EQ(result.findings[0].file, "a.txt");
  EXPECT_EQ(result.findings[1].file, "b.tmp-1-2");
  EXPECT_EQ(result.findings[1].severity, Finding::Severity::Warning);
}

TEST(VerifyAsset, SaysWhatIsWrongWithAFolderThatIsNoAsset) {
  const TemporaryFolder folder;
  expect_error(verify_asset(folder.path()), "is not a baked asset");
  expect_error(verify_asset(folder.path() / "missing"), "is not a baked asset");
  test::write_text(folder.path() / kManifestName, "{}");
  expect_error(verify_asset(folder.path()), "\"version\" is missing");
}

}  // namespace
}  // namespace farfield
