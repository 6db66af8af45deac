// SPDX-License-Identifier: Apache-2.0
// A renderer that already uses Embree, and what it takes to add Farfield to it. The host's own things: a ground of two
// triangles, a camera, a sky, a path loop. The lines that are there for Farfield are marked (1) to (6).
//
//   minimal_host ASSET.farfield OUT.ppm [BUDGET_MIB]
#include <embree3/rtcore.h>
#include <farfield/runtime.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <glm/glm.hpp>
#include <limits>
#include <memory>
#include <string>
#include <vector>

using glm::vec3;

namespace {

constexpr int kWidth = 320, kHeight = 180, kSamples = 16, kMaxDepth = 16;
constexpr float kPi = 3.14159265f;
constexpr float kFieldOfView = 0.6f;  // vertical, rad
const vec3 kGroundAlbedo(0.35f, 0.3f, 0.25f);

[[noreturn]] void fail(const std::string& message) {
  std::fprintf(stderr, "minimal_host: %s\n", message.c_str());
  std::exit(1);
}

template <typename T>
T or_fail(farfield::Result<T> result) {
  if (!result) fail(result.error().message);
  return std::move(*result);
}

vec3 sky(const vec3& direction) {
  const vec3 sun = glm::normalize(vec3(1, 2, 1));
  return glm::mix(vec3(0.8f), vec3(0.3f, 0.5f, 0.9f), std::max(direction.y, 0.0f)) +
         vec3(6.0f, 5.5f, 5.0f) * std::pow(std::max(glm::dot(direction, sun), 0.0f), 40.0f);
}

/// The host's own geometry.
void add_ground(RTCDevice device, RTCScene scene, const vec3& center, float half_side) {
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

vec3 cosine_direction_up(farfield::Rng& rng) {
  const float r = std::sqrt(rng.next()), phi = 2.0f * kPi * rng.next();
  return {r * std::cos(phi), std::sqrt(std::max(0.0f, 1.0f - r * r)), r * std::sin(phi)};
}

/// Light that comes along one path from the camera.
vec3 trace_path(RTCScene scene, const farfield::Runtime& runtime, vec3 origin, vec3 direction, float pixel_spread,
                farfield::Rng& rng) {
  vec3 throughput(1.0f);
  farfield::RayContext context;  // (4) instead of an RTCIntersectContext
  context.path_seed = rng.next_uint();
  context.cone_spread = pixel_spread;
  for (int depth = 0; depth < kMaxDepth; ++depth) {
    RTCRayHit ray{};
    ray.ray.org_x = origin.x, ray.ray.org_y = origin.y, ray.ray.org_z = origin.z;
    ray.ray.dir_x = direction.x, ray.ray.dir_y = direction.y, ray.ray.dir_z = direction.z;
    ray.ray.tfar = std::numeric_limits<float>::infinity();
    ray.ray.mask = ~0u;
    ray.hit.geomID = ray.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
    context.ray_seed = rng.next_uint();
    rtcIntersect1(scene, &context.embree, &ray);
    if (ray.hit.geomID == RTC_INVALID_GEOMETRY_ID) return throughput * sky(direction);

    context.cone_width += context.cone_spread * ray.ray.tfar;
    if (ray.hit.geomID == runtime.geometry_id()) {  // (5) a hit on Farfield geometry
      const farfield::Interaction interaction = runtime.interaction(ray, context);
      const farfield::ScatterSample sample = interaction.sample(rng);
      throughput *= sample.weight;
      context.cone_spread = interaction.next_cone_spread(sample, context.cone_spread);
      context.set_origin(context.hit);
      origin = interaction.ray_origin(sample.wi);
      direction = sample.wi;
    } else {  // the host's own
      throughput *= kGroundAlbedo;
      context.cone_spread += 0.25f;
      context.origin_instance = farfield::kNoInstance;
      origin += ray.ray.tfar * direction;
      origin.y += 1e-4f * (1.0f + ray.ray.tfar);
      direction = cosine_direction_up(rng);
    }
    if (throughput == vec3(0.0f)) return vec3(0.0f);
  }
  return vec3(0.0f);
}

void write_ppm(const char* path, const std::vector<vec3>& pixels) {
  std::FILE* file = std::fopen(path, "wb");
  if (!file) fail(std::string("cannot write ") + path);
  std::fprintf(file, "P6\n%d %d\n255\n", kWidth, kHeight);
  for (const vec3& pixel : pixels) {
    for (int c = 0; c < 3; ++c) {
      const float display = std::pow(std::min(pixel[c], 1.0f), 1.0f / 2.2f);
      std::fputc(static_cast<int>(std::lround(255.0f * display)), file);
    }
  }
  std::fclose(file);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 3 || argc > 4) fail("usage: minimal_host ASSET.farfield OUT.ppm [BUDGET_MIB]");
  RTCDevice device = rtcNewDevice("");
  RTCScene scene = rtcNewScene(device);

  // (1) The runtime, with its budget.
  farfield::RuntimeOptions options;
  options.budget_bytes = (argc == 4 ? std::strtoull(argv[3], nullptr, 10) : 1024ull) << 20;
  options.messages = [](farfield::Severity, const std::string& text) { std::fprintf(stderr, "%s\n", text.c_str()); };
  const std::unique_ptr<farfield::Runtime> runtime = or_fail(farfield::Runtime::create(device, options));

  // (2) Assets and instances: a row that leads away from the camera.
  const farfield::AssetId asset = or_fail(runtime->open_asset(argv[1]));
  vec3 lower, upper;
  runtime->bounds(asset, lower, upper);
  const vec3 center = 0.5f * (lower + upper);
  const float size = std::max(upper.x - lower.x, std::max(upper.y - lower.y, upper.z - lower.z));
  for (int i = 0; i < 12; ++i) {
    glm::mat4x3 transform(1.0f);
    transform[3] = size * vec3(i % 2 ? 0.7f : -0.7f, 0.0f, -0.8f * static_cast<float>(i));
    or_fail(runtime->add_instance(asset, transform));
  }

  // (3) The frame's plan, and the geometry into the host's scene.
  const vec3 eye = center + size * vec3(0.2f, 0.6f, 3.0f);
  const float pixel_spread = 2.0f * std::tan(0.5f * kFieldOfView) / static_cast<float>(kHeight);
  runtime->set_cameras({{eye, 0.0f, pixel_spread}});
  or_fail(runtime->plan_frame());
  or_fail(runtime->attach(scene));
  add_ground(device, scene, vec3(center.x, lower.y, center.z), 100.0f * size);
  rtcCommitScene(scene);

  std::vector<vec3> pixels(static_cast<size_t>(kWidth) * kHeight, vec3(0.0f));
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const size_t pixel = static_cast<size_t>(y) * kWidth + static_cast<size_t>(x);
      farfield::Rng rng(pixel);
      for (int sample = 0; sample < kSamples; ++sample) {
        const vec3 direction((static_cast<float>(x) + rng.next() - 0.5f * kWidth) * pixel_spread,
                             (0.5f * kHeight - static_cast<float>(y) - rng.next()) * pixel_spread - 0.1f, -1.0f);
        pixels[pixel] += trace_path(scene, *runtime, eye, glm::normalize(direction), pixel_spread, rng);
      }
      pixels[pixel] /= static_cast<float>(kSamples);
    }
  }
  write_ppm(argv[2], pixels);

  const farfield::Stats stats = runtime->stats();  // (6) what it took
  std::printf("%s: %llu levels loaded, %.2f MiB accounted at the peak\n", argv[2],
              static_cast<unsigned long long>(stats.levels_loaded),
              static_cast<double>(stats.peak_accounted_bytes) / (1 << 20));
  rtcReleaseScene(scene);
  rtcReleaseDevice(device);
}
