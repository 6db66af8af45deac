// SPDX-License-Identifier: Apache-2.0
#include "cache/level.h"

#include <gtest/gtest.h>

#include <limits>
#include <set>

#include "base/random.h"
#include "cache/level_format.h"
#include "tests/support/level_builder.h"

namespace farfield {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInf = std::numeric_limits<float>::infinity();

TEST(PackedColor, EveryStoredColorSurvivesUnpackingAndPacking) {
  for (int q = 0; q < 256; ++q) {
    const PackedColor color{{static_cast<uint8_t>(q), 0, 255}};
    EXPECT_EQ(pack_color(unpack_color(color)), color);
  }
}

TEST(PackedColor, ErrorIsHalfAStepOfTheSquareRoot) {
  Rng rng(1);
  for (int i = 0; i < 10000; ++i) {
    const vec3 c(rng.next(), rng.next() * 0.01f, 1.0f);
    const vec3 back = unpack_color(pack_color(c));
    for (int axis = 0; axis < 3; ++axis) {
      EXPECT_LE(std::abs(std::sqrt(back[axis]) - std::sqrt(c[axis])), 0.5f / 255.0f + 1e-6f);
    }
  }
}

TEST(PackedColor, ClampsAndTakesNanForBlack) {
  EXPECT_EQ(pack_color({-1.0f, 2.0f, kNan}), (PackedColor{{0, 255, 0}}));
  EXPECT_EQ(pack_color({kInf, -kInf, -0.0f}), (PackedColor{{255, 0, 0}}));
}

TEST(PackUnorm8, RoundsClampsAndTakesNanForZero) {
  for (int q = 0; q < 256; ++q) EXPECT_EQ(pack_unorm8(unpack_unorm8(static_cast<uint8_t>(q))), q);
  EXPECT_EQ(pack_unorm8(0.5f / 255.0f), 1);
  EXPECT_EQ(pack_unorm8(-1e30f), 0);
  EXPECT_EQ(pack_unorm8(1.0001f), 255);
  EXPECT_EQ(pack_unorm8(kInf), 255);
  EXPECT_EQ(pack_unorm8(kNan), 0);
}

TEST(Brick, PayloadIndicesOfTheActiveVoxelsCountUp) {
  const LevelData level = test::random_level(7, 0, 20);
  uint32_t expected = 0;
  for (const Brick& brick : level.bricks) {
    for (int i = 0; i < kBrickVoxels; ++i) {
      if (brick.density[static_cast<size_t>(i)] != 0) {
        EXPECT_EQ(brick.payload_index(i), expected++);
      }
    }
  }
  EXPECT_EQ(voxel_count(level), expected);
}

TEST(LevelView, ShowsEveryArrayOfItsLevel) {
  const LevelData level = test::full_level();
  const LevelView view = view_of(level);
  std::vector<std::span<const std::byte>> owned, seen;
  for_each_section(level, [&](SectionId, const auto& array) { owned.push_back(std::as_bytes(std::span(array))); });
  for_each_section(view, [&](SectionId, const auto& array) { seen.push_back(std::as_bytes(array)); });
  ASSERT_EQ(owned.size(), seen.size());
  for (size_t i = 0; i < owned.size(); ++i) {
    EXPECT_FALSE(owned[i].empty());
    EXPECT_EQ(owned[i].data(), seen[i].data());
    EXPECT_EQ(owned[i].size(), seen[i].size());
  }
  EXPECT_EQ(face_count(view), 3u);
  EXPECT_EQ(voxel_count(view), 5u);
}

TEST(LevelView, OfAnEmptyLevelHasNoFacesAndNoVoxels) {
  const LevelData level;
  EXPECT_EQ(face_count(view_of(level)), 0u);
  EXPECT_EQ(voxel_count(view_of(level)), 0u);
  EXPECT_FALSE(level.has_surface());
  EXPECT_FALSE(level.has_volume());
}

TEST(SectionName, IsDifferentForEachSection) {
  std::set<std::string_view> names;
  const LevelView view;
  for_each_section(view, [&](SectionId id, const auto&) { names.insert(section_name(id)); });
  EXPECT_EQ(names.size(), 18u);
  EXPECT_FALSE(names.contains(section_name(SectionId{0})));
}

}  // namespace
}  // namespace farfield
