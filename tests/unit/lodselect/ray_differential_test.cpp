// SPDX-License-Identifier: Apache-2.0
// Differentials are held against differences: the same ray a small part of a pixel beside.
#include "farfield/ray_differential.h"

#include <gtest/gtest.h>

#include <functional>

#include "base/nonfinite.h"
#include "base/random.h"
#include "base/vec.h"

namespace farfield {
namespace {

constexpr float kStep = 1e-3f;  // of a pixel

vec3 random_unit(Rng& rng) {
  vec3 v;
  do {
    v = 2.0f * vec3(rng.next(), rng.next(), rng.next()) - 1.0f;
  } while (!(glm::length(v) > 0.1f && glm::length(v) < 1.0f));
  return glm::normalize(v);
}

/// A ray in double, so that differences of neighbours mean something.
struct Ray {
  glm::dvec3 origin, direction;
};
using RayAt = std::function<Ray(double x, double y)>;

/// By differences around (0, 0).
RayDifferential measured(const RayAt& ray) {
  const Ray left = ray(-kStep, 0), right = ray(kStep, 0), below = ray(0, -kStep), above = ray(0, kStep);
  const double scale = 1 / (2.0 * static_cast<double>(kStep));
  RayDifferential d;
  d.origin_dx = vec3((right.origin - left.origin) * scale);
  d.origin_dy = vec3((above.origin - below.origin) * scale);
  d.direction_dx = vec3((right.direction - left.direction) * scale);
  d.direction_dy = vec3((above.direction - below.direction) * scale);
  return d;
}

void expect_near(const RayDifferential& a, const RayDifferential& b, float tolerance = 1e-4f) {
  const auto near = [&](const vec3& p, const vec3& q, const char* what) {
    EXPECT_LT(glm::distance(p, q), tolerance * std::max(1.0f, glm::length(q))) << what;
  };
  near(a.origin_dx, b.origin_dx, "origin dx");
  near(a.origin_dy, b.origin_dy, "origin dy");
  near(a.direction_dx, b.direction_dx, "direction dx");
  near(a.direction_dy, b.direction_dy, "direction dy");
}

/// A pinhole at the origin that looks along -z, a pixel being 0.01 wide at 1.
Ray pinhole(double x, double y) { return {{0, 0, 0}, glm::normalize(glm::dvec3(0.2 + 0.01 * x, 0.1 + 0.01 * y, -1))}; }
RayDifferential of_pinhole() { return perspective_differential({0.2f, 0.1f, -1}, {0.01f, 0, 0}, {0, 0.01f, 0}); }

Ray to_plane(const Ray& ray, const glm::dvec3& point, const glm::dvec3& normal) {
  const double t = glm::dot(point - ray.origin, normal) / glm::dot(ray.direction, normal);
  return {ray.origin + t * ray.direction, ray.direction};
}

TEST(RayDifferential, OfAPinholeIsThatOfItsRays) { expect_near(of_pinhole(), measured(pinhole), 1e-6f); }

TEST(RayDifferential, OfALensWithThePointOnItHeld) {
  const glm::dvec3 lens(0.05, -0.02, 0), focus(1, 0.5, -5);
  const RayAt ray = [&](double x, double y) {
    return Ray{lens, glm::normalize(focus + glm::dvec3(0.05 * x, 0.05 * y, 0) - lens)};
  };
  expect_near(thin_lens_differential(vec3(focus - lens), {0.05f, 0, 0}, {0, 0.05f, 0}), measured(ray), 1e-5f);
}

TEST(RayDifferential, GoesOnFromAPlane) {
  const glm::dvec3 point(0, 0, -7), normal = glm::normalize(glm::dvec3(0.3, -0.2, 1));
  const RayAt ray = [&](double x, double y) { return to_plane(pinhole(x, y), point, normal); };
  const Ray hit = ray(0, 0);
  const auto t = static_cast<float>(glm::length(hit.origin));
  expect_near(transferred(of_pinhole(), vec3(hit.direction), t, vec3(normal)), measured(ray));
}

TEST(RayDifferential, IsMirroredByABall) {
  const glm::dvec3 center(0.5, 0, -8);
  const double radius = 3;
  const auto hit_ball = [&](double x, double y) {
    const Ray ray = pinhole(x, y);
    const double b = glm::dot(center, ray.direction);
    const double t = b - std::sqrt(b * b - glm::dot(center, center) + radius * radius);
    return Ray{t * ray.direction, ray.direction};
  };
  const RayAt mirrored = [&](double x, double y) {
    const Ray hit = hit_ball(x, y);
    return Ray{hit.origin, glm::reflect(hit.direction, (hit.origin - center) / radius)};
  };
  const Ray hit = hit_ball(0, 0);
  const vec3 normal((hit.origin - center) / radius), direction(hit.direction);
  const auto arrived = transferred(of_pinhole(), direction, static_cast<float>(glm::length(hit.origin)), normal);
  expect_near(reflected(arrived, direction, normal, static_cast<float>(1 / radius)), measured(mirrored));
}

TEST(RayDifferential, IsRefractedIntoGlassAndOutOfIt) {
  for (const double eta : {1 / 1.5, 1.5}) {
    const glm::dvec3 point(0, 0, -4), normal = glm::normalize(glm::dvec3(0.2, 0.1, 1));
    const RayAt bent = [&](double x, double y) {
      const Ray hit = to_plane(pinhole(x, y), point, normal);
      return Ray{hit.origin, glm::refract(hit.direction, normal, eta)};
    };
    const Ray hit = to_plane(pinhole(0, 0), point, normal);
    const vec3 n(normal), direction(hit.direction);
    const auto arrived = transferred(of_pinhole(), direction, static_cast<float>(glm::length(hit.origin)), n);
    expect_near(refracted(arrived, direction, vec3(bent(0, 0).direction), n, static_cast<float>(eta)), measured(bent));
  }
}

TEST(RayDifferential, AxesAreThoseOfTheEllipse) {
  Rng rng(1);
  for (int i = 0; i < 200; ++i) {
    const vec3 direction = random_unit(rng);
    const vec3 x = glm::normalize(glm::cross(direction, random_unit(rng))), y = glm::cross(direction, x);
    const float longer = 0.1f + rng.next(), shorter = longer * rng.next(), turn = 6.2831853f * rng.next();
    // The ellipse's axes, seen by pixels that are turned against them; along the ray nothing counts.
    const vec3 a = longer * x, b = shorter * y;
    RayDifferential ray;
    ray.direction_dx = std::cos(turn) * a + std::sin(turn) * b + 5.0f * rng.next() * direction;
    ray.direction_dy = -std::sin(turn) * a + std::cos(turn) * b;
    const FootprintAxes axes = footprint_axes(ray, direction, 3.0f);
    EXPECT_NEAR(axes.longer, 3 * longer, 1e-4f);
    EXPECT_NEAR(axes.shorter, 3 * shorter, 1e-4f);
  }
}

TEST(RayDifferential, OfAPinholeIsItsCone) {
  const vec3 direction(0, 0, -1);
  const auto ray = perspective_differential(direction, {0.01f, 0, 0}, {0, 0.01f, 0});
  for (const float t : {0.0f, 1e-20f, 1.0f, 1e20f}) {
    const FootprintAxes axes = footprint_axes(ray, direction, t);
    EXPECT_FLOAT_EQ(axes.longer, 0.01f * t);
    EXPECT_FLOAT_EQ(axes.shorter, 0.01f * t);
  }
}

TEST(RayDifferential, WidensByALobe) {
  Rng rng(2);
  for (int i = 0; i < 100; ++i) {
    const vec3 direction = random_unit(rng);
    const auto mirror = widened({}, direction, 0.25f);
    const FootprintAxes axes = footprint_axes(mirror, direction, 2.0f);
    EXPECT_NEAR(axes.longer, 0.5f, 1e-5f);
    EXPECT_NEAR(axes.shorter, 0.5f, 1e-5f);

    RayDifferential ray;
    ray.direction_dx = 0.1f * glm::normalize(glm::cross(direction, random_unit(rng)));
    ray.direction_dy = 0.2f * glm::normalize(glm::cross(direction, ray.direction_dx));
    const FootprintAxes wide = footprint_axes(widened(ray, direction, 0.25f), direction, 1.0f);
    EXPECT_NEAR(wide.shorter, 0.35f, 1e-4f);
    EXPECT_NEAR(wide.longer, 0.45f, 1e-4f);
  }
}

TEST(RayDifferential, AtExtremesIsFiniteOrSaysSo) {
  const vec3 direction(0, 0, -1), normal(1, 0, 0);
  const auto ray = perspective_differential(direction, {0.01f, 0, 0}, {0, 0.01f, 0});
  const auto grazing = transferred(ray, direction, 1.0f, normal);  // in the plane
  EXPECT_TRUE(is_finite(grazing.origin_dx) && is_finite(grazing.origin_dy));
  EXPECT_TRUE(is_finite(transferred(ray, direction, 1.0f, glm::normalize(vec3(1, 0, 1e-6f))).origin_dx));
  EXPECT_EQ(footprint_axes({}, direction, 1e30f).longer, 0.0f);
  EXPECT_FALSE(std::isfinite(footprint_axes(ray, direction, kInfinity).longer));
  RayDifferential needle = ray;
  needle.direction_dy = vec3(0.0f);
  EXPECT_EQ(footprint_axes(needle, direction, 5.0f).shorter, 0.0f);
}

}  // namespace
}  // namespace farfield
