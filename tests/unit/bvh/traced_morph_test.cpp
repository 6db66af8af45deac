// SPDX-License-Identifier: Apache-2.0
#include "bvh/traced_morph.h"

#include <gtest/gtest.h>

#include <cmath>

#include "base/nonfinite.h"
#include "base/random.h"
#include "farfield/ray.h"
#include "tests/support/level_builder.h"
#include "tests/support/random_unit.h"

namespace farfield {
namespace {

/// A morph between two levels in memory.
class Morph {
 public:
  Morph(LevelData fine, LevelData coarse)
      : device_(*BvhDevice::create()), fine_data_(std::move(fine)), coarse_data_(std::move(coarse)) {
    fine_ = *TracedLevel::build(*device_, view_of(fine_data_), 0);
    coarse_ = *TracedLevel::build(*device_, view_of(coarse_data_), 1);
    morph_ = *TracedMorph::build(*device_, view_of(fine_data_), view_of(coarse_data_), *fine_, *coarse_);
  }
  const TracedMorph& operator*() const { return *morph_; }

  struct Answer {
    std::optional<MorphHit> hit;
    EmbreeRayHit ray_hit;
  };
  Answer trace(const vec3& origin, const vec3& direction, float t, uint32_t path = 1, uint64_t flight = 1) const {
    RayContext context;
    context.path_seed = path;
    Answer answer{{}, make_ray_hit(origin, direction)};
    answer.ray_hit.ray.time = 0.875f;
    answer.hit = morph_->intersect(answer.ray_hit, context.embree, t, flight);
    EXPECT_EQ(answer.ray_hit.ray.time, 0.875f);  // the host's

    EmbreeRay shadow = make_ray(origin, direction);
    EXPECT_EQ(morph_->occluded(shadow, context.embree, t, flight), answer.hit.has_value());
    EXPECT_EQ(shadow.tfar, answer.hit ? -kInfinity : kInfinity);
    return answer;
  }

