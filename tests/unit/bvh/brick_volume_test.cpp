// SPDX-License-Identifier: Apache-2.0
#include "bvh/brick_volume.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "base/hash.h"
#include "base/nonfinite.h"
#include "tests/support/level_builder.h"
#include "tests/support/optical_depth.h"
#include "tests/support/random_unit.h"

namespace farfield {
namespace {

using test::empty_level;
using test::optical_depth;
using test::random_unit;
using test::set_volume;

struct Cloud {
  bool anisotropic, octants;
  float density = 2;  ///< at most
};

/// 2 x 1 x 2 bricks of 0.25 units, one brick empty, densities that vary and vanish.
LevelData cloud(const Cloud& of) {
  LevelData level = empty_level(1, 0.25f);
  const auto density = [&](int x, int y, int z) {
    if (x >= 8 && z < 8) return 0.0f;
    const float u = to_unit_float(mix64(static_cast<uint64_t>(x + 100 * y), static_cast<uint64_t>(z)));
    return u < 0.4f ? 0.0f : of.density * u;
  };
  const auto sggx = [](int x, int y, int z) {
    Rng rng(mix64(static_cast<uint64_t>(x + 100 * y), static_cast<uint64_t>(z + 7)));
    const SymMat3 s = SymMat3::outer(random_unit(rng)) + SymMat3::identity() * (0.2f * rng.next());
    return s;
  };
  if (of.anisotropic) {
    set_volume(level, {2, 1, 2}, {-1.0f, 2.0f, 0.5f}, density, sggx);
  } else {
    set_volume(level, {2, 1, 2}, {-1.0f, 2.0f, 0.5f}, density);
  }
  if (of.octants) {
    level.voxel_octants.resize(voxel_count(level));
    for (size_t i = 0; i < level.voxel_octants.size(); ++i)
      level.voxel_octants[i] = static_cast<PackedOctants>(mix64(3, i));
  }
  return level;
}

LevelData block(float density, float voxel = 0.5f) {
  LevelData level = empty_level(1, voxel);
  set_volume(level, {1, 1, 1}, vec3(0.0f), [&](int, int, int) { return density; });
  return level;
}

/// Fraction of `count` flights without a collision, and its distance in standard errors from exp(-depth).
double transmittance_z(const BrickVolume& volume, const LocalRay& ray, double depth, int count, uint64_t seed) {
  int passed = 0;
  for (int i = 0; i < count; ++i) {
    if (!volume.first_collision(ray, mix64(seed, static_cast<uint64_t>(i)))) ++passed;
  }
  const double expected = std::exp(-depth);
  const double error = std::sqrt(std::max(expected * (1.0 - expected), 1e-9) / count);
  return (static_cast<double>(passed) / count - expected) / error;
}

// 60 z-tests per case at 4.5 sigma: a false alarm in 1 of 2500 for other seeds.
constexpr double kSigma = 4.5;

class Transmittance : public ::testing::TestWithParam<Cloud> {};

TEST_P(Transmittance, IsTheExponentialOfTheBruteForceOpticalDepth) {
  const LevelData level = cloud(GetParam());
  const BrickVolume volume(view_of(level));
  Rng rng(11);
  for (int i = 0; i < 60; ++i) {
    const vec3 target =
        level.header.bounds.lower + level.header.bounds.size() * vec3(rng.next(), rng.next(), rng.next());
    const vec3 direction = (0.1f + 3.0f * rng.next()) * random_unit(rng);  // not unit
    const LocalRay ray{target - (i % 3 == 0 ? 0.0f : 2.0f) * direction, direction, 0.0f, 6.0f};
    const double depth = optical_depth(level, ray.origin, ray.direction, ray.t_far);
    EXPECT_LT(std::abs(transmittance_z(volume, ray, depth, 40000, static_cast<uint64_t>(i))), kSigma) << "ray " << i;
    EXPECT_NEAR(volume.optical_depth(ray), depth, 5e-3 * depth + 5e-3) << "ray " << i;  // of 20000 midpoints
  }
}

TEST_P(Transmittance, HasCollisionsWhereTheOpticalDepthGrows) {
  const LevelData level = cloud(GetParam());
  const BrickVolume volume(view_of(level));
  const LocalRay ray{{-1.5f, 2.3f, 0.6f}, {1.4f, 0.4f, 1.3f}, 0.0f, 4.0f};
  std::vector<float> hits;
  constexpr int kCount = 60000;
  for (int i = 0; i < kCount; ++i) {
    if (const auto hit = volume.first_collision(ray, static_cast<uint64_t>(i))) hits.push_back(hit->t);
  }
  std::sort(hits.begin(), hits.end());
  // Kolmogorov-Smirnov at 40 places: the critical value for significance 1e-6 is 2.7 / sqrt(n).
  for (int k = 1; k <= 40; ++k) {
    const double t = 0.1 * k;
    const double before =
        static_cast<double>(std::lower_bound(hits.begin(), hits.end(), static_cast<float>(t)) - hits.begin());
    const double expected = 1.0 - std::exp(-optical_depth(level, ray.origin, ray.direction, t));
    EXPECT_NEAR(before / kCount, expected, 2.7 / std::sqrt(kCount)) << "t " << t;
  }
}

// In the voxel or octant of the collision: a twentieth of a percent of hits lie on the border of another, by rounding.
TEST_P(Transmittance, CollisionsSayTheAttenuationThatTheyHad) {
  const LevelData level = cloud(GetParam());
  const BrickVolume volume(view_of(level));
  const vec3 unit = glm::normalize(vec3(1.4f, 0.4f, 1.3f)), direction = 2.5f * unit;
  int hits = 0, off = 0;
  for (int i = 0; i < 20000; ++i) {
    const LocalRay ray{{-1.5f, 2.3f, 0.6f}, direction, 0.0f, 4.0f};
    const auto hit = volume.first_collision(ray, static_cast<uint64_t>(i), i % 2 == 0 ? 1.0f : 0.5f);
    if (!hit) continue;
    ++hits;
    const vec3 point = ray.origin + hit->t * direction;
    const glm::dvec3 in_voxels =
        (glm::dvec3(ray.origin) + double{hit->t} * glm::dvec3(direction) - glm::dvec3(level.header.volume_origin)) /
        double{level.header.resolution};
    const double expected = 2.5 * test::attenuation(level, in_voxels, ivec3(glm::floor(in_voxels)), unit);
    const double share = i % 2 == 0 ? 1.0 : 0.5;
    off += std::abs(double{hit->attenuation} - share * expected) > 1e-4 * expected ||
           std::abs(double{volume.attenuation_at(point, direction)} - expected) > 1e-4 * expected;
  }
  EXPECT_GT(hits, 1500);
  EXPECT_LE(off, hits / 2000 + 1);
}

// Faint bricks are skimmed, others crossed.
INSTANTIATE_TEST_SUITE_P(Clouds, Transmittance,
                         ::testing::Values(Cloud{false, false}, Cloud{true, false}, Cloud{false, true},
                                           Cloud{true, true}, Cloud{true, true, 0.4f}, Cloud{false, true, 0.4f},
                                           Cloud{true, true, 40}));

TEST(BrickVolume, NothingIsStoppedOutsideOfIt) {
  const LevelData level = block(2);
  const BrickVolume volume(view_of(level));
  EXPECT_NEAR(volume.attenuation_at(vec3(1.0f), {0, 3, 0}), 6.0f, 1e-5f);
  EXPECT_EQ(volume.attenuation_at({-0.1f, 1, 1}, {0, 1, 0}), 0.0f);
  EXPECT_EQ(volume.attenuation_at({1, 1, 4.0f}, {0, 1, 0}), 0.0f);
  EXPECT_EQ(volume.attenuation_at(vec3(1.0f), vec3(0.0f)), 0.0f);
  EXPECT_EQ(volume.attenuation_at({1, kNan, 1}, {0, 1, 0}), 0.0f);
  EXPECT_EQ(BrickVolume().attenuation_at(vec3(1.0f), {0, 1, 0}), 0.0f);
}

TEST(BrickVolume, CollisionsLieInTheVoxelOfTheirPayload) {
  const LevelData level = cloud({true, true});
  const BrickVolume volume(view_of(level));
  Rng rng(5);
  int hits = 0;
  for (int i = 0; i < 20000; ++i) {
    const vec3 target =
        level.header.bounds.lower + level.header.bounds.size() * vec3(rng.next(), rng.next(), rng.next());
    const vec3 direction = random_unit(rng);
    const LocalRay ray{target - 3.0f * direction, direction, 0.0f, 100.0f};
    const auto hit = volume.first_collision(ray, static_cast<uint64_t>(i));
    if (!hit) continue;
    ++hits;
    ASSERT_LT(hit->payload, voxel_count(level));
    const vec3 p = (ray.origin + hit->t * direction - level.header.volume_origin) / level.header.resolution;
    // Within rounding of the voxel that owns the payload.
    bool found = false;
    for (int dz = -1; dz <= 1; ++dz) {
      for (int dy = -1; dy <= 1; ++dy) {
        for (int dx = -1; dx <= 1; ++dx) {
          const vec3 q = p + 1e-4f * vec3(dx, dy, dz);
          const ivec3 v(glm::floor(q));
          if (v.x < 0 || v.y < 0 || v.z < 0 || v.x >= 16 || v.y >= 8 || v.z >= 16) continue;
          const uint32_t brick = level.brick_table[static_cast<size_t>(v.x / 8 + 2 * (v.y / 8 + v.z / 8))];
          if (brick == kNoBrick) continue;
          const int i_local = v.x % 8 + 8 * (v.y % 8 + 8 * (v.z % 8));
          if (level.bricks[brick].density[static_cast<size_t>(i_local)] == 0) continue;
          found = found || level.bricks[brick].payload_index(i_local) == hit->payload;
        }
      }
    }
    ASSERT_TRUE(found) << "ray " << i;
  }
  EXPECT_GT(hits, 5000);
}

TEST(BrickVolume, AxisParallelRaysAndRaysInVoxelPlanesSeeTheirLength) {
  const LevelData level = block(0.7f);  // a cube of side 4
  const BrickVolume volume(view_of(level));
  for (int axis = 0; axis < 3; ++axis) {
    for (const float sign : {-1.0f, 1.0f}) {
      for (const float across :
           {0.3f, 1.0f, 2.0f, 3.999f}) {  // 1 and 2 are planes between voxels, 2 between bricks' halves
        vec3 direction(0.0f);
        direction[axis] = sign;
        vec3 origin(across);
        origin[axis] = sign > 0 ? -1.0f : 5.0f;
        EXPECT_LT(std::abs(transmittance_z(volume, {origin, direction, 0.0f, kInfinity}, 2.8, 20000, 3)), kSigma);
        // Negative zeros are zeros.
        for (int other = 0; other < 3; ++other) {
          if (other != axis) direction[other] = -0.0f;
        }
        EXPECT_LT(std::abs(transmittance_z(volume, {origin, direction, 0.0f, kInfinity}, 2.8, 20000, 4)), kSigma);
      }
    }
  }
}

TEST(BrickVolume, RaysThatStartInsideOrOnTheBorderSeeWhatIsAhead) {
  const LevelData level = block(0.7f);
  const BrickVolume volume(view_of(level));
  EXPECT_LT(std::abs(transmittance_z(volume, {{1.0f, 1.3f, 2.2f}, {1, 0, 0}, 0.0f, kInfinity}, 2.1, 40000, 1)), kSigma);
  EXPECT_LT(std::abs(transmittance_z(volume, {{0.0f, 1.3f, 2.2f}, {1, 0, 0}, 0.0f, kInfinity}, 2.8, 40000, 2)), kSigma);
  EXPECT_LT(std::abs(transmittance_z(volume, {{-1.0f, 1.3f, 2.2f}, {1, 0, 0}, 3.0f, 4.0f}, 0.7, 40000, 3)), kSigma);
  EXPECT_FALSE(volume.first_collision({{4.0f, 1.3f, 2.2f}, {1, 0, 0}, 0.0f, kInfinity}, 1));
  EXPECT_FALSE(volume.first_collision({{5.0f, 1.3f, 2.2f}, {1, 0, 0}, 0.0f, kInfinity}, 1));
  EXPECT_FALSE(volume.first_collision({{1.0f, 5.0f, 2.2f}, {1, 0, 0}, 0.0f, kInfinity}, 1));
}

TEST(BrickVolume, DiagonalsThroughVoxelCornersSeeTheirLength) {
  const LevelData level = block(0.4f);
  const BrickVolume volume(view_of(level));
  EXPECT_LT(std::abs(transmittance_z(volume, {vec3(-1.0f), vec3(1.0f), 0.0f, kInfinity}, 0.4 * 4.0 * std::sqrt(3.0),
                                     40000, 7)),
            kSigma);
  EXPECT_LT(std::abs(transmittance_z(volume, {{-1, -1, 2}, {1, 1, 0}, 0.0f, kInfinity}, 0.4 * 4.0 * std::sqrt(2.0),
                                     40000, 8)),
            kSigma);
}

TEST(BrickVolume, TheLengthOfTheDirectionOnlyScalesT) {
  const LevelData level = cloud({true, true});
  const BrickVolume volume(view_of(level));
  Rng rng(9);
  int hits = 0;
  for (int i = 0; i < 5000; ++i) {
    const vec3 target = level.header.bounds.center() + 0.5f * random_unit(rng);
    const vec3 direction = random_unit(rng);
    const LocalRay one{target - 4.0f * direction, direction, 0.0f, 100.0f};
    const LocalRay eight{one.origin, 8.0f * direction, 0.0f, 12.5f};
    const auto a = volume.first_collision(one, static_cast<uint64_t>(i));
    const auto b = volume.first_collision(eight, static_cast<uint64_t>(i));
    ASSERT_EQ(a.has_value(), b.has_value());
    if (!a) continue;
    ++hits;
    ASSERT_EQ(a->payload, b->payload);
    ASSERT_NEAR(a->t, 8.0f * b->t, 1e-4f);
  }
  EXPECT_GT(hits, 1000);
}

TEST(BrickVolume, ShorteningTheRayBehindTheCollisionChangesNothing) {
  const LevelData level = cloud({true, true});
  const BrickVolume volume(view_of(level));
  Rng rng(10);
  for (uint64_t i = 0; i < 5000; ++i) {
    const vec3 direction = random_unit(rng);
    LocalRay ray{level.header.bounds.center() - 3.0f * direction, direction, 0.0f, kInfinity};
    const auto free = volume.first_collision(ray, i);
    if (!free) continue;
    ray.t_far = free->t + 0.01f;
    const auto cut = volume.first_collision(ray, i);
    ASSERT_TRUE(cut);
    ASSERT_EQ(cut->t, free->t);
    ray.t_far = free->t - 0.01f;
    ASSERT_FALSE(volume.first_collision(ray, i));
  }
}

TEST(BrickVolume, HugeDensityCollidesAtTheEntryAndNeverLoops) {
  for (const float density : {1e6f, 1e20f, 3e38f}) {
    const LevelData level = block(density);
    const BrickVolume volume(view_of(level));
    Rng rng(2);
    for (uint64_t i = 0; i < 2000; ++i) {
      const vec3 target = vec3(0.5f) + 3.0f * vec3(rng.next(), rng.next(), rng.next());
      const vec3 direction = 10.0f * random_unit(rng);
      const LocalRay ray{target - direction, direction, 0.0f, kInfinity};
      const auto hit = volume.first_collision(ray, i);
      ASSERT_TRUE(hit);
      ASSERT_TRUE(std::isfinite(hit->t));
      ASSERT_NEAR(hit->t, clip_to_box(ray, level.header.bounds).t_near, 1e-5f);
    }
  }
}

TEST(BrickVolume, HugeFlatFlakesSeenEdgeOnAreCrossed) {
  LevelData level = empty_level(1, 0.5f);
  set_volume(
      level, {1, 1, 1}, vec3(0.0f), [](int, int, int) { return 1e20f; },
      [](int, int, int) {
        return SymMat3::outer({0, 0, 1});
      });
  std::fill(level.voxel_sggx.begin(), level.voxel_sggx.end(), PackedFlakeSggx{{0, 0, 255}, {0, 0, 0}});  // exactly flat
  const BrickVolume volume(view_of(level));
  EXPECT_FALSE(volume.first_collision({{-1, 1, 1}, {1, 0, 0}, 0.0f, kInfinity}, 1));
  EXPECT_TRUE(volume.first_collision({{1, 1, -1}, {0, 0, 1}, 0.0f, kInfinity}, 1));
}

TEST(BrickVolume, GrazingAndFarAwayRaysStayInTheBoxAndFinite) {
  const LevelData level = block(0.7f);
  const BrickVolume volume(view_of(level));
  Rng rng(3);
  for (uint64_t i = 0; i < 20000; ++i) {
    const float distance = std::pow(10.0f, 8.0f * rng.next());
    const vec3 direction = random_unit(rng) * std::pow(10.0f, 10.0f * rng.next() - 5.0f);
    const vec3 target(4.0f * rng.next(), i % 2 ? 0.0f : 4.0f, 4.0f * rng.next());
    const LocalRay ray{target - distance / glm::length(direction) * direction, direction, 0.0f, kInfinity};
    const auto hit = volume.first_collision(ray, i);
    if (!hit) continue;
    ASSERT_TRUE(std::isfinite(hit->t));
    const vec3 p = ray.origin + hit->t * direction;
    const float tolerance = 4e-6f * (4.0f + distance);
    for (int axis = 0; axis < 3; ++axis) {
      ASSERT_GT(p[axis], -tolerance);
      ASSERT_LT(p[axis], 4.0f + tolerance);
    }
  }
}

TEST(BrickVolume, RaysWithoutADirectionOrWithNansMeetNothing) {
  const LevelData level = block(100.0f);
  const BrickVolume volume(view_of(level));
  EXPECT_FALSE(volume.first_collision({vec3(1.0f), vec3(0.0f), 0.0f, 100.0f}, 1));
  EXPECT_FALSE(volume.first_collision({vec3(1.0f), vec3(0.0f), 0.0f, kInfinity}, 1));
  EXPECT_EQ(volume.optical_depth({vec3(1.0f), vec3(0.0f), 0.0f, kInfinity}), 0.0f);
  EXPECT_EQ(volume.optical_depth({vec3(kNan), vec3(1.0f), 0.0f, kInfinity}), 0.0f);
  for (const float bad : {kNan, kInfinity, -kInfinity}) {
    for (int axis = 0; axis < 3; ++axis) {
      LocalRay ray{vec3(1.0f), vec3(1, 1, 1), 0.0f, kInfinity};
      ray.origin[axis] = bad;
      const auto a = volume.first_collision(ray, 1);
      EXPECT_TRUE(!a || std::isfinite(a->t));
      ray = {vec3(1.0f), vec3(1, 1, 1), 0.0f, kInfinity};
      ray.direction[axis] = bad;
      const auto b = volume.first_collision(ray, 1);
      EXPECT_TRUE(!b || std::isfinite(b->t));
    }
  }
  EXPECT_FALSE(volume.first_collision({vec3(1.0f), vec3(1.0f), kNan, kInfinity}, 1));
  EXPECT_FALSE(volume.first_collision({vec3(1.0f), vec3(1.0f), 0.0f, kNan}, 1));
  EXPECT_FALSE(volume.first_collision({vec3(1.0f), vec3(1.0f), 2.0f, 1.0f}, 1));
  EXPECT_TRUE(volume.first_collision({vec3(1.0f), vec3(1e-39f, 1.0f, -1e-42f), 0.0f, kInfinity}, 1));  // denormals
}

TEST(BrickVolume, AnEmptyVolumeHasNoCollisions) {
  EXPECT_FALSE(BrickVolume().first_collision({vec3(0.0f), vec3(1.0f), 0.0f, kInfinity}, 1));
  const LevelData surface_only = test::triangle_soup(3, 0.1f, 1);
  EXPECT_TRUE(BrickVolume(view_of(surface_only)).is_empty());
}

}  // namespace
}  // namespace farfield
