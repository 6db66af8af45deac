// SPDX-License-Identifier: Apache-2.0
// A host that bakes what it has in memory and renders it: a bush of leaves, instanced, with a material function of the
// host's own. What there is for the bake is marked (1) to (3); samples/minimal_host explains the rest.
//
//   bake_from_memory OUT.farfield OUT.ppm
#include <farfield/bake.h>
#include <farfield/embree.h>
#include <farfield/runtime.h>

#include <cmath>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include "../common/host.h"

using glm::vec2;
using glm::vec3;

namespace {

constexpr const char* kUsage = "usage: bake_from_memory OUT.farfield OUT.ppm";
constexpr int kWidth = 320, kHeight = 180, kSamples = 16, kMaxDepth = 8;
constexpr float kFieldOfView = 0.6f;  // vertical, rad
constexpr uint32_t kBark = 0, kLeaf = 1;

/// Geometry as a host may hold it: polygons with texture coordinates at their corners.
struct Polygons {
  std::vector<vec3> points;
  std::vector<uint32_t> corners, counts, materials;
  std::vector<vec2> uv;

  void add_quad(const vec3& origin, const vec3& along_u, const vec3& along_v, uint32_t material) {
    const vec2 corner_uv[4] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
    for (const vec2& at : corner_uv) {
      corners.push_back(static_cast<uint32_t>(points.size()));
      points.push_back(origin + at.x * along_u + at.y * along_v);
      uv.push_back(at);
    }
    counts.push_back(4);
    materials.push_back(material);
  }
};

/// A stem of four sides with leaves around it, one unit high.
Polygons make_twig() {
  Polygons twig;
  const float r = 0.02f;
  twig.add_quad({-r, 0, -r}, {2 * r, 0, 0}, {0, 1, 0}, kBark);
  twig.add_quad({r, 0, -r}, {0, 0, 2 * r}, {0, 1, 0}, kBark);
  twig.add_quad({r, 0, r}, {-2 * r, 0, 0}, {0, 1, 0}, kBark);
  twig.add_quad({-r, 0, r}, {0, 0, -2 * r}, {0, 1, 0}, kBark);
  for (int i = 0; i < 60; ++i) {
    const float turn = 2.4f * static_cast<float>(i), height = 0.2f + 0.013f * static_cast<float>(i);
    const vec3 out(std::cos(turn), 0.3f, std::sin(turn)), side(-std::sin(turn), 0.1f, std::cos(turn));
    twig.add_quad(vec3(0, height, 0) + 0.02f * out - 0.03f * side, 0.06f * side, 0.14f * out, kLeaf);
  }
  return twig;
}

/// What the host's surfaces are made of: called by the bake for means over areas, and by rays that meet level 0.
farfield::MaterialSample material(const farfield::MaterialQuery& at) {
  farfield::MaterialSample sample;
  if (at.material == kBark) {
    sample.diffuse = vec3(0.25f, 0.15f, 0.08f);
    return sample;
  }
  const float rib = std::abs(at.uv.x - 0.5f) < 0.1f ? 1.0f : 0.0f;
  sample.diffuse = glm::mix(vec3(0.08f, 0.3f, 0.05f), vec3(0.4f, 0.5f, 0.2f), rib);
  sample.transmission = 0.5f * sample.diffuse;
  return sample;
}

/// (2) Twigs in a ring, leaning outwards, become one asset.
farfield::BakeInput describe(const Polygons& twig) {
  farfield::BakeMesh mesh;
  mesh.name = "twig";
  mesh.points = twig.points;  // looked at where they are: nothing is copied yet
  mesh.corners = twig.corners;
  mesh.counts = twig.counts;
  mesh.materials = twig.materials;
  mesh.uv = {twig.uv, farfield::BakePer::Corner};

  farfield::BakeInput input;
  input.name = "bush";
  input.meshes = {mesh};
  for (int i = 0; i < 12; ++i) {
    const double turn = 0.524 * i, lean = 0.2 + 0.05 * (i % 4);
    const glm::dvec3 out(std::cos(turn), 0, std::sin(turn));
    const glm::dvec3 up = glm::normalize(glm::dvec3(0, 1, 0) + lean * out);
    const glm::dvec3 side = glm::normalize(glm::cross(up, out));
    input.instances.push_back({0, glm::dmat4x3(glm::cross(side, up), up, side, 0.1 * out)});
  }
  input.material_function = material;
  input.material_key = "twig materials, version 1";  // another text once material() answers otherwise
  return input;
}

/// Light that comes along one path from the camera.
vec3 trace_path(RTCScene scene, const farfield::Runtime& runtime, vec3 origin, vec3 direction, float pixel_spread,
                farfield::Rng& rng) {
  vec3 radiance(0.0f), throughput(1.0f);
  farfield::RayContext context;
  context.path_seed = rng.next_uint();
  context.cone_spread = pixel_spread;
  for (int depth = 0; depth < kMaxDepth; ++depth) {
    RTCRayHit ray = host::make_ray(origin, direction);
    context.ray_seed = rng.next_uint();
    rtcIntersect1(scene, &context.embree, &ray);
    if (ray.hit.geomID == RTC_INVALID_GEOMETRY_ID) {
      return radiance + throughput * glm::mix(vec3(0.9f), vec3(0.3f, 0.5f, 0.9f), std::max(direction.y, 0.0f));
    }
    const farfield::Interaction interaction = runtime.interaction(ray, context);
    radiance += throughput * interaction.emission;
    const farfield::ScatterSample sample = interaction.sample(rng);
    throughput *= sample.weight;
    if (throughput == vec3(0.0f)) break;
    interaction.spawn(sample, ray.ray.tfar, context);
    origin = interaction.ray_origin(sample.wi);
    direction = sample.wi;
  }
  return radiance;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) host::fail(kUsage);

