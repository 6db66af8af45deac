// SPDX-License-Identifier: Apache-2.0
#include "scattering/sheet.h"

#include <gtest/gtest.h>

#include "scattering/convention.h"
#include "tests/support/statistics.h"

namespace farfield {
namespace {

using namespace test;

const vec3 kNormal(0, 0, 1);

/// Pieces that show these areas along x, y and z.
SymMat3 pieces(float x, float y, float z) { return {x * x, y * y, z * z, 0, 0, 0}; }

/// Planks along y, 0.4 wide, 0.3 deep, 1 apart: shadows that touch on the ground.
TEST(Sheet, OfPlanksStopsWhatTheirShadowsCover) {
  Rng rng(1);
  for (int i = 0; i < 1000; ++i) {
    const vec3 w(random_direction(rng));
    const float shadow = 0.4f + 0.3f * std::abs(w.x / w.z);
    const float gap = sheet_gap({1, 1}, 0.6f, sheet_areas(pieces(0.3f, 0, 0.4f), kNormal, w));
    EXPECT_NEAR(gap, std::max(1 - shadow, 0.0f), 1e-4f);
  }
}

/// Along y, with a diameter of 0.3, 1 apart.
TEST(Sheet, OfRoundWiresStopsWhatTheirShadowsCover) {
  Rng rng(2);
  for (int i = 0; i < 1000; ++i) {
    const vec3 w(random_direction(rng));
    const float shadow = 0.3f * std::sqrt(w.x * w.x + w.z * w.z) / std::abs(w.z);
    const float gap = sheet_gap({0, 1}, 0.7f, sheet_areas(pieces(1, 0, 1), kNormal, w));
    EXPECT_NEAR(gap, std::max(1 - shadow, 0.0f), 1e-4f);
  }
}

TEST(Sheet, OfOrderOneHalfIsTwoLayersThatDoNotKnowOfEachOther) {
  for (const float one_layer : {0.2f, 0.5f, 0.9f}) {
    const float tilted = 1 - 2 * (1 - one_layer);  // what one lets through where it shows twice as much
    const vec3 w = glm::normalize(vec3(1, 0, 1));
    const float gap = sheet_gap({1, 0.5f}, one_layer * one_layer, sheet_areas(pieces(1, 0, 1), kNormal, w));
    EXPECT_NEAR(gap, std::max(tilted, 0.0f) * std::max(tilted, 0.0f), 1e-5f);
  }
}

TEST(Sheet, WithoutDepthIsAsOpenInAllDirections) {
  Rng rng(3);
  for (int i = 0; i < 100; ++i) {
    const SheetAreas areas = sheet_areas(SymMat3::outer(kNormal), kNormal, vec3(random_direction(rng)));
    EXPECT_NEAR(sheet_gap({0.5f, 0.3f}, 0.25f, areas), 0.25f, 1e-3f);
  }
}

TEST(Sheet, OpenOrClosedAltogetherStaysSo) {
  for (const float sides : {0.0f, 1.0f, INFINITY}) {
    for (const float order : {1 / 255.0f, 0.5f, 1.0f}) {
      EXPECT_EQ(sheet_gap({0.5f, order}, 0, {sides}), 0);
      EXPECT_EQ(sheet_gap({0.5f, order}, 1, {sides}), 1);
    }
  }
}

/// Its side is all there is.
TEST(Sheet, AlongItselfIsClosed) {
  EXPECT_EQ(sheet_gap({1, 1}, 0.5f, sheet_areas(pieces(1, 0, 1), kNormal, {1, 0, 0})), 0);
}

TEST(Sheet, DoesNotCareHowLongDirectionsAreOrWhichWayTheyPoint) {
  const SymMat3 s = pieces(0.4f, 0.2f, 0.5f);
  const float sides = sheet_areas(s, kNormal, {0.5f, 0.2f, 0.7f}).sides;
  EXPECT_NEAR(sheet_areas(s * 7, -kNormal, vec3(0.5f, 0.2f, 0.7f) * -3.0f).sides, sides, 1e-5f);
}

}  // namespace
}  // namespace farfield
