// SPDX-License-Identifier: Apache-2.0
#include "cache/level.h"

#include <gtest/gtest.h>

#include <set>

#include "base/nonfinite.h"
#include "base/random.h"
#include "cache/level_format.h"
#include "tests/support/level_builder.h"

namespace farfield {
namespace {

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
  EXPECT_EQ(pack_color({kInfinity, -kInfinity, -0.0f}), (PackedColor{{255, 0, 0}}));
}

TEST(PackUnorm8, RoundsClampsAndTakesNanForZero) {
  for (int q = 0; q < 256; ++q) EXPECT_EQ(pack_unorm8(unpack_unorm8(static_cast<uint8_t>(q))), q);
  EXPECT_EQ(pack_unorm8(0.5f / 255.0f), 1);
  EXPECT_EQ(pack_unorm8(-1e30f), 0);
  EXPECT_EQ(pack_unorm8(1.0001f), 255);
  EXPECT_EQ(pack_unorm8(kInfinity), 255);
  EXPECT_EQ(pack_unorm8(kNan), 0);
}

TEST(PackSheetShape, KeepsSheetsSheets) {
  for (const float order : {1e-6f, 0.3f, 1.0f}) {
    const SheetShape back = unpack_sheet_shape(pack_sheet_shape({0.25f, order, 0.75f}));
    EXPECT_TRUE(back.is_sheet());
    EXPECT_NEAR(back.order, order, 1.0f / 255);
    EXPECT_NEAR(back.edge, 0.25f, 0.5f / 255 + 1e-6f);
    EXPECT_NEAR(back.caught, 0.75f, 0.5f / 255 + 1e-6f);
  }
  EXPECT_FALSE(unpack_sheet_shape(pack_sheet_shape({1, 0, 1})).is_sheet());
  EXPECT_FALSE(unpack_sheet_shape(pack_sheet_shape({1, kNan, 1})).is_sheet());
}

TEST(PackRadiance, KeepsTheLargestChannelToHalfAPercent) {
  EXPECT_EQ(unpack_radiance(pack_radiance(vec3(0.0f))), vec3(0.0f));
  EXPECT_EQ(unpack_radiance(pack_radiance(vec3(-1.0f, kNan, 0.0f))), vec3(0.0f));
  EXPECT_EQ(unpack_radiance(pack_radiance(vec3(1e-31f))), vec3(0.0f));
  for (const float scale : {1e-29f, 1e-6f, 0.9999f, 1.0f, 3.0f, 255.9f, 1e6f, 1e29f}) {
    const vec3 radiance = scale * vec3(1.0f, 0.5f, 0.001f);
    const vec3 back = unpack_radiance(pack_radiance(radiance));
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(back[c], radiance[c], 0.004f * scale) << scale;
  }
  EXPECT_NEAR(unpack_radiance(pack_radiance(vec3(kInfinity)))[0], 1e30f, 1e28f);
}

TEST(PackNormal, KeepsDirectionsAllAround) {
  for (int i = 0; i < 5000; ++i) {
    const float z = 2 * (static_cast<float>(i) + 0.5f) / 5000 - 1, angle = 2.4f * static_cast<float>(i);
    const float r = std::sqrt(1 - z * z);
    const vec3 normal(r * std::cos(angle), r * std::sin(angle), z);
    EXPECT_LT(glm::distance(unpack_normal(pack_normal(normal)), normal), 7e-5f);
  }
  for (const vec3& axis : {vec3(0, 0, -1), vec3(-1, 0, 0), vec3(0, 1, 0)}) {
    EXPECT_EQ(unpack_normal(pack_normal(axis)), axis);
  }
  for (int a = -32768; a <= 32767; a += 4369) {  // any bytes of a damaged file
    for (int b = -32768; b <= 32767; b += 4369) {
      const vec3 n = unpack_normal({{static_cast<int16_t>(a), static_cast<int16_t>(b)}});
      EXPECT_NEAR(glm::length(n), 1.0f, 1e-5f);
    }
  }
}

TEST(PackVertexColor, RoundsAndClamps) {
  EXPECT_EQ(unpack_vertex_color(pack_vertex_color(vec4(1, 0, 4, 1))), vec4(1, 0, 1, 1));
  EXPECT_NEAR(unpack_vertex_color(pack_vertex_color(vec4(0.25f))).w, 0.25f, 0.003f);
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

TEST(PackedAlbedo, IsFineAtBothEnds) {
  EXPECT_EQ(unpack_albedo(pack_albedo(vec3(0, 1, 0))), vec3(0, 1, 0));
  for (const float a : {0.01f, 0.1f, 0.5f, 0.9f, 0.99f, 0.999f, 0.9999f}) {
    const float unpacked = unpack_albedo(pack_albedo(vec3(a))).x;
    EXPECT_NEAR(unpacked, a, 0.0035f * 2 * std::sqrt(a * (1 - a)) + 1.5e-5f) << a;  // half a step of the angle
  }
  EXPECT_EQ(pack_albedo(vec3(NAN, -1, 2)), pack_albedo(vec3(0, 0, 1)));
}

TEST(PackedAnisotropy, IsWithinItsStepAndItsBounds) {
  for (const float g : {-0.98f, -0.3f, 0.0f, 0.004f, 0.85f})
    EXPECT_NEAR(unpack_anisotropy(pack_anisotropy(g)), g, 0.5f / 127);
  EXPECT_EQ(pack_anisotropy(NAN), 0);
  EXPECT_LE(unpack_anisotropy(pack_anisotropy(5)), 0.98f);
}

TEST(LevelView, ShowsEveryArrayOfItsLevel) {
  LevelData level = test::full_level_of_version_7();
  level.voxel_albedo = test::full_level_of_version_6().voxel_albedo;  // which no valid level has beside flakes
  level.voxel_anisotropy = test::full_level_of_version_6().voxel_anisotropy;
  level.part_first_quad = test::full_level_of_version_8().part_first_quad;  // nor with pieces
  level.placements = test::full_level_of_version_8().placements;
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
  EXPECT_EQ(names.size(), 34u);
  EXPECT_FALSE(names.contains(section_name(SectionId{0})));
}

}  // namespace
}  // namespace farfield