  // (1) The bake: settings, progress, and what went wrong as a value.
  const Polygons twig = make_twig();
  farfield::BakeSettings settings;
  settings.finest_grid = 64;
  settings.memory_limit_bytes = uint64_t{2} << 30;
  settings.progress = [](double done, const std::string& stage) {
    std::fprintf(stderr, "%3.0f %% %s\n", 100 * done, stage.c_str());
  };
  const farfield::BakeSummary baked = host::or_fail(farfield::bake_meshes(describe(twig), argv[1], settings));
  for (const std::string& warning : baked.warnings) std::fprintf(stderr, "warning: %s\n", warning.c_str());
  for (const farfield::BakedLevel& level : baked.levels) {
    std::printf("level %u: %llu triangles, %llu voxels\n", level.level,
                static_cast<unsigned long long>(level.triangles), static_cast<unsigned long long>(level.voxels));
  }

  // (3) The same material function at level 0, so that close-ups show what the bake has seen.
  RTCDevice device = rtcNewDevice("");
  RTCScene scene = rtcNewScene(device);
  farfield::RuntimeOptions options;
  options.messages = host::messages_to_stderr();
  const std::unique_ptr<farfield::Runtime> runtime = host::or_fail(farfield::Runtime::create(device, options));
  const farfield::AssetId bush = host::or_fail(runtime->open_asset(argv[1], material));
  for (int i = 0; i < 5; ++i) {
    glm::mat4x3 to_world(1.0f);
    to_world[3] = vec3(i % 2 ? 1.2f : -1.2f, 0.0f, -3.0f * static_cast<float>(i));
    host::or_fail(runtime->add_instance(bush, to_world));
  }
  const host::Camera camera{{0.0f, 1.0f, 4.5f}, {0.0f, 0.5f, 0.0f}, kFieldOfView, kWidth, kHeight};
  runtime->set_cameras({camera.tessellation()});
  host::or_fail(runtime->plan_frame());
  host::or_fail(runtime->attach(scene));
  rtcCommitScene(scene);

  std::vector<vec3> pixels(static_cast<size_t>(kWidth) * kHeight, vec3(0.0f));
  host::for_each_row(kHeight, host::processor_count(), [&](int y) {
    for (int x = 0; x < kWidth; ++x) {
      const size_t pixel = static_cast<size_t>(y) * kWidth + static_cast<size_t>(x);
      farfield::Rng rng(pixel);
      for (int i = 0; i < kSamples; ++i) {
        const float dx = rng.next(), dy = rng.next();
        const vec3 direction = camera.direction(static_cast<float>(x) + dx, static_cast<float>(y) + dy);
        pixels[pixel] += trace_path(scene, *runtime, camera.eye, direction, camera.pixel_spread(), rng);
      }
      pixels[pixel] /= static_cast<float>(kSamples);
    }
  });
  host::write_ppm(argv[2], kWidth, kHeight, pixels);
  std::printf("%s: %s, %llu levels loaded\n", argv[2], baked.is_up_to_date ? "was baked before" : "baked",
              static_cast<unsigned long long>(runtime->stats().levels_loaded));
  rtcReleaseScene(scene);
  rtcReleaseDevice(device);
}
