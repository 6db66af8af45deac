// SPDX-License-Identifier: Apache-2.0
// What becomes of rays that leave a surface level: with their hit's level kept (RayContext::set_origin), and with one
// chosen anew, as if the ray came from elsewhere. For closed surfaces.
//
//   build/release/bin/origin_figures ASSET.farfield
//
// Rays come from all around at a lambda of half a level above each stored one, and leave into the hemisphere of the
// geometric normal, diffusely; those of which the level is chosen anew are another path's to the blend. Acne: the next
// hit is nearer than a quarter of that level's resolution. Leak: it is on the inside of a face, so that the ray has set
// out beneath the surface. Both in percent of rays that leave surfaces.
#include <farfield/random.h>
#include <farfield/runtime.h>
#include <fmt/format.h>

#include <cmath>

#include "base/embree.h"
#include "base/result.h"

namespace farfield {
namespace {

constexpr int kRays = 200'000;

glm::vec3 on_sphere(Rng& rng) {
  const float z = 2 * rng.next() - 1, a = 6.2831853f * rng.next(), r = std::sqrt(1 - z * z);
  return {r * std::cos(a), r * std::sin(a), z};
}

struct Counts {
  int left = 0, acne = 0, leaks = 0;

  void add(bool is_hit, float t, const glm::vec3& normal, const glm::vec3& direction, float near) {
    ++left;
    if (!is_hit) return;
    acne += t < near;
    leaks += glm::dot(normal, direction) > 0;
  }
  std::string text() const {
    return fmt::format("{:.3f} / {:.3f} %", 100.0 * acne / std::max(left, 1), 100.0 * leaks / std::max(left, 1));
  }
};

struct Scene {
  std::unique_ptr<Runtime> runtime;
  EmbreeScene embree;
  glm::vec3 center;
  float radius;
};

Result<Scene> open(EmbreeDeviceRef device, const char* folder, Blend blend, float lambda) {
  RuntimeOptions options;
  options.budget_bytes = uint64_t{16} << 30;
  options.blend = blend;
  options.forced_lambda = lambda;
  Scene scene;
  FARFIELD_TRY_LET(scene.runtime, Runtime::create(device, options));
  FARFIELD_TRY_LET(const AssetId asset, scene.runtime->open_asset(folder));
  FARFIELD_TRY(scene.runtime->add_instance(asset, glm::mat4x3(1.0f)));
  glm::vec3 lower, upper;
  scene.runtime->bounds(asset, lower, upper);
  scene.center = 0.5f * (lower + upper), scene.radius = 0.5f * glm::length(upper - lower);
  FARFIELD_TRY(scene.runtime->plan_frame());
  scene.embree = new_scene(device);
  FARFIELD_TRY(scene.runtime->attach(scene.embree.get()));
  commit_scene(scene.embree.get());
  return scene;
}

Counts count(const Scene& scene, float near, bool keeps_level) {
  Counts counts;
  for (int i = 0; i < kRays; ++i) {
    Rng rng(static_cast<uint64_t>(i));
    const glm::vec3 eye = scene.center + 2 * scene.radius * on_sphere(rng);
    const glm::vec3 target = scene.center + 0.7f * scene.radius * on_sphere(rng);
    RayContext context;
    context.path_seed = rng.next_uint(), context.ray_seed = rng.next_uint();
    EmbreeRayHit seen = make_ray_hit(eye, glm::normalize(target - eye));
    if (!trace_nearest(scene.embree.get(), context.embree, seen)) continue;
    const Interaction hit = scene.runtime->interaction(seen, context);
    if (hit.kind != Interaction::Kind::Surface) continue;
    const glm::vec3 direction = glm::normalize(hit.geometric_normal + 0.999f * on_sphere(rng));
    RayContext leaving;
    leaving.path_seed = keeps_level ? context.path_seed : rng.next_uint();
    leaving.ray_seed = rng.next_uint();
    if (keeps_level) leaving.set_origin(context.hit);
    EmbreeRayHit next = make_ray_hit(hit.ray_origin(direction), direction);
    const bool is_hit = trace_nearest(scene.embree.get(), leaving.embree, next);
    counts.add(is_hit && !leaving.hit.is_volume, next.ray.tfar, {next.hit.Ng_x, next.hit.Ng_y, next.hit.Ng_z},
               direction, near);
  }
  return counts;
}

Result<void> print_all(const char* folder) {
  FARFIELD_TRY_LET(const auto device, make_embree_device());
  FARFIELD_TRY_LET(const Scene source, open(device.get(), folder, Blend::Dissolve, 0.0f));
  fmt::print("| lambda | kept: acne / leak | kept, morph | chosen anew |\n|---|---|---|---|\n");
  for (const LevelInfo& level : source.runtime->levels(AssetId{0})) {
    if (level.triangles == 0) break;
    const float lambda = static_cast<float>(level.level) + 0.5f, near = 0.25f * level.resolution;
    FARFIELD_TRY_LET(const Scene dissolving, open(device.get(), folder, Blend::Dissolve, lambda));
    FARFIELD_TRY_LET(const Scene morphing, open(device.get(), folder, Blend::Morph, lambda));
    fmt::print("| {} | {} | {} | {} |\n", lambda, count(dissolving, near, true).text(),
               count(morphing, near, true).text(), count(dissolving, near, false).text());
    std::fflush(stdout);
  }
  return {};
}

}  // namespace
}  // namespace farfield

int main(int argc, char** argv) {
  if (argc != 2) {
    fmt::print(stderr, "usage: origin_figures ASSET.farfield\n");
    return 2;
  }
  const auto done = farfield::print_all(argv[1]);
  if (!done) fmt::print(stderr, "origin_figures: {}\n", done.error().message);
  return done ? 0 : 1;
}
