// SPDX-License-Identifier: Apache-2.0
#include "tests/support/runtime_host.h"

#include <gtest/gtest.h>

#include <cstring>

#include "base/check.h"
#include "base/hash.h"
#include "base/parallel.h"
#include "bvh/level_scene.h"
#include "bvh/traced_morph.h"
#include "tests/support/asset_writer.h"
#include "tests/support/random_unit.h"

namespace farfield::test {

void write_asset(const std::filesystem::path& folder, const std::vector<LevelData>& levels, dvec3 origin) {
  const auto or_stop = [](const Result<LevelCost>& cost) {
    if (!cost) ADD_FAILURE() << cost.error().message;
    FARFIELD_CHECK(cost.has_value());
    return *cost;
  };
  write_asset(
      folder, levels, [&](const LevelView& level) { return or_stop(measure_level_scene(level)); }, origin,
      [&](const LevelView& fine, const LevelView& coarse) { return or_stop(measure_morph(fine, coarse)); });
}

Host::Host(RuntimeOptions options) : device_(*make_embree_device()) {
  options.messages = [this](Severity, const std::string& message) {
    const std::lock_guard lock(messages_mutex_);
    messages.push_back(message);
  };
  auto runtime = Runtime::create(device_.get(), options);
  if (!runtime) ADD_FAILURE() << runtime.error().message;
  FARFIELD_CHECK(runtime.has_value());
  runtime_ = std::move(*runtime);
}

size_t Host::message_count() const {
  const std::lock_guard lock(messages_mutex_);
  return messages.size();
}

AssetId Host::add(const std::filesystem::path& folder, const std::vector<mat4x3>& transforms) {
  const auto asset = runtime_->open_asset(folder.string());
  if (!asset) ADD_FAILURE() << asset.error().message;
  FARFIELD_CHECK(asset.has_value());
  for (const mat4x3& transform : transforms) {
    const auto instance = runtime_->add_instance(*asset, transform);
    if (!instance) ADD_FAILURE() << instance.error().message;
  }
  return *asset;
}

PlanSummary Host::plan(const vec3& position, float pixel_spread) {
  runtime_->set_cameras({{position, 0.0f, pixel_spread}});
  const auto plan = runtime_->plan_frame();
  if (!plan) ADD_FAILURE() << plan.error().message;
  FARFIELD_CHECK(plan.has_value());
  commit();
  return *plan;
}

void Host::commit() {
  if (!scene_) scene_ = new_scene(device_.get());
  const auto attached = runtime_->attach(scene_.get());
  if (!attached) ADD_FAILURE() << attached.error().message;
  commit_scene(scene_.get());
}

bool Host::trace(const vec3& origin, const vec3& direction, RayContext& context, EmbreeRayHit& ray_hit) const {
  ray_hit = make_ray_hit(origin, direction);
  return trace(context, ray_hit);
}

bool Host::trace(RayContext& context, EmbreeRayHit& ray_hit) const {
  return trace_nearest(scene_.get(), context.embree, ray_hit) && ray_hit.hit.geomID == runtime_->geometry_id();
}

uint64_t hash_of_hits(const Host& host, float spread) {
  constexpr size_t kRays = 20000;
  std::vector<uint64_t> hashes(kRays);
  parallel_for(kRays, 128, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) {
      Rng rng(i);
      const vec3 direction = random_unit(rng);
      RayContext context;
      context.path_seed = rng.next_uint();
      context.ray_seed = rng.next_uint();
      context.cone_spread = spread * rng.next();
      EmbreeRayHit hit;
      if (!host.trace(1.2f * random_unit(rng) - 10.0f * direction, direction, context, hit)) continue;
      uint32_t t_bits;
      std::memcpy(&t_bits, &hit.ray.tfar, sizeof t_bits);
      hashes[i] = mix64(mix64(context.hit.instance, context.hit.element), mix64(context.hit.level_slot, t_bits));
    }
  });
  return hash_values(std::span<const uint64_t>(hashes));
}

}  // namespace farfield::test
