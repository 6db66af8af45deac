// SPDX-License-Identifier: Apache-2.0
#include "prefilter/isotropic_lines.h"

#include <gtest/gtest.h>

namespace farfield {
namespace {

const VoxelBox kBox{dvec3(-2, 1, 0), dvec3(5, 3, 4)};
constexpr uint64_t kLines = 100'000;

VoxelRay line(uint64_t i) { return isotropic_line(kBox, even_coordinates(i, 9)); }

// Cauchy: the mean chord of a convex body is 4 V / A. 1e5 evenly spread lines.
TEST(IsotropicLines, HaveCauchysMeanChord) {
  double chords = 0;
  for (uint64_t i = 0; i < kLines; ++i) chords += line(i).far;
  const dvec3 size = kBox.upper - kBox.lower;
  EXPECT_NEAR(chords / kLines / (4 * size.x * size.y * size.z / surface_area(kBox)), 1, 2e-3);
}

// Lines through a ball inside are as many as its surface by the box's, wherever it is, and come from all directions.
// Some 6000 lines each: a standard error of 1.3 % if they were random.
TEST(IsotropicLines, MeetABallAnywhereFromAllDirections) {
  const double radius = 0.8;
  for (const dvec3 center : {dvec3(-1, 2, 1), dvec3(4, 2, 3), dvec3(1.5, 2, 2)}) {
    double hits = 0;
    dvec3 squares(0);
    for (uint64_t i = 0; i < kLines; ++i) {
      const VoxelRay ray = line(i);
      const dvec3 to_center = center - ray.origin;
      const double along = glm::dot(to_center, ray.direction);
      if (glm::dot(to_center, to_center) - along * along > radius * radius) continue;
      hits += 1;
      squares += ray.direction * ray.direction;
    }
    EXPECT_NEAR(hits / kLines / (4 * M_PI * radius * radius / surface_area(kBox)), 1, 0.03);
    for (int a = 0; a < 3; ++a) EXPECT_NEAR(squares[a] / hits, 1.0 / 3, 0.015) << a;
  }
}

TEST(IsotropicLines, StartAndEndOnTheBox) {
  const auto distance_to_surface = [](const dvec3& p) {
    const dvec3 d = glm::min(glm::abs(p - kBox.lower), glm::abs(p - kBox.upper));
    return std::min({d.x, d.y, d.z});
  };
  for (uint64_t i = 0; i < 1000; ++i) {
    const VoxelRay ray = line(i);
    EXPECT_NEAR(glm::length(ray.direction), 1, 1e-12);
    EXPECT_EQ(distance_to_surface(ray.origin), 0);
    EXPECT_NEAR(distance_to_surface(ray.origin + ray.far * ray.direction), 0, 1e-9);
  }
}

TEST(EvenCoordinates, AreEvenInEveryStretchAndDifferForOtherSeeds) {
  for (const uint64_t first : {uint64_t{0}, uint64_t{1} << 40}) {
    std::array<double, 5> sum{};
    for (uint64_t i = 0; i < 1000; ++i) {
      const auto c = even_coordinates(first + i, 5);
      for (size_t d = 0; d < c.size(); ++d) {
        EXPECT_TRUE(c[d] >= 0 && c[d] < 1);
        sum[d] += c[d];
      }
    }
    for (const double s : sum) EXPECT_NEAR(s / 1000, 0.5, 0.005);  // random ones: a standard error of 0.009
  }
  EXPECT_NE(even_coordinates(3, 5), even_coordinates(3, 6));
}

}  // namespace
}  // namespace farfield
