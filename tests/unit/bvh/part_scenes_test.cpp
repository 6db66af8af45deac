// SPDX-License-Identifier: Apache-2.0
#include "bvh/part_scenes.h"

#include <gtest/gtest.h>

#include <cmath>

#include "base/embree.h"
#include "bvh/level_scene.h"
#include "bvh/traced_morph.h"
#include "cache/level_check.h"
#include "cache/placed_parts.h"
#include "tests/support/level_builder.h"
#include "tests/support/random_unit.h"

namespace farfield {
namespace {

using test::random_unit;
using test::triangle_soup;

/// The first half of a soup stands once, the rest is two parts in `places` places, turned, stretched and mirrored.
LevelData soup_with_parts(uint32_t places, uint64_t seed) {
  LevelData level = triangle_soup(600, 0.1f, seed);
  const auto quads = static_cast<uint32_t>(level.quads.size());
  level.part_first_quad = {quads / 2, 3 * quads / 4};
  Rng rng(seed);
  for (uint32_t i = 0; i < places; ++i) {
    PartPlacement placement;
    do {
      for (int c = 0; c < 3; ++c) placement.level_to_part[c] = (0.3f + 2.0f * rng.next()) * random_unit(rng);
    } while (std::abs(glm::determinant(
                 mat3(placement.level_to_part[0], placement.level_to_part[1], placement.level_to_part[2]))) < 0.05f);
    placement.level_to_part[3] = 2.0f * random_unit(rng);
    placement.part = i % 2;
    level.placements.push_back(placement);
  }
  level.header.bounds = {};
  for_each_surface_point(view_of(level), [&](const vec3& p) { level.header.bounds.extend(p); });
  EXPECT_EQ(find_structure_problem(view_of(level)).value_or(""), "");
  return level;
}

LevelScene build(BvhDevice& device, const LevelData& level) {
  auto scene = LevelScene::build(device, view_of(level));
  EXPECT_TRUE(scene) << scene.error().message;
  return std::move(*scene);
}

TEST(PartScenes, RaysMeetPartsWhereTheyStand) {
  const auto device = BvhDevice::create();
  ASSERT_TRUE(device);
  const LevelData parted = soup_with_parts(40, 5);
  const LevelData flat = flattened(view_of(parted));
  const LevelScene scene = build(**device, parted), flat_scene = build(**device, flat);
  std::vector<vec3> points;
  for_each_surface_point(view_of(parted), [&](const vec3& p) { points.push_back(p); });
  // Faces of the flat level, place by place.
  std::vector<uint32_t> first_quad_of_place;
  uint32_t quad = view_of(parted).own_quad_count();
  for (const PartPlacement& placement : parted.placements) {
    first_quad_of_place.push_back(quad);
    const auto [first, end] = view_of(parted).part_quads(placement.part);
    quad += end - first;
  }
  Rng rng(7);
  int hits = 0, hits_on_parts = 0, different = 0;
  for (int i = 0; i < 20000; ++i) {
    const vec3 target = points[static_cast<size_t>(rng.next() * static_cast<float>(points.size()))];
    const vec3 origin = target + 3.0f * random_unit(rng);
    EmbreeRayHit in_parts = make_ray_hit(origin, target - origin + 0.02f * random_unit(rng)), in_flat = in_parts;
    EmbreeContext context = make_context();
    const bool is_hit = trace_nearest(scene.handle(), context, in_parts);
    const bool is_flat_hit = trace_nearest(flat_scene.handle(), context, in_flat);
    EmbreeRay shadow = make_ray(origin, vec3(in_parts.ray.dir_x, in_parts.ray.dir_y, in_parts.ray.dir_z));
    different += trace_occlusion(scene.handle(), context, shadow) != is_hit;
    if (is_hit != is_flat_hit) {
      ++different;
      continue;
    }
    if (!is_hit) continue;
    ++hits;
    different += std::abs(in_parts.ray.tfar - in_flat.ray.tfar) > 1e-4f * in_flat.ray.tfar;
    uint32_t found = view_of(parted).quad_of(in_parts.hit.geomID, in_parts.hit.primID);
    vec3 normal(in_parts.hit.Ng_x, in_parts.hit.Ng_y, in_parts.hit.Ng_z);
    if (in_parts.hit.geomID != 0) {
      ++hits_on_parts;
      const uint32_t place = in_parts.hit.instID[0];
      ASSERT_LT(place, parted.placements.size());
      const PartPlacement& placement = parted.placements[place];
      ASSERT_EQ(placement.part + 1, in_parts.hit.geomID);
      found += first_quad_of_place[place] - parted.part_first_quad[placement.part];
      const mat4x3& m = placement.level_to_part;
      normal = glm::transpose(mat3(m[0], m[1], m[2])) * normal;
    } else {
      EXPECT_EQ(in_parts.hit.instID[0], kNoGeometry);
    }
    different += found != in_flat.hit.primID;
    const vec3 flat_normal(in_flat.hit.Ng_x, in_flat.hit.Ng_y, in_flat.hit.Ng_z);
    different += std::abs(glm::dot(glm::normalize(normal), glm::normalize(flat_normal))) < 0.9999f;
    EXPECT_EQ(in_parts.ray.org_x, origin.x);
  }
  EXPECT_GT(hits, 2000);
  EXPECT_GT(hits_on_parts, hits / 2);
  EXPECT_LT(different, 10);  // at edges, by rounding
}

TEST(PartScenes, BytesAreTheSameEveryTimeAndGivenBack) {
  const auto device = BvhDevice::create();
  ASSERT_TRUE(device);
  const LevelData parted = soup_with_parts(500, 9);
  const uint64_t before = (*device)->bytes();
  uint64_t bytes = 0, peak = 0;
  for (int i = 0; i < 2; ++i) {
    const LevelScene scene = build(**device, parted);
    if (i == 0) bytes = scene.bytes(), peak = scene.build_peak_bytes();
    EXPECT_EQ(scene.bytes(), bytes);
    EXPECT_EQ(scene.build_peak_bytes(), peak);
    EXPECT_GE(scene.bytes(), (*device)->bytes() - before);
  }
  EXPECT_EQ((*device)->bytes(), before);
  const LevelData flat = flattened(view_of(parted));
  EXPECT_LT(bytes, build(**device, flat).bytes() / 2);
}

TEST(PartScenes, ABuildThatMayNotTakeSoMuchIsForgotten) {
  const auto device = BvhDevice::create();
  ASSERT_TRUE(device);
  const LevelData parted = soup_with_parts(500, 9);
  uint64_t enough = 0;
  {
    const LevelScene scene = build(**device, parted);
    enough = scene.bytes() + scene.build_peak_bytes();
  }
  const uint64_t before = (*device)->bytes();
  for (const double share : {0.0, 0.1, 0.5, 0.8}) {
    const auto refused =
        LevelScene::build(**device, view_of(parted), {static_cast<uint64_t>(share * static_cast<double>(enough))});
    ASSERT_FALSE(refused) << share;
    EXPECT_EQ(refused.error().code, ErrorCode::OutOfBudget);
    EXPECT_EQ((*device)->bytes(), before);
  }
  EXPECT_TRUE(LevelScene::build(**device, view_of(parted), {enough}));
}

TEST(PartScenes, PlacesOfAnySizeAreTraceableOrPassedBy) {
  const auto device = BvhDevice::create();
  ASSERT_TRUE(device);
  LevelData level = triangle_soup(8, 0.5f, 3);
  level.part_first_quad = {0};
  for (const float scale : {1e-9f, 1e-3f, 1.0f, 1e9f}) {
    PartPlacement placement;
    placement.level_to_part = mat4x3(scale);
    level.placements.push_back(placement);
  }
  const LevelScene scene = build(**device, level);
  EmbreeContext context = make_context();
  Rng rng(3);
  for (int i = 0; i < 1000; ++i) {
    const float far = std::pow(10.0f, 12.0f * rng.next() - 6.0f);
    const vec3 origin = far * random_unit(rng);
    EmbreeRayHit ray_hit = make_ray_hit(origin, vec3(0.5f) - origin);
    if (trace_nearest(scene.handle(), context, ray_hit)) {
      EXPECT_TRUE(std::isfinite(ray_hit.ray.tfar));
      EXPECT_LT(ray_hit.hit.instID[0], 4u);
    }
  }
}

TEST(PartScenes, LevelsWithPartsDoNotMorph) {
  const LevelData parted = soup_with_parts(4, 5), soup = triangle_soup(10, 0.1f, 1);
  const auto morph = measure_morph(view_of(parted), view_of(soup));
  ASSERT_FALSE(morph);
  EXPECT_EQ(morph.error().code, ErrorCode::BadFile);
}

}  // namespace
}  // namespace farfield
