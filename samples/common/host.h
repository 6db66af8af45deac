// SPDX-License-Identifier: Apache-2.0
// What the samples' hosts share and any renderer has of its own: errors, rays, a camera, a ground, threads, pictures.
// Nothing here is needed to use Farfield; what is stands in each sample's main.cpp.
#pragma once

#include <farfield/embree.h>
#include <farfield/runtime.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <glm/glm.hpp>
#include <limits>
#include <string>
#include <thread>
#include <utility>
#include <vector>

namespace host {

using glm::vec3;

constexpr float kPi = 3.14159265f;
const vec3 kGroundAlbedo(0.35f, 0.3f, 0.25f);

[[noreturn]] inline void fail(const std::string& message) {
  std::fprintf(stderr, "%s\n", message.c_str());
  std::exit(1);
}

template <typename T>
T or_fail(farfield::Result<T> result) {
  if (!result) fail(result.error().message);
  return std::move(*result);
}

/// A whole number from 1 to `largest` that an argument must be; fails with the usage line.
inline unsigned long parse_count(const char* text, unsigned long largest, const char* usage) {
  char* end = nullptr;
  errno = 0;
  const unsigned long value = std::strtoul(text, &end, 10);
  const bool is_number = *text >= '0' && *text <= '9' && *end == '\0' && errno == 0;
  if (!is_number || value < 1 || value > largest) {
    fail("'" + std::string(text) + "' is not a number from 1 to " + std::to_string(largest) + "\n" + usage);
  }
  return value;
}

/// The longest argument of MiB that still is a number of bytes.
constexpr unsigned long kMaxMib = 1ul << 24;

inline farfield::MessageSink messages_to_stderr() {
  return [](farfield::Severity, const std::string& text) { std::fprintf(stderr, "%s\n", text.c_str()); };
}

/// A ray without an end that has not hit anything.
inline RTCRayHit make_ray(const vec3& origin, const vec3& direction) {
  RTCRayHit ray{};
  ray.ray.org_x = origin.x, ray.ray.org_y = origin.y, ray.ray.org_z = origin.z;
  ray.ray.dir_x = direction.x, ray.ray.dir_y = direction.y, ray.ray.dir_z = direction.z;
  ray.ray.tfar = std::numeric_limits<float>::infinity();
  ray.ray.mask = ~0u;
  ray.hit.geomID = ray.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
  return ray;
}

struct Box {
  vec3 lower, upper;
  vec3 center() const { return 0.5f * (lower + upper); }
  float longest_side() const { return std::max({upper.x - lower.x, upper.y - lower.y, upper.z - lower.z}); }
};

/// A pinhole camera, y up; it must not look straight up or down.
struct Camera {
  vec3 eye, target;
  float field_of_view;  ///< vertical, rad
  int width, height;

  /// Width of a pixel at distance 1.
  float pixel_spread() const { return 2.0f * std::tan(0.5f * field_of_view) / static_cast<float>(height); }
  /// Through the point (x, y) of the picture in pixels, from its upper left corner. Unit.
  vec3 direction(float x, float y) const {
    const vec3 forward = glm::normalize(target - eye);
    const vec3 right = glm::normalize(glm::cross(forward, vec3(0, 1, 0)));
    const vec3 up = glm::cross(right, forward);
    const float right_px = x - 0.5f * static_cast<float>(width), up_px = 0.5f * static_cast<float>(height) - y;
    return glm::normalize(forward + pixel_spread() * (right_px * right + up_px * up));
  }
  /// The camera as Farfield wants to know it.
  farfield::TessellationCamera tessellation() const { return {eye, 0.0f, pixel_spread()}; }
};

/// Geometry of the host's own: a square of two triangles.
inline void add_ground(RTCDevice device, RTCScene scene, const vec3& center, float half_side) {
  RTCGeometry ground = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
  auto* corners = static_cast<float*>(
      rtcSetNewGeometryBuffer(ground, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, sizeof(float[3]), 4));
  auto* triangles = static_cast<unsigned*>(
      rtcSetNewGeometryBuffer(ground, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, sizeof(unsigned[3]), 2));
  for (int i = 0; i < 4; ++i) {
    corners[3 * i + 0] = center.x + (i & 1 ? half_side : -half_side);
    corners[3 * i + 1] = center.y;
    corners[3 * i + 2] = center.z + (i & 2 ? half_side : -half_side);
  }
  const unsigned indices[6] = {0, 2, 1, 1, 2, 3};
  std::copy(indices, indices + 6, triangles);
  rtcCommitGeometry(ground);
  rtcAttachGeometry(scene, ground);
  rtcReleaseGeometry(ground);
}

/// Just above the ground, where a ray hit it.
inline vec3 above_ground(const RTCRayHit& ray) {
  const float t = ray.ray.tfar;
  return vec3(ray.ray.org_x, ray.ray.org_y, ray.ray.org_z) + t * vec3(ray.ray.dir_x, ray.ray.dir_y, ray.ray.dir_z) +
         vec3(0.0f, 1e-4f * (1.0f + t), 0.0f);
}

inline vec3 cosine_direction_up(farfield::Rng& rng) {
  const float r = std::sqrt(rng.next()), phi = 2.0f * kPi * rng.next();
  return {r * std::cos(phi), std::sqrt(std::max(0.0f, 1.0f - r * r)), r * std::sin(phi)};
}

/// Calls row(y) for all y in [0, rows), on `thread_count` threads.
template <typename Row>
void for_each_row(int rows, unsigned thread_count, const Row& row) {
  std::atomic<int> next{0};
  const auto work = [&] {
    for (int y = next++; y < rows; y = next++) row(y);
  };
  std::vector<std::thread> threads;
  for (unsigned i = 1; i < thread_count; ++i) threads.emplace_back(work);
  work();
  for (std::thread& thread : threads) thread.join();
}

inline unsigned processor_count() { return std::max(1u, std::thread::hardware_concurrency()); }

/// Writes linear RGB, row by row from the top, as a PPM for displays of gamma 2.2.
inline void write_ppm(const std::string& path, int width, int height, const std::vector<vec3>& pixels) {
  std::FILE* file = std::fopen(path.c_str(), "wb");
  if (!file) fail("cannot write " + path);
  std::fprintf(file, "P6\n%d %d\n255\n", width, height);
  for (const vec3& pixel : pixels) {
    for (int c = 0; c < 3; ++c) {
      const float display = std::pow(std::min(pixel[c], 1.0f), 1.0f / 2.2f);
      std::fputc(static_cast<int>(std::lround(255.0f * display)), file);
    }
  }
  const bool is_whole = std::ferror(file) == 0;
  if (std::fclose(file) != 0 || !is_whole) fail("cannot write all of " + path + ": is the disk full?");
}

}  // namespace host