 private:
  std::unique_ptr<BvhDevice> device_;
  LevelData fine_data_, coarse_data_;
  std::unique_ptr<TracedLevel> fine_, coarse_;
  std::unique_ptr<TracedMorph> morph_;
};

/// A square of two faces at height z, with corners at +-1.
LevelData square(float z, uint32_t k) {
  LevelData level = test::empty_level(k, 0.5f * static_cast<float>(1u << k));
  test::set_quads(level, {{-1, -1, z}, {1, -1, z}, {1, 1, z}, {-1, 1, z}}, {{0, 1, 2, 3}});
  return level;
}

/// One brick of the same density everywhere, from the origin on.
LevelData fog(float density, uint32_t k) {
  LevelData level = test::empty_level(k, 0.5f);
  test::set_volume(level, ivec3(1), vec3(0.0f), [=](int, int, int) { return density; });
  return level;
}

const vec3 kDown(0, 0, -1);

TEST(TracedMorph, MovesVerticesAlongStraightLines) {
  const LevelData fine = square(0, 0);
  LevelData coarse = square(1, 1);
  coarse.morph_vertex = {0, 1, 2, 3};
  coarse.morph_face = {0, 1};
  const Morph morph(fine, coarse);
  for (const float t : {1e-6f, 0.25f, 0.5f, 0.9f, 1 - 1e-6f}) {
    for (const vec2 at : {vec2(0.5f, 0.2f), vec2(-0.3f, -0.7f)}) {
      const auto answer = morph.trace(vec3(at, 5), kDown, t);
      ASSERT_TRUE(answer.hit);
      EXPECT_FALSE(answer.hit->is_volume);
      EXPECT_FALSE(answer.hit->is_coarser);
      EXPECT_NEAR(answer.ray_hit.ray.tfar, 5 - t, 1e-5f);
      EXPECT_EQ((*morph).coarse_face(answer.hit->element % 2), answer.hit->element % 2);
    }
  }
}

TEST(TracedMorph, AFaceThatCollapsesShrinksAway) {
  const LevelData fine = square(0, 0);
  LevelData coarse = test::empty_level(1, 1);
  test::set_triangles(coarse, {{-1, -1, 0}, {1, -1, 0}, {-1, 1, 0}}, {{0, 1, 2}});
  coarse.morph_vertex = {0, 1, 1, 2};  // the corner at (1, 1) goes to (1, -1)
  coarse.morph_face = {0, kMorphCollapsed};
  const Morph morph(fine, coarse);
  for (const float t : {0.2f, 0.5f, 0.8f}) {
    const float edge = 1 - 2 * t;  // of the moved corner's y; the free edge runs from (1, edge) to (-1, 1)
    EXPECT_TRUE(morph.trace({0.98f, edge - 0.1f, 5}, kDown, t).hit) << t;
    EXPECT_FALSE(morph.trace({0.98f, edge + 0.1f, 5}, kDown, t).hit) << t;
  }
}

TEST(TracedMorph, AFaceThatBecomesVolumeIsThereForOneMinusTOfThePaths) {
  const LevelData fine = square(0, 0);
  LevelData coarse = square(-8, 1);
  test::set_quads(coarse, {{5, 5, 0}, {6, 5, 0}, {6, 6, 0}, {5, 6, 0}}, {{0, 1, 2, 3}});
  coarse.morph_vertex.assign(4, kMorphVoxelized);
  coarse.morph_face.assign(2, kMorphVoxelized);
  const Morph morph(fine, coarse);
  for (const float t : {0.1f, 0.5f, 0.75f}) {
    constexpr uint32_t kPaths = 20000;
    int hits = 0;
    for (uint32_t path = 0; path < kPaths; ++path) {
      const bool is_there = morph.trace({0.3f, 0.4f, 5}, kDown, t, path, 1).hit.has_value();
      EXPECT_EQ(is_there, morph.trace({0.31f, 0.4f, -3}, -kDown, t, path, 2).hit.has_value());  // from behind, too
      hits += is_there;
    }
    EXPECT_NEAR(hits / double(kPaths), 1 - t, 4 * std::sqrt(t * (1 - t) / kPaths));
  }
}

TEST(TracedMorph, WhereAFaceIsReplacedByAnotherThereIsNoGap) {
  const LevelData fine = square(0, 0);
  LevelData coarse = square(0, 1);  // the same place, but no face of the finer level is one of its
  coarse.morph_vertex.assign(4, kMorphVoxelized);
  coarse.morph_face.assign(2, kMorphVoxelized);
  const Morph morph(fine, coarse);
  Rng rng(1);
  int of_coarser = 0;
  constexpr uint32_t kPaths = 5000;
  for (uint32_t path = 0; path < kPaths; ++path) {
    const auto answer =
        morph.trace({1.9f * rng.next() - 0.95f, 1.9f * rng.next() - 0.95f, 2}, kDown, 0.25f, path, path);
    ASSERT_TRUE(answer.hit);
    of_coarser += answer.hit->is_coarser;
  }
  EXPECT_NEAR(of_coarser / double(kPaths), 0.25, 4 * std::sqrt(0.25 * 0.75 / kPaths));
}

TEST(TracedMorph, OfEitherVolumeAShareIsThere) {
  const float a = 0.3f, b = 0.9f;
  const Morph morph(fog(a, 0), fog(b, 1));
  for (const float t : {0.1f, 0.5f, 0.9f}) {
    constexpr int kRays = 40000;
    int hits = 0, of_coarser = 0;
    for (int i = 0; i < kRays; ++i) {
      const auto answer = morph.trace({1.2f, 1.7f, 9}, kDown, t, 1, static_cast<uint64_t>(i));
      if (!answer.hit) continue;
      EXPECT_TRUE(answer.hit->is_volume);
      ++hits;
      of_coarser += answer.hit->is_coarser;
    }
    const double sum = (1 - t) * a + t * b, expected = 1 - std::exp(-sum * 4);                 // four units of fog
    EXPECT_NEAR(hits / double(kRays), expected, 4 * std::sqrt(expected / kRays) + 2e-3) << t;  // densities are bytes
    EmbreeRay shadow = make_ray({1.2f, 1.7f, 9}, kDown);
    RayContext context;
    float transmittance = 1;
    EXPECT_FALSE((*morph).occluded(shadow, context.embree, t, 1, &transmittance));
    EXPECT_NEAR(transmittance, 1 - expected, 2e-3) << t;
    EXPECT_NEAR(of_coarser / double(hits), t * b / sum, 4 * std::sqrt(0.25 / hits)) << t;
  }
}

TEST(TracedMorph, ASliverOfATLeavesNearlyTheLevelItself) {
  const Morph morph(fog(1e6f, 0), fog(1e-6f, 1));
  const float t = 0x1p-20f;
  EXPECT_TRUE(morph.trace({1, 1, 9}, kDown, t).hit);
  EXPECT_TRUE(morph.trace({1, 1, 9}, kDown, 1 - t).hit);  // a millionth of a million is still fog
  const Morph thin(fog(1e-6f, 0), fog(1e-6f, 1));
  EXPECT_FALSE(thin.trace({1, 1, 9}, kDown, t).hit);
}

TEST(TracedMorph, CostsWhatTheBakeHasMeasured) {
  const LevelData fine = test::sphere_level(vec3(0), 1, 24);
  LevelData coarse = test::sphere_level(vec3(0), 0.9f, 8, 1, 0.2f);
  Rng rng(3);
  for (size_t v = 0; v < fine.positions.size(); ++v) {
    coarse.morph_vertex.push_back(rng.next_uint() % static_cast<uint32_t>(coarse.positions.size()));
  }
  for (uint32_t f = 0; f < face_count(view_of(fine)); ++f) {
    coarse.morph_face.push_back(f % 3 == 0 ? kMorphVoxelized : rng.next_uint() % face_count(view_of(coarse)));
  }
  const auto measured = measure_morph(view_of(fine), view_of(coarse));
  ASSERT_TRUE(measured);
  const Morph morph(fine, coarse);
  const LevelCost cost = (*morph).cost(view_of(fine), view_of(coarse));
  EXPECT_EQ(measured->resident_bytes, cost.resident_bytes);
  EXPECT_EQ(measured->build_peak_bytes, cost.build_peak_bytes);
  EXPECT_GT(cost.resident_bytes, 50u * face_count(view_of(fine)));
}

}  // namespace
}  // namespace farfield
