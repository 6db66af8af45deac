// SPDX-License-Identifier: Apache-2.0
#include "cache/octants.h"

#include <gtest/gtest.h>

#include <array>

#include "base/random.h"
#include "tests/support/random_unit.h"

namespace farfield {
namespace {

TEST(Octants, EachHasItsOwnTwoBits) {
  for (int o = 0; o < 8; ++o) {
    for (int code = 0; code < 4; ++code) {
      const auto octants = static_cast<PackedOctants>(code << 2 * o);
      for (int other = 0; other < 8; ++other) {
        EXPECT_EQ(octant_share(octants, other), other == o ? kOctantShares[static_cast<size_t>(code)] : 0.0f);
      }
      EXPECT_FLOAT_EQ(mean_share(octants), kOctantShares[static_cast<size_t>(code)] / 8);
    }
  }
  EXPECT_EQ(mean_share(kFullOctants), 1.0f);
}

using Lengths = std::array<double, 8>;

/// By small steps.
Lengths step_through(const dvec3& origin, const dvec3& direction, const ivec3& voxel, double enter, double leave) {
  constexpr int kSteps = 20000;
  Lengths lengths{};
  for (int i = 0; i < kSteps; ++i) {
    const dvec3 p = origin + (enter + (leave - enter) * (i + 0.5) / kSteps) * direction - dvec3(voxel);
    lengths[static_cast<size_t>((p.x >= 0.5) + 2 * (p.y >= 0.5) + 4 * (p.z >= 0.5))] += (leave - enter) / kSteps;
  }
  return lengths;
}

TEST(Octants, AreWalkedInOrderAndWhole) {
  Rng rng(7);
  const ivec3 voxel(3, -5, 100);
  for (int i = 0; i < 200; ++i) {
    const dvec3 direction(test::random_unit(rng));
    const dvec3 origin = dvec3(voxel) + dvec3(rng.next(), rng.next(), rng.next()) - direction;
    double last = 0.9;
    Lengths lengths{};
    EXPECT_TRUE(
        walk_octants(origin, direction, 1.0 / direction, voxel, 0.9, 1.2, [&](int octant, double from, double to) {
          EXPECT_EQ(from, last);
          EXPECT_LT(from, to);
          lengths[static_cast<size_t>(octant)] += to - from;
          last = to;
          return true;
        }));
    EXPECT_EQ(last, 1.2);
    const Lengths expected = step_through(origin, direction, voxel, 0.9, 1.2);
    for (size_t o = 0; o < 8; ++o) EXPECT_NEAR(lengths[o], expected[o], 1e-4);
  }
}

TEST(Octants, RaysInAMiddlePlaneAndAlongAxesAreWalkedToTheirEnd) {
  for (int axis = 0; axis < 3; ++axis) {
    for (const float sign : {-1.0f, 1.0f}) {
      vec3 direction(0.0f);
      direction[axis] = sign;
      vec3 origin(0.5f);
      origin[axis] = sign > 0 ? 0.0f : 1.0f;
      float last = 0;
      int pieces = 0;
      EXPECT_TRUE(
          walk_octants(origin, direction, 1.0f / direction, ivec3(0), 0.0f, 1.0f, [&](int, float from, float to) {
            EXPECT_EQ(from, last);
            last = to;
            ++pieces;
            return true;
          }));
      EXPECT_EQ(last, 1.0f);
      EXPECT_EQ(pieces, 2);
    }
  }
}

TEST(Octants, AWalkEndsWhereItIsToldTo) {
  int visits = 0;
  EXPECT_FALSE(walk_octants(vec3(0.0f), vec3(1, 0.9f, 0.8f), 1.0f / vec3(1, 0.9f, 0.8f), ivec3(0), 0.0f, 1.0f,
                            [&](int, float, float) { return ++visits < 2; }));
  EXPECT_EQ(visits, 2);
  EXPECT_TRUE(
      walk_octants(vec3(0.0f), vec3(1.0f), vec3(1.0f), ivec3(0), 1.0f, 1.0f, [](int, float, float) { return false; }));
}

}  // namespace
}  // namespace farfield
