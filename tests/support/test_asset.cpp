// SPDX-License-Identifier: Apache-2.0
#include "tests/support/test_asset.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <cstring>

#include "base/check.h"
#include "base/hash.h"
#include "base/parallel.h"
#include "bvh/level_scene.h"
#include "cache/level_file.h"
#include "cache/manifest.h"
#include "tests/support/test_levels.h"

namespace farfield::testing {

TemporaryFolder::TemporaryFolder() {
  std::string name = (std::filesystem::temp_directory_path() / "farfield_runtime_XXXXXX").string();
  FARFIELD_CHECK(mkdtemp(name.data()) != nullptr);
  path_ = name;
}

TemporaryFolder::~TemporaryFolder() {
  std::error_code ignored;
  std::filesystem::remove_all(path_, ignored);
}

void write_asset(const std::filesystem::path& folder, const std::vector<LevelData>& levels, dvec3 origin) {
  std::filesystem::create_directories(folder);
  Manifest manifest;
  manifest.generator = "test";
  manifest.source = "test.obj";
  manifest.origin = origin;
  manifest.base_resolution = std::ldexp(levels[0].header.resolution, -static_cast<int>(levels[0].header.level));
  for (const LevelData& level : levels) {
    LevelEntry entry;
    entry.level = level.header.level;
    entry.resolution = level.header.resolution;
    entry.grid = 1;
    entry.file = "level_" + std::to_string(entry.level) + ".ffl";
    const auto bytes = write_level(folder / entry.file, level);
    if (!bytes) ADD_FAILURE() << bytes.error().message;
    const auto cost = measure_level_scene(view_of(level));
    FARFIELD_CHECK(bytes && cost);
    entry.file_bytes = *bytes;
    entry.file_hash = *hash_level_file(folder / entry.file);
    entry.triangles = face_count(level);
    entry.voxels = voxel_count(level);
    entry.bricks = level.bricks.size();
    entry.resident_bytes = cost->resident_bytes;
    entry.build_peak_bytes = cost->build_peak_bytes;
    manifest.levels.push_back(entry);
    manifest.bounds.extend(level.header.bounds);
  }
  const auto written = write_manifest(folder, manifest);
  if (!written) ADD_FAILURE() << written.error().message;
  FARFIELD_CHECK(written.has_value());
}

void set_diffuse(LevelData& level, const vec3& albedo) {
  level.face_diffuse.assign(face_count(level), pack_color(albedo));
  level.voxel_diffuse.assign(voxel_count(level), pack_color(albedo));
}

std::vector<LevelData> white_sphere(uint32_t rings) {
  const float r0 = 0.02f;
  const auto ball = [](const ivec3& dims, float voxel) {
    return [=](int x, int y, int z) {
      const vec3 p = (vec3(x, y, z) + 0.5f - 0.5f * vec3(dims * kBrickSide)) * voxel;
      return glm::length(p) < 1.0f ? 10.0f : 0.0f;
    };
  };
  std::vector<LevelData> levels;
  levels.push_back(sphere_level(vec3(0.0f), 1.0f, rings, 0, r0));
  levels.push_back(sphere_level(vec3(0.0f), 1.0f, std::max(rings / 2, 8u), 1, 2 * r0));
  levels.push_back(sphere_level(vec3(0.0f), 0.9f, std::max(rings / 4, 8u), 2, 4 * r0));
  const float voxel2 = 4 * r0;
  set_volume(levels.back(), ivec3(4), vec3(-16 * voxel2),
             [&](int x, int y, int z) { return ball(ivec3(4), voxel2)(x, y, z) > 0.0f ? 0.5f : 0.0f; });
  for (const uint32_t k : {3u, 5u}) {
    LevelData level = empty_level(k, std::ldexp(r0, static_cast<int>(k)));
    const ivec3 dims(k == 3 ? 2 : 1);
    const float voxel = level.header.resolution;
    set_volume(level, dims, vec3(dims * kBrickSide) * (-0.5f * voxel), ball(dims, voxel),
               [](int, int, int) { return SymMat3::identity(); });
    levels.push_back(std::move(level));
  }
  for (LevelData& level : levels) set_diffuse(level, vec3(1.0f));
  return levels;
}

Host::Host(RuntimeOptions options) : device_(rtcNewDevice("")) {
  options.messages = [this](Severity, const std::string& message) { messages.push_back(message); };
  auto runtime = Runtime::create(device_, options);
  if (!runtime) ADD_FAILURE() << runtime.error().message;
  FARFIELD_CHECK(runtime.has_value());
  runtime_ = std::move(*runtime);
}

Host::~Host() {
  if (scene_) rtcReleaseScene(scene_);
  runtime_.reset();
  rtcReleaseDevice(device_);
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
  if (!scene_) scene_ = rtcNewScene(device_);
  const auto attached = runtime_->attach(scene_);
  if (!attached) ADD_FAILURE() << attached.error().message;
  rtcCommitScene(scene_);
}

bool Host::trace(const vec3& origin, const vec3& direction, RayContext& context, RTCRayHit& ray_hit) const {
  ray_hit = {};
  ray_hit.ray.org_x = origin.x, ray_hit.ray.org_y = origin.y, ray_hit.ray.org_z = origin.z;
  ray_hit.ray.dir_x = direction.x, ray_hit.ray.dir_y = direction.y, ray_hit.ray.dir_z = direction.z;
  ray_hit.ray.tfar = std::numeric_limits<float>::infinity();
  ray_hit.ray.mask = 0xffffffffu;
  ray_hit.hit.geomID = ray_hit.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
  rtcIntersect1(scene_, &context.embree, &ray_hit);
  return ray_hit.hit.geomID == runtime_->geometry_id();
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
      RTCRayHit hit;
      if (!host.trace(1.2f * random_unit(rng) - 10.0f * direction, direction, context, hit)) continue;
      uint32_t t_bits;
      std::memcpy(&t_bits, &hit.ray.tfar, sizeof t_bits);
      hashes[i] = mix64(mix64(context.hit.instance, context.hit.element), mix64(context.hit.level_slot, t_bits));
    }
  });
  return hash_values(std::span<const uint64_t>(hashes));
}

}  // namespace farfield::testing
