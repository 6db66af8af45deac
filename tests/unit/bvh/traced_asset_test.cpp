// SPDX-License-Identifier: Apache-2.0
#include "bvh/traced_asset.h"

#include <gtest/gtest.h>

#include <optional>

#include "farfield/ray.h"

namespace farfield {
namespace {

constexpr uint8_t kGap = 64;

/// A wall of resolution 1: faces at z = 0 and z = 0.2 over [0, 100]^2, a quarter of whose paths pass.
LevelData wall() {
  LevelData level;
  level.header.level = 4;
  level.header.resolution = 1;
  for (const float z : {0.0f, 0.2f}) {
    const auto first = static_cast<uint32_t>(level.positions.size());
    for (const vec2 p : {vec2(0, 0), vec2(100, 0), vec2(100, 100), vec2(0, 100)}) level.positions.emplace_back(p, z);
    level.quads.push_back({first, first + 1, first + 2, first + 3});
  }
  level.positions.emplace_back(0.0f);  // Embree reads beyond the last one
  level.quad_first_face = {0, 2};
  level.face_gap.assign(4, kGap);
  for (const vec3& p : level.positions) level.header.bounds.extend(p);
  return level;
}

class GapWall : public testing::Test {
 protected:
  GapWall() {
    device_ = BvhDevice::create().value();
    view_ = view_of(level_);
    view_.positions = view_.positions.first(level_.positions.size() - 1);
    traced_ = TracedLevel::build(*device_, view_, 0).value();
  }

  /// The z of the hit of a ray downwards.
  std::optional<float> look_down(float x, float y, uint32_t path_seed, uint32_t ray_seed, float from = 5,
                                 float down = -1) const {
    RayContext context;
    context.path_seed = path_seed;
    context.ray_seed = ray_seed;
    EmbreeRayHit ray = make_ray_hit({x, y, from}, {0, 0, down}, 0, 100);
    if (!trace_nearest(traced_->scene.handle(), context.embree, ray)) return {};
    return from + down * ray.ray.tfar;
  }

  LevelData level_ = wall();
  LevelView view_;
  std::unique_ptr<BvhDevice> device_;
  std::unique_ptr<TracedLevel> traced_;
};

TEST_F(GapWall, AsManyPathsPassAsItSays) {
  constexpr int kPaths = 20000;
  int passed = 0;
  for (uint32_t path = 0; path < kPaths; ++path) passed += !look_down(50, 30, path, 7);
  const double share = kGap / 255.0, sigma = std::sqrt(share * (1 - share) / kPaths);
  EXPECT_NEAR(double(passed) / kPaths, share, 5 * sigma);
}

TEST_F(GapWall, WhoPassesTheFrontPassesTheBack) {
  for (uint32_t path = 0; path < 2000; ++path) {
    const auto hit = look_down(50, 30, path, 7);
    if (hit) {
      EXPECT_NEAR(*hit, 0.2f, 1e-3f);
    }
  }
}

TEST_F(GapWall, AllRaysOfAPathAgreeNearby) {
  for (uint32_t path = 0; path < 500; ++path) {
    const bool passes = !look_down(50, 30, path, 7);
    EXPECT_EQ(passes, !look_down(50.1f, 30.2f, path, 8));
    EXPECT_EQ(passes, !look_down(50, 30, path, 9, -5, 1));  // a shadow ray from behind
  }
}

TEST_F(GapWall, OtherPlacesHaveOtherGaps) {
  int differ = 0;
  for (uint32_t path = 0; path < 1000; ++path) {
    differ += look_down(50, 30, path, 7).has_value() != look_down(60, 30, path, 7).has_value();
  }
  EXPECT_NEAR(differ / 1000.0, 2 * kGap / 255.0 * (1 - kGap / 255.0), 0.08);
}

/// Planks as deep as wide, along y: what a ray across sees of them has the width of both.
TEST_F(GapWall, OfPlanksIsTheMoreClosedTheFlatterItIsLookedAt) {
  const float gap = 128 / 255.0f;
  level_.face_gap.assign(4, 128);
  level_.face_sheet_shape.assign(4, {255, 255, 0});
  level_.face_sggx.assign(4, pack_surface_sggx({1, 0, 1, 0, 0, 0}));
  view_ = view_of(level_);
  view_.positions = view_.positions.first(level_.positions.size() - 1);
  traced_ = TracedLevel::build(*device_, view_, 0).value();
  constexpr int kPaths = 20000;
  for (const vec3& across : {vec3(0.5f, 0, -1), vec3(0, 0.5f, -1), vec3(2, 0, -1)}) {
    int passed = 0;
    for (uint32_t path = 0; path < kPaths; ++path) {
      RayContext context;
      context.path_seed = path;
      EmbreeRayHit ray = make_ray_hit(vec3(50, 30, 0.2f) - across, across, 0, 1.05f);  // at the upper quad
      passed += !trace_nearest(traced_->scene.handle(), context.embree, ray);
    }
    const float covered = std::min((1 - gap) * (1 + std::abs(across.x)), 1.0f);
    const double sigma = std::sqrt(covered * (1 - covered) / kPaths);
    EXPECT_NEAR(double(passed) / kPaths, 1 - covered, 5 * sigma + 1e-3) << across.x;
  }
}

TEST_F(GapWall, FacesWithoutGapsStopEverything) {
  level_.face_gap.assign(4, 0);
  for (uint32_t path = 0; path < 1000; ++path) EXPECT_TRUE(look_down(50, 30, path, 7));
}

}  // namespace
}  // namespace farfield
