// SPDX-License-Identifier: Apache-2.0
#include "path_tracer/camera.h"

#include <gtest/gtest.h>

namespace farfield {
namespace {

constexpr float kTolerance = 1e-5f;

void expect_near(const vec3& a, const vec3& b, float tolerance = kTolerance) {
  EXPECT_LT(glm::length(a - b), tolerance)
      << a.x << " " << a.y << " " << a.z << " and " << b.x << " " << b.y << " " << b.z;
}

Camera perspective(int width, int height, float fov_y = 1.0f) {
  return Camera::perspective({1, 2, 3}, {0, 0, -2}, {0, 5, 1}, fov_y, width, height);
}

TEST(Camera, LooksForwardAtTheImagesCentre) {
  for (const Camera& camera :
       {perspective(40, 30), Camera::orthographic({1, 2, 3}, {0, 0, -1}, {0, 1, 0}, 4.0f, 40, 30)}) {
    const CameraRay ray = camera.ray(20, 15);
    expect_near(ray.direction, {0, 0, -1});
    expect_near(ray.origin, {1, 2, 3});
  }
}

TEST(Camera, UpperEdgeIsHalfTheVerticalAngleAboveTheCentre) {
  const Camera camera = perspective(640, 360, 0.7f);
  expect_near(camera.ray(320, 0).direction, {0, std::sin(0.35f), -std::cos(0.35f)});
  expect_near(camera.ray(320, 360).direction, {0, -std::sin(0.35f), -std::cos(0.35f)});
}

TEST(Camera, PixelXGrowsToTheRight) {
  EXPECT_GT(perspective(10, 10).ray(9, 5).direction.x, 0.1f);
  EXPECT_GT(Camera::orthographic({0, 0, 0}, {0, 0, -1}, {0, 1, 0}, 4.0f, 10, 10).ray(9, 5).origin.x, 0.1f);
}

TEST(RayAt, GoesStraightBetweenKeys) {
  const Camera still = perspective(40, 30);
  const std::vector<Camera> keys = {Camera::orthographic({0, 0, 3}, {0, 0, -1}, {0, 1, 0}, 4.0f, 40, 30),
                                    Camera::orthographic({1, 0, 3}, {0, 0, -1}, {0, 1, 0}, 4.0f, 40, 30),
                                    Camera::orthographic({1, 6, 3}, {0, 0, -1}, {0, 1, 0}, 4.0f, 40, 30)};
  expect_near(ray_at({&still, 1}, 7, 8, 0.9f).direction, still.ray(7, 8).direction, 0.0f + 1e-9f);
  expect_near(ray_at(keys, 20, 15, 0.25f).origin, {0.5f, 0, 3});
  expect_near(ray_at(keys, 20, 15, 0.5f).origin, {1, 0, 3});
  expect_near(ray_at(keys, 20, 15, 0.75f).origin, {1, 3, 3});
  expect_near(ray_at(keys, 20, 15, 1.0f).origin, {1, 6, 3});
  const std::vector<Camera> turning = {still, Camera::perspective({1, 2, 3}, {2, 0, 0}, {0, 5, 1}, 1.0f, 40, 30)};
  const CameraRay halfway = ray_at(turning, 20, 15, 0.5f);
  expect_near(halfway.direction, glm::normalize(vec3(1, 0, -1)));
  EXPECT_FLOAT_EQ(halfway.cone_spread, still.ray(20, 15).cone_spread);
}

TEST(Camera, ConeIsAsWideAsThePixelsDistanceOnTheSubjectsPlane) {
  // The promise of cone and tessellation camera: at the plane where two neighbouring pixels' rays meet a surface that
  // faces the camera, the cone is as wide as their points are apart.
  const Camera camera = perspective(64, 48, 1.2f);
  for (const float depth : {0.1f, 1.0f, 1000.0f}) {
    for (const auto& [x, y] : {std::pair{32.0f, 24.0f}, std::pair{1.0f, 1.0f}, std::pair{60.0f, 10.0f}}) {
      const CameraRay a = camera.ray(x, y), b = camera.ray(x + 1, y);
      const float t_a = depth / -a.direction.z, t_b = depth / -b.direction.z;
      const float apart = glm::length(a.direction * t_a - b.direction * t_b);
      EXPECT_NEAR((a.cone_width + a.cone_spread * t_a) / apart, 1.0f, 1e-3f);
      EXPECT_NEAR(camera.tessellation().pixel_spread * depth / apart, 1.0f, 1e-3f);
    }
  }
}

TEST(Camera, OrthographicConesAreOnePixelWideEverywhere) {
  const Camera camera = Camera::orthographic({0, 0, 9}, {0, 0, -1}, {0, 1, 0}, 4.0f, 64, 48);
  const CameraRay a = camera.ray(3, 40), b = camera.ray(4, 40);
  EXPECT_NEAR(glm::length(a.origin - b.origin), 4.0f / 64, kTolerance);
  EXPECT_FLOAT_EQ(a.cone_width, 4.0f / 64);
  EXPECT_EQ(a.cone_spread, 0.0f);
  EXPECT_FLOAT_EQ(camera.tessellation().pixel_width, 4.0f / 64);
  EXPECT_EQ(camera.tessellation().pixel_spread, 0.0f);
}

TEST(Camera, TessellationSpreadIsTwoTanOfHalfTheAnglePerLine) {
  const TessellationCamera camera = perspective(640, 360, 0.5632f).tessellation();
  EXPECT_NEAR(camera.pixel_spread, 2 * std::tan(0.2816f) / 360, 1e-8f);
  EXPECT_EQ(camera.pixel_width, 0.0f);
  expect_near(camera.position, {1, 2, 3});
}

TEST(Camera, DirectionsAreUnitAtExtremes) {
  for (const float fov : {1e-4f, 3.14f})
    for (const float x : {0.0f, 1e-3f, 40.0f})
      EXPECT_NEAR(glm::length(perspective(40, 30, fov).ray(x, 30).direction), 1.0f, kTolerance);
}

}  // namespace
}  // namespace farfield
