// SPDX-License-Identifier: Apache-2.0
// A renderer that already uses Embree, and what it takes to add Farfield to it. The host's own things: a ground of two
// triangles, a camera, a sky, a path loop. The lines that are there for Farfield are marked (1) to (6).
//
//   minimal_host ASSET.farfield OUT.ppm [BUDGET_MIB]
#include <farfield/embree.h>
#include <farfield/runtime.h>

#include <cstdio>
#include <memory>
#include <vector>

#include "../common/host.h"

using glm::vec3;

namespace {

constexpr const char* kUsage = "usage: minimal_host ASSET.farfield OUT.ppm [BUDGET_MIB]";
constexpr int kWidth = 320, kHeight = 180, kSamples = 16, kMaxDepth = 16;
constexpr float kFieldOfView = 0.6f;  // vertical, rad

vec3 sky(const vec3& direction) {
  const vec3 sun = glm::normalize(vec3(1, 2, 1));
  return glm::mix(vec3(0.8f), vec3(0.3f, 0.5f, 0.9f), std::max(direction.y, 0.0f)) +
         vec3(6.0f, 5.5f, 5.0f) * std::pow(std::max(glm::dot(direction, sun), 0.0f), 40.0f);
}

/// Light that comes along one path from the camera.
vec3 trace_path(RTCScene scene, const farfield::Runtime& runtime, vec3 origin, vec3 direction, float pixel_spread,
                farfield::Rng& rng) {
  vec3 radiance(0.0f), throughput(1.0f);
  farfield::RayContext context;  // (4) instead of an RTCIntersectContext
  context.path_seed = rng.next_uint();
  context.cone_spread = pixel_spread;
  for (int depth = 0; depth < kMaxDepth; ++depth) {
    RTCRayHit ray = host::make_ray(origin, direction);
    context.ray_seed = rng.next_uint();
    rtcIntersect1(scene, &context.embree, &ray);
    if (ray.hit.geomID == RTC_INVALID_GEOMETRY_ID) return radiance + throughput * sky(direction);

    if (ray.hit.geomID == runtime.geometry_id()) {  // (5) a hit on Farfield geometry
      const farfield::Interaction interaction = runtime.interaction(ray, context);
      radiance += throughput * interaction.emission;
      const farfield::ScatterSample sample = interaction.sample(rng);
      throughput *= sample.weight;
      interaction.spawn(sample, ray.ray.tfar, context);
      origin = interaction.ray_origin(sample.wi);
      direction = sample.wi;
    } else {  // the host's own
      throughput *= host::kGroundAlbedo;
      context.cone_width += context.cone_spread * ray.ray.tfar;
      context.cone_spread += 0.25f;
      context.origin_instance = farfield::kNoInstance;
      origin = host::above_ground(ray);
      direction = host::cosine_direction_up(rng);
    }
    if (throughput == vec3(0.0f)) break;
  }
  return radiance;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 3 || argc > 4) host::fail(kUsage);
  RTCDevice device = rtcNewDevice("");
  RTCScene scene = rtcNewScene(device);

  // (1) The runtime, with its budget.
  farfield::RuntimeOptions options;
  options.budget_bytes = uint64_t{argc == 4 ? host::parse_count(argv[3], host::kMaxMib, kUsage) : 1024} << 20;
  options.messages = host::messages_to_stderr();
  const std::unique_ptr<farfield::Runtime> runtime = host::or_fail(farfield::Runtime::create(device, options));

  // (2) Assets and instances: a row that leads away from the camera.
  const farfield::AssetId asset = host::or_fail(runtime->open_asset(argv[1]));
  host::Box bounds;
  runtime->bounds(asset, bounds.lower, bounds.upper);
  const vec3 center = bounds.center();
  const float size = bounds.longest_side();
  for (int i = 0; i < 12; ++i) {
    glm::mat4x3 transform(1.0f);
    transform[3] = size * vec3(i % 2 ? 0.7f : -0.7f, 0.0f, -0.8f * static_cast<float>(i));
    host::or_fail(runtime->add_instance(asset, transform));
  }

  // (3) The frame's plan, and the geometry into the host's scene.
  const vec3 eye = center + size * vec3(0.2f, 0.6f, 3.0f);
  const host::Camera camera{eye, eye + vec3(0.0f, -0.1f, -1.0f), kFieldOfView, kWidth, kHeight};
  runtime->set_cameras({camera.tessellation()});
  host::or_fail(runtime->plan_frame());
  host::or_fail(runtime->attach(scene));
  host::add_ground(device, scene, vec3(center.x, bounds.lower.y, center.z), 100.0f * size);
  rtcCommitScene(scene);

  std::vector<vec3> pixels(static_cast<size_t>(kWidth) * kHeight, vec3(0.0f));
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const size_t pixel = static_cast<size_t>(y) * kWidth + static_cast<size_t>(x);
      farfield::Rng rng(pixel);
      for (int sample = 0; sample < kSamples; ++sample) {
        const float dx = rng.next(), dy = rng.next();
        const vec3 direction = camera.direction(static_cast<float>(x) + dx, static_cast<float>(y) + dy);
        pixels[pixel] += trace_path(scene, *runtime, eye, direction, camera.pixel_spread(), rng);
      }
      pixels[pixel] /= static_cast<float>(kSamples);
    }
  }
  host::write_ppm(argv[2], kWidth, kHeight, pixels);

  const farfield::Stats stats = runtime->stats();  // (6) what it took
  std::printf("%s: %llu levels loaded, %.2f MiB accounted at the peak\n", argv[2],
              static_cast<unsigned long long>(stats.levels_loaded),
              static_cast<double>(stats.peak_accounted_bytes) / (1 << 20));
  rtcReleaseScene(scene);
  rtcReleaseDevice(device);
}
