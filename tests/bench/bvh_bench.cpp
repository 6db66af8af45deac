// SPDX-License-Identifier: Apache-2.0
// What does a ray cost through our user geometry, against Embree's own instances of the same tree? And what through
// the same tree as a 64^3 volume? Times are CPU time per ray; run with
//   --benchmark_repetitions=9 --benchmark_enable_random_interleaving --benchmark_report_aggregates_only
// and read the ratios of the medians. `hits` must agree between Native and Farfield (surface).
#include <benchmark/benchmark.h>

#include <cstdlib>
#include <limits>
#include <memory>

#include "bvh/instance_geometry.h"
#include "tests/support/level_builder.h"
#include "tests/support/random_unit.h"

namespace farfield {
namespace {

using test::random_unit;

constexpr uint32_t kLeaves = 100000;
constexpr int kRays = 1 << 14;

/// Leaves of two triangles each in clusters inside the unit ball.
LevelData tree() {
  Rng rng(1);
  std::vector<vec3> positions;
  std::vector<Quad> quads;
  vec3 cluster(0.0f);
  for (uint32_t i = 0; i < kLeaves; ++i) {
    if (i % 120 == 0) cluster = std::cbrt(rng.next()) * 0.9f * random_unit(rng);
    const vec3 center = cluster + 0.1f * std::cbrt(rng.next()) * random_unit(rng);
    const Frame frame(random_unit(rng));
    const vec3 a = 0.006f * frame.x, b = 0.006f * frame.y;
    const uint32_t v = 4 * i;
    positions.insert(positions.end(), {center - a - b, center + a - b, center + a + b, center - a + b});
    quads.push_back({v, v + 1, v + 2, v + 3});
  }
  LevelData level = test::empty_level(0, 2.0f / 64);
  test::set_quads(level, std::move(positions), quads);
  return level;
}

/// A volume of about the same mean density of leaf area.
LevelData crown() {
  LevelData level = test::empty_level(3, 2.0f / 64);
  const float area_per_volume = kLeaves * 0.012f * 0.012f / (4.0f / 3.0f * kPi);
  test::set_volume(
      level, ivec3(8), vec3(-1.0f),
      [=](int x, int y, int z) {
        const vec3 p = (vec3(x, y, z) + 0.5f) / 32.0f - 1.0f;
        Rng rng(static_cast<uint64_t>(x / 3 + 64 * (y / 3 + 64 * (z / 3))));
        return glm::length(p) < 1.0f && rng.next() < 0.35f ? area_per_volume / (2 * 0.35f) : 0.0f;
      },
      [](int, int, int) { return SymMat3::identity(); });
  return level;
}

/// A grid of instances, once native and once ours.
class Bench : public LevelSource {
 public:
  explicit Bench(int side) : device_(*BvhDevice::create()), host_(*make_embree_device()) {
    add(tree());
    add(crown());
    Rng rng(2);
    std::vector<mat4x3> places;
    for (int i = 0; i < side * side; ++i) {
      const float angle = 2.0f * kPi * rng.next();
      mat4x3 m(1.0f);
      m[0] = {std::cos(angle), 0, std::sin(angle)};
      m[2] = {-std::sin(angle), 0, std::cos(angle)};
      m[3] = vec3(1.8f * static_cast<float>(i % side), 0, 1.8f * static_cast<float>(i / side));
      places.push_back(m);
    }
    extent_ = 1.8f * static_cast<float>(side);
    native_ = make_native(places);
    surface_ = make_ours(*surface_geometry_, 0, places);
    volume_ = make_ours(*volume_geometry_, 1, places);
    make_rays();
  }

  const TracedLevel* serve(uint32_t asset, uint32_t slot) override {
    auto level = TracedLevel::build(*device_, view_of(*data_[asset]), slot);
    if (!level) std::abort();
    levels_.push_back(std::move(*level));
    assets_[asset]->loaded[slot].store(levels_.back().get());
    return levels_.back().get();
  }

  enum class Kind { Native, Surface, Volume };
  EmbreeSceneRef scene(Kind kind) const {
    return (kind == Kind::Native ? native_ : (kind == Kind::Surface ? surface_ : volume_)).get();
  }

  int64_t trace_all(Kind kind, bool occlusion) const {
    int64_t hits = 0;
    for (int i = 0; i < kRays; ++i) {
      RayContext context;
      context.ray_seed = static_cast<uint32_t>(i);
      if (occlusion) {
        EmbreeRay ray = rays_[static_cast<size_t>(i)].ray;
        hits += trace_occlusion(scene(kind), context.embree, ray);
      } else {
        EmbreeRayHit ray = rays_[static_cast<size_t>(i)];
        hits += trace_nearest(scene(kind), context.embree, ray);
      }
    }
    return hits;
  }

