// SPDX-License-Identifier: Apache-2.0
#include "cache/level_file.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cstring>
#include <functional>

#include "base/hash.h"
#include "base/random.h"
#include "cache/level_format.h"
#include "sample_asset.h"

namespace farfield {
namespace {

using test::FileImage;
using test::full_level;
using test::TemporaryFolder;

void expect_same(const LevelView& a, const LevelView& b) {
  EXPECT_EQ(a.header.level, b.header.level);
  EXPECT_EQ(a.header.resolution, b.header.resolution);
  EXPECT_EQ(a.header.bounds.lower, b.header.bounds.lower);
  EXPECT_EQ(a.header.bounds.upper, b.header.bounds.upper);
  EXPECT_EQ(a.header.brick_dims, b.header.brick_dims);
  EXPECT_EQ(a.header.volume_origin, b.header.volume_origin);
  std::vector<std::span<const std::byte>> sections;
  for_each_section(a, [&](SectionId, const auto& array) { sections.push_back(std::as_bytes(array)); });
  size_t i = 0;
  for_each_section(b, [&](SectionId id, const auto& array) {
    const auto bytes = std::as_bytes(array);
    EXPECT_EQ(sections[i].size(), bytes.size()) << section_name(id);
    EXPECT_TRUE(std::ranges::equal(sections[i], bytes)) << section_name(id);
    ++i;
  });
}

TEST(LevelFile, GivesBackWhatWasWritten) {
  const TemporaryFolder folder;
  for (uint64_t seed = 0; seed < 60; ++seed) {
    const LevelData level = seed == 0
                                ? full_level()
                                : test::random_level(seed, static_cast<uint32_t>(seed % 7 * seed + (seed % 3 == 0)),
                                                     static_cast<uint32_t>(seed % 4 * seed / 3 + (seed % 3 == 0)));
    if (!level.has_surface() && !level.has_volume()) continue;
    const auto path = folder.path() / fmt::format("{}.ffl", seed);
    const Result<uint64_t> written = write_level(path, level);
    ASSERT_TRUE(written) << written.error().message;
    for (const LevelCheck check : {LevelCheck::Structure, LevelCheck::Full}) {
      const auto file = LevelFile::open(path, check);
      ASSERT_TRUE(file) << file.error().message;
      expect_same((*file)->view(), view_of(level));
      EXPECT_EQ((*file)->file_bytes(), *written);
      EXPECT_EQ(std::filesystem::file_size(path), *written);
      for_each_section((*file)->view(), [](SectionId id, const auto& array) {
        EXPECT_EQ(reinterpret_cast<uintptr_t>(array.data()) % 64, 0u) << section_name(id);
      });
    }
  }
}

TEST(LevelFile, BytesDependOnlyOnTheLevel) {
  const LevelData level = test::random_level(5, 100, 10);
  FileImage first(level), second(level);
  EXPECT_TRUE(std::ranges::equal(first.bytes(), second.bytes()));
}

TEST(LevelFile, SizesAreKnownBeforeWriting) {
  const TemporaryFolder folder;
  const LevelData level = test::random_level(6, 5000, 10);
  const auto path = folder.path() / "a.ffl";
  const LevelFileSizes sizes = level_file_sizes(view_of(level));
  EXPECT_EQ(*write_level(path, level), sizes.file_bytes);
  EXPECT_EQ(sizes.mapped_bytes, (sizes.file_bytes + 4095) / 4096 * 4096);
  const auto file = LevelFile::open(path, LevelCheck::Full);
  ASSERT_TRUE(file);
  EXPECT_EQ((*file)->build_only_bytes(), sizes.build_only_bytes);
  // 5003 positions and 5000 quads: at most the first and the last page are shared with other sections.
  EXPECT_EQ(sizes.build_only_bytes % 4096, 0u);
  EXPECT_GE(sizes.build_only_bytes, 5003u * 12 + 5000 * 16 - 2 * 4096);
  EXPECT_EQ(level_file_sizes(view_of(full_level())).build_only_bytes, 0u);
}

TEST(LevelFile, MorphMapsAreGivenBackToo) {
  LevelData level = test::random_level(6, 5000, 10);
  level.morph_vertex.clear();
  level.morph_face.clear();
  const LevelFileSizes without = level_file_sizes(view_of(level));
  level.morph_vertex.assign(10000, 0);
  level.morph_face.assign(10000, 0);
  const LevelFileSizes with = level_file_sizes(view_of(level));
  EXPECT_GE(with.build_only_bytes, without.build_only_bytes + 80000 - 2 * 4096);
  EXPECT_LE(with.build_only_bytes, with.mapped_bytes);
}

TEST(LevelFile, ReleasedBuildPagesComeBackUnchanged) {
  const TemporaryFolder folder;
  const LevelData level = test::random_level(6, 5000, 10);
  const auto path = folder.path() / "a.ffl";
  ASSERT_TRUE(write_level(path, level));
  const auto file = LevelFile::open(path, LevelCheck::Full);
  ASSERT_TRUE(file);
  const uint64_t before = test::walk((*file)->view());
  (*file)->release_build_pages();
  EXPECT_EQ(test::walk((*file)->view()), before);
}

}  // namespace
}  // namespace farfield
