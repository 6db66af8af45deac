// SPDX-License-Identifier: Apache-2.0
#include "evaluate/views.h"

#include <gtest/gtest.h>

namespace farfield {
namespace {

Box3 box(const vec3& lower, const vec3& upper) { return {lower, upper}; }

TEST(ViewDirections, TwelveAreTheVerticesOfAnIcosahedron) {
  const std::vector<vec3> directions = view_directions(12);
  ASSERT_EQ(directions.size(), 12u);
  // Between two vertices the cosine is 1, 1/sqrt(5), -1/sqrt(5) or -1: 1, 5, 5 and 1 times seen from each.
  const float inner = 1.0f / std::sqrt(5.0f);
  for (const vec3& a : directions) {
    EXPECT_NEAR(glm::length(a), 1.0f, 1e-6f);
    int near = 0, far = 0, opposite = 0;
    for (const vec3& b : directions) {
      const float cosine = glm::dot(a, b);
      near += std::abs(cosine - inner) < 1e-5f;
      far += std::abs(cosine + inner) < 1e-5f;
      opposite += std::abs(cosine + 1.0f) < 1e-5f;
    }
    EXPECT_EQ(near, 5);
    EXPECT_EQ(far, 5);
    EXPECT_EQ(opposite, 1);
  }
}

TEST(ViewDirections, APrefixOfTheIcosahedronIsSpreadOut) {
  const std::vector<vec3> all = view_directions(12);
  for (const int count : {2, 3, 5, 11}) {
    const std::vector<vec3> some = view_directions(count);
    for (size_t i = 0; i < some.size(); ++i) EXPECT_EQ(some[i], all[i]);
  }
}

TEST(ViewDirections, SixAreTheAxesOfTheIcosahedron) {
  // The mean of (w . u)^4 over the sphere is 1/5 for any unit u, that of (w . u)^2 is 1/3.
  const vec3 u = glm::normalize(vec3(0.3f, -0.8f, 0.5f));
  float second = 0, fourth = 0;
  vec3 sum(0.0f);
  for (const vec3& direction : view_directions(6)) {
    const float cosine2 = glm::dot(direction, u) * glm::dot(direction, u);
    second += cosine2 / 6, fourth += cosine2 * cosine2 / 6;
    sum += direction;
  }
  EXPECT_NEAR(second, 1.0f / 3.0f, 1e-5f);
  EXPECT_NEAR(fourth, 1.0f / 5.0f, 1e-5f);
  EXPECT_LT(glm::length(sum), 2.5f);  // not all from one side
}

TEST(ViewDirections, NoneOfTheIcosahedronIsNearAPlaneThatThingsAreBuiltAlong) {
  for (const vec3& direction : view_directions(12)) {
    for (int axis = 0; axis < 3; ++axis) {
      EXPECT_GT(std::abs(direction[axis]), std::sin(6 * kPi / 180)) << axis;
      for (const float sign : {1.0f, -1.0f}) {
        const float across = direction[(axis + 1) % 3] + sign * direction[(axis + 2) % 3];
        EXPECT_GT(std::abs(across) / std::sqrt(2.0f), std::sin(4 * kPi / 180)) << axis;
      }
    }
  }
}

TEST(ViewDirections, ManyAverageToNothing) {
  for (const int count : {12, 13, 100, 1000}) {
    vec3 mean(0.0f);
    for (const vec3& direction : view_directions(count)) {
      EXPECT_NEAR(glm::length(direction), 1.0f, 1e-5f);
      mean += direction / static_cast<float>(count);
    }
    EXPECT_LT(glm::length(mean), 0.5f / static_cast<float>(count)) << count;
  }
}

TEST(ViewDirections, NoneForZeroOrLess) {
  EXPECT_TRUE(view_directions(0).empty());
  EXPECT_TRUE(view_directions(-3).empty());
}

TEST(FrameView, ContainsEveryCornerWithWholePixelsAndABorder) {
  const Box3 bounds = box({-1.0f, 2.0f, 0.5f}, {3.0f, 4.5f, 9.0f});
  for (const float pixel : {0.013f, 0.1f, 1.0f, 7.0f, 100.0f})
    for (const vec3& direction : view_directions(12)) {
      const OrthoView view = frame_view(bounds, direction, pixel);
      EXPECT_EQ(view.pixel_size, pixel);
      const float half_width = 0.5f * pixel * static_cast<float>(view.width_px);
      const float half_height = 0.5f * pixel * static_cast<float>(view.height_px);
      float widest = 0, tallest = 0;
      for (int corner = 0; corner < 8; ++corner) {
        const vec3 point((corner & 1) ? bounds.upper.x : bounds.lower.x, (corner & 2) ? bounds.upper.y : bounds.lower.y,
                         (corner & 4) ? bounds.upper.z : bounds.lower.z);
        widest = std::max(widest, std::abs(glm::dot(point - view.center, view.right())));
        tallest = std::max(tallest, std::abs(glm::dot(point - view.center, view.up)));
      }
      // At least nearly a whole pixel is free on each side, and less than two.
      EXPECT_GT(half_width - widest, 0.99f * pixel);
      EXPECT_LT(half_width - widest, 1.6f * pixel);
      EXPECT_GT(half_height - tallest, 0.99f * pixel);
      EXPECT_LT(half_height - tallest, 1.6f * pixel);
    }
}

TEST(FrameView, AxesAreOrthonormalAndUpIsUp) {
  for (const vec3& direction : {vec3(0, 0, -2), vec3(1, 1, 1), vec3(0, 1, 0), vec3(0, -1, 0), vec3(1e-4f, 1, 0)}) {
    const OrthoView view = frame_view(box(vec3(-1.0f), vec3(1.0f)), direction, 0.1f);
    EXPECT_NEAR(glm::length(view.direction), 1.0f, 1e-6f);
    EXPECT_NEAR(glm::length(view.up), 1.0f, 1e-6f);
    EXPECT_NEAR(glm::dot(view.up, view.direction), 0.0f, 1e-6f);
    EXPECT_NEAR(glm::length(view.right()), 1.0f, 1e-6f);
    EXPECT_GT(view.up.y, -1e-3f);
  }
}

TEST(FrameView, ExtentOfWholePixelsIsNotRoundedUp) {
  const OrthoView view = frame_view(box(vec3(0.0f), vec3(1.6f)), {0, 0, -1}, 0.1f);
  EXPECT_EQ(view.width_px, 18);
  EXPECT_EQ(view.height_px, 18);
}

TEST(FrameView, DegenerateBoundsAndPixelsStayFinite) {
  const OrthoView empty = frame_view(Box3{}, {0, 0, -1}, 0.1f);
  EXPECT_EQ(empty.width_px, 2);
  EXPECT_EQ(empty.height_px, 2);
  const OrthoView flat = frame_view(box({0, 0, 0}, {1, 0, 0}), {1, 0, 0}, 0.5f);
  EXPECT_EQ(flat.width_px, 2);
  const OrthoView tiny_pixels = frame_view(box(vec3(-1e30f), vec3(1e30f)), {0, 0, -1}, 1e-30f);
  EXPECT_LE(tiny_pixels.width_px, (1 << 16) + 2);
  const OrthoView far_away = frame_view(box(vec3(1e7f), vec3(1e7f + 16.0f)), {0, 0, -1}, 1.0f);
  EXPECT_EQ(far_away.width_px, 18);
}

}  // namespace
}  // namespace farfield