 private:
  void add(LevelData level) {
    data_.push_back(std::make_unique<LevelData>(std::move(level)));
    auto asset = std::make_unique<TracedAsset>();
    asset->bounds = padded_bounds(data_.back()->header.bounds);
    asset->base_resolution = 0.01f;
    asset->level_numbers = {static_cast<float>(data_.back()->header.level)};
    asset->usable_slots = {0};
    asset->loaded = std::make_unique<std::atomic<const TracedLevel*>[]>(1);
    surface_geometry_->assets.push_back(asset.get());
    volume_geometry_->assets.push_back(asset.get());
    assets_.push_back(std::move(asset));
  }

  EmbreeScene make_ours(InstanceGeometry& geometry, uint32_t asset, const std::vector<mat4x3>& places) {
    for (const mat4x3& m : places) {
      geometry.instances.push_back(*make_instance(asset, m));
      geometry.instances.back().footprint = {0.001f, 1.0f};
    }
    EmbreeScene scene = new_scene(host_.get());
    attach_geometry(scene.get(), geometry.create(host_.get()).get());
    commit_scene(scene.get());
    return scene;
  }

  EmbreeScene make_native(const std::vector<mat4x3>& places) {
    const LevelData& level = *data_[0];
    const EmbreeGeometry mesh = new_quads(host_.get());
    copy_array<vec3>(mesh.get(), level.positions);
    copy_array<Quad>(mesh.get(), level.quads);
    const EmbreeScene object = build_static_scene(host_.get(), mesh);
    EmbreeScene scene = new_scene(host_.get());
    for (const mat4x3& m : places) {
      attach_geometry(scene.get(), new_native_instance(host_.get(), object.get(), m).get());
    }
    commit_scene(scene.get());
    return scene;
  }

  /// Half from a camera above the border, in image order; half from random places in random directions.
  void make_rays() {
    Rng rng(3);
    const vec3 eye(0.5f * extent_, 4.0f, -6.0f);
    for (int i = 0; i < kRays; ++i) {
      vec3 origin = eye, direction;
      if (i < kRays / 2) {
        const float x = static_cast<float>(i % 128) / 128.0f - 0.5f, y = static_cast<float>(i / 128) / 64.0f - 0.5f;
        direction = glm::normalize(vec3(x, 0.6f * y - 0.35f, 1.0f));
      } else {
        origin = vec3(rng.next() * extent_, 2.0f * rng.next() - 1.0f, rng.next() * extent_);
        direction = random_unit(rng);
      }
      rays_.push_back(make_ray_hit(origin, direction));
    }
  }

  std::unique_ptr<BvhDevice> device_;
  EmbreeDevice host_;
  std::vector<std::unique_ptr<LevelData>> data_;
  std::vector<std::unique_ptr<TracedAsset>> assets_;
  std::vector<std::unique_ptr<TracedLevel>> levels_;
  std::unique_ptr<InstanceGeometry> surface_geometry_ = std::make_unique<InstanceGeometry>(*this);
  std::unique_ptr<InstanceGeometry> volume_geometry_ = std::make_unique<InstanceGeometry>(*this);
  EmbreeScene native_, surface_, volume_;
  std::vector<EmbreeRayHit> rays_;
  float extent_ = 0;
};

void rays(benchmark::State& state, Bench::Kind kind, bool occlusion) {
  static Bench one(1);
  static Bench many(30);
  const Bench& bench = state.range(0) == 1 ? one : many;
  int64_t hits = 0;
  for (auto _ : state) hits = bench.trace_all(kind, occlusion);
  state.counters["hits"] = static_cast<double>(hits) / kRays;
  state.counters["ns_per_ray"] =
      benchmark::Counter(1e-9 * kRays, benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}

#define FARFIELD_RAYS(name, kind, occlusion)                  \
  BENCHMARK_CAPTURE(rays, name, Bench::Kind::kind, occlusion) \
      ->Arg(1)                                                \
      ->Arg(900)                                              \
      ->Unit(benchmark::kMillisecond)                         \
      ->ArgName("instances")
FARFIELD_RAYS(intersect_native, Native, false);
FARFIELD_RAYS(intersect_farfield, Surface, false);
FARFIELD_RAYS(intersect_volume, Volume, false);
FARFIELD_RAYS(occluded_native, Native, true);
FARFIELD_RAYS(occluded_farfield, Surface, true);
FARFIELD_RAYS(occluded_volume, Volume, true);

}  // namespace
}  // namespace farfield

BENCHMARK_MAIN();
