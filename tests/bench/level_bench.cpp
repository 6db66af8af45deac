// SPDX-License-Identifier: Apache-2.0
// Does a level pay? What a ray costs in each level of a baked asset, against Embree on the same device tracing level
// 0's quads (the source) natively, and against the next finer level; one instance, and a field of 100.
//   level_bench ASSET.farfield [ROUNDS]
// Speeds are ratios: medians over rounds of CPU time of the other / of the level, all variants in turn in each round,
// so that a busy machine slows all alike. Above 1: the level is faster. `hits` are the level's and the source's.
// Then what the bake counts (bvh/ray_cost.h) beside what one instance took, over all kinds of rays, and how well the
// two agree on the order of levels (Spearman's rank correlation).
#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <memory>

#include "bvh/instance_geometry.h"
#include "bvh/ray_cost.h"
#include "cache/level_file.h"
#include "cache/manifest.h"
#include "cache/placed_parts.h"
#include "scattering/warp.h"
#include "tests/support/random_unit.h"

namespace farfield {
namespace {

using test::random_unit;

constexpr int kRays = 1 << 13;

double cpu_seconds() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

double median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + static_cast<long>(values.size() / 2), values.end());
  return values[values.size() / 2];
}

template <typename T>
T need(Result<T> result) {
  if (result) return std::move(*result);
  fmt::print(stderr, "{}\n", result.error().message);
  std::exit(1);
}

struct RaySet {
  const char* name;
  bool occlusion;
  std::vector<EmbreeRayHit> rays;
};

/// A loaded level as an asset of its own.
class LevelAsset : public LevelSource {
 public:
  LevelAsset(BvhDevice& device, const std::filesystem::path& path, const std::vector<vec3>& hull)
      : file_(need(LevelFile::open(path, LevelCheck::Full))), level_(need(TracedLevel::build(device, view(), 0))) {
    asset_.bounds = padded_bounds(view().header.bounds);
    asset_.hull = hull;
    asset_.base_resolution = 1;
    asset_.level_numbers = {0.0f};
    asset_.usable_slots = {0};
    asset_.loaded = std::make_unique<std::atomic<const TracedLevel*>[]>(1);
    asset_.loaded[0].store(level_.get());
  }
  const LevelView& view() const { return file_->view(); }
  const TracedLevel* serve(uint32_t, uint32_t) override { return level_.get(); }

  EmbreeScene scene(EmbreeDeviceRef device, const std::vector<mat4x3>& places) {
    geometries_.push_back(std::make_unique<InstanceGeometry>(*this));
    InstanceGeometry& geometry = *geometries_.back();
    geometry.assets = {&asset_};
    for (const mat4x3& place : places) geometry.instances.push_back(need(make_instance(0, place)));
    EmbreeScene made = new_scene(device);
    attach_geometry(made.get(), geometry.create(device).get());
    commit_scene(made.get());
    return made;
  }

 private:
  std::unique_ptr<LevelFile> file_;
  std::unique_ptr<TracedLevel> level_;
  TracedAsset asset_;
  std::vector<std::unique_ptr<InstanceGeometry>> geometries_;
};

EmbreeScene native_scene(EmbreeDeviceRef device, const LevelView& stored, const std::vector<mat4x3>& places) {
  const LevelData level = flattened(stored);
  const EmbreeGeometry quads = new_quads(device);
  copy_array(quads.get(), std::span<const vec3>(level.positions));
  copy_array(quads.get(), std::span<const Quad>(level.quads));
  const EmbreeScene object = build_static_scene(device, quads);
  EmbreeScene scene = new_scene(device);
  for (const mat4x3& place : places) {
    attach_geometry(scene.get(), new_native_instance(device, object.get(), place).get());
  }
  commit_scene(scene.get());
  return scene;
}

/// side x side instances in random orientations about y, their crowns touching.
std::vector<mat4x3> field(const Box3& bounds, int side) {
  Rng rng(2);
  std::vector<mat4x3> places;
  const float spacing = 0.9f * std::max(bounds.size().x, bounds.size().z);
  for (int i = 0; i < side * side; ++i) {
    const float angle = side == 1 ? 0.0f : 2.0f * kPi * rng.next();
    mat4x3 m(1.0f);
    m[0] = {std::cos(angle), 0, std::sin(angle)};
    m[2] = {-std::sin(angle), 0, std::cos(angle)};
    m[3] = spacing * vec3(i % side, 0, i / side) - mat3(m) * bounds.center();
    places.push_back(m);
  }
  return places;
}

/// From a camera in image order, through random points in random directions, on from what they hit of the source, and
/// from there to a sun.
std::vector<RaySet> make_rays(EmbreeSceneRef source, const Box3& bounds, int side) {
  Rng rng(3);
  const float size = max_component(bounds.size()), extent = 0.9f * static_cast<float>(side - 1) * size;
  const vec3 middle(0.5f * extent, 0, 0.5f * extent);
  const vec3 eye = middle + vec3(0, 0.6f, -2) * (size + extent);
  std::vector<RaySet> sets = {
      {"camera", false, {}}, {"random", false, {}}, {"bounce", false, {}}, {"shadow", true, {}}};
  for (int i = 0; i < kRays; ++i) {
    const int width = 128, height = kRays / width;
    const vec2 at((static_cast<float>(i % width) + rng.next()) / width - 0.5f,
                  (static_cast<float>(i / width) + rng.next()) / static_cast<float>(height) - 0.5f);
    const vec3 target = middle + vec3(at.x, at.y * (side == 1 ? 1.0f : 0.3f), 0) * (size + extent);
    sets[0].rays.push_back(make_ray_hit(eye, glm::normalize(target - eye)));

    const vec3 through(rng.next() * extent, 0, rng.next() * extent);
    const vec3 direction = random_unit(rng);
    const vec3 aim = through + bounds.size() * (vec3(rng.next(), rng.next(), rng.next()) - 0.5f);
    sets[1].rays.push_back(make_ray_hit(aim - 2.0f * size * direction, direction));
  }
  for (size_t i = 0; sets[2].rays.size() < kRays; i = (i + 1) % kRays) {
    EmbreeRayHit seen = sets[i % 2].rays[i];
    RayContext context;
    if (!trace_nearest(source, context.embree, seen)) continue;
    const vec3 direction(seen.ray.dir_x, seen.ray.dir_y, seen.ray.dir_z);
    const vec3 at = vec3(seen.ray.org_x, seen.ray.org_y, seen.ray.org_z) + seen.ray.tfar * direction;
    const float offset = 1e-4f * size;
    const vec3 sun = glm::normalize(vec3(0.4f, 0.8f, -0.4f)), on = random_unit(rng);
    sets[2].rays.push_back(make_ray_hit(at, on, offset));
    sets[3].rays.push_back(make_ray_hit(at, sun, offset));
  }
  return sets;
}

int trace(EmbreeSceneRef scene, const RaySet& set) {
  int hits = 0;
  for (size_t i = 0; i < set.rays.size(); ++i) {
    RayContext context;
    context.ray_seed = static_cast<uint32_t>(i);
    if (set.occlusion) {
      EmbreeRay ray = set.rays[i].ray;
      hits += trace_occlusion(scene, context.embree, ray);
    } else {
      EmbreeRayHit ray = set.rays[i];
      hits += trace_nearest(scene, context.embree, ray);
    }
  }
  return hits;
}

/// scenes: the source, then the levels, finest first. The levels' times, nanoseconds per ray.
std::vector<double> measure(const RaySet& set, const std::vector<EmbreeScene>& scenes,
                            const std::vector<uint32_t>& numbers, int side, int rounds) {
  std::vector<std::vector<double>> seconds(scenes.size());
  std::vector<int> hits(scenes.size());
  for (int round = 0; round < rounds; ++round) {
    for (size_t i = 0; i < scenes.size(); ++i) {
      const double start = cpu_seconds();
      hits[i] = trace(scenes[i].get(), set);
      seconds[i].push_back(cpu_seconds() - start);
    }
  }
  const auto ratio = [&](size_t of, size_t level) {
    std::vector<double> ratios;
    for (size_t round = 0; round < seconds[level].size(); ++round) {
      ratios.push_back(seconds[of][round] / seconds[level][round]);
    }
    return median(ratios);
  };
  const auto hit_share = [&](size_t i) { return static_cast<double>(hits[i]) / kRays; };
  for (size_t i = 1; i < scenes.size(); ++i) {
    fmt::print("| {} | {} | {} | {:.0f} | {:.2f} | {:.2f} | {:.3f} / {:.3f} |\n", side * side, set.name, numbers[i - 1],
               1e9 * median(seconds[i]) / kRays, ratio(0, i), i > 1 ? ratio(i - 1, i) : ratio(0, i), hit_share(i),
               hit_share(0));
  }
  std::vector<double> nanoseconds;
  for (size_t i = 1; i < scenes.size(); ++i) nanoseconds.push_back(1e9 * median(seconds[i]) / kRays);
  return nanoseconds;
}

/// Position of each value in the sorted list.
std::vector<double> ranks_of(const std::vector<double>& values) {
  std::vector<double> ranks;
  for (const double value : values) {
    ranks.push_back(static_cast<double>(std::ranges::count_if(values, [&](double other) { return other < value; })));
  }
  return ranks;
}

/// Spearman's; of values without ties.
double rank_correlation(const std::vector<double>& a, const std::vector<double>& b) {
  const std::vector<double> ranks_a = ranks_of(a), ranks_b = ranks_of(b);
  double sum = 0;
  for (size_t i = 0; i < a.size(); ++i) sum += (ranks_a[i] - ranks_b[i]) * (ranks_a[i] - ranks_b[i]);
  const auto n = static_cast<double>(a.size());
  return n > 1 ? 1 - 6 * sum / (n * (n * n - 1)) : 1.0;
}

void compare_with_count(const std::vector<std::unique_ptr<LevelAsset>>& levels,
                        const std::vector<double>& nanoseconds) {
  fmt::print("\n| level | ns per ray | counted | boxes | quads | bricks | voxels | collisions |\n");
  fmt::print("|---|---|---|---|---|---|---|---|\n");
  std::vector<double> counted;
  for (size_t i = 0; i < levels.size(); ++i) {
    const RayWork work = count_ray_work(levels[i]->view());
    counted.push_back(ray_cost(work));
    fmt::print("| {} | {:.0f} | {:.0f} | {:.1f} | {:.1f} | {:.1f} | {:.1f} | {:.2f} |\n",
               levels[i]->view().header.level, nanoseconds[i], counted[i], work.boxes, work.quads, work.bricks,
               work.voxels, work.collisions);
  }
  fmt::print("Rank correlation: {:.2f}\n", rank_correlation(nanoseconds, counted));
}

int run(const std::filesystem::path& folder, int rounds) {
  std::vector<std::filesystem::path> paths;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (entry.path().extension() == ".ffl") paths.push_back(entry.path());
  }
  const auto device = need(BvhDevice::create());
  const EmbreeDevice host = need(make_embree_device());
  std::vector<std::unique_ptr<LevelAsset>> levels;
  const std::vector<vec3> hull = need(read_manifest(folder)).hull;
  for (const auto& path : paths) levels.push_back(std::make_unique<LevelAsset>(*device, path, hull));
  std::sort(levels.begin(), levels.end(),
            [](const auto& a, const auto& b) { return a->view().header.level < b->view().header.level; });
  if (levels.empty() || !levels[0]->view().has_surface() || levels[0]->view().header.level != 0) {
    fmt::print(stderr, "{}: no level 0 with a surface: give a folder that `farfield bake` wrote\n", folder.string());
    return 1;
  }
  std::vector<uint32_t> numbers;
  for (const auto& level : levels) numbers.push_back(level->view().header.level);

  fmt::print(
      "| instances | rays | level | ns per ray | speed / source | / finer | hits |\n|---|---|---|---|---|---|---|\n");
  const Box3 bounds = levels[0]->view().header.bounds;
  std::vector<double> of_one(levels.size(), 0.0);  // mean over kinds of rays
  for (const int side : {1, 10}) {
    const std::vector<mat4x3> places = field(bounds, side);
    std::vector<EmbreeScene> scenes;
    scenes.push_back(native_scene(host.get(), levels[0]->view(), places));
    for (const auto& level : levels) scenes.push_back(level->scene(host.get(), places));
    const std::vector<RaySet> sets = make_rays(scenes[0].get(), bounds, side);
    for (const RaySet& set : sets) {
      const std::vector<double> nanoseconds = measure(set, scenes, numbers, side, rounds);
      for (size_t i = 0; i < levels.size() && side == 1; ++i) {
        of_one[i] += nanoseconds[i] / static_cast<double>(sets.size());
      }
    }
  }
  compare_with_count(levels, of_one);
  return 0;
}

}  // namespace
}  // namespace farfield

int main(int argc, char** argv) {
  if (argc != 2 && argc != 3) {
    fmt::print(stderr, "Usage: level_bench ASSET.farfield [ROUNDS]\n");
    return 1;
  }
  const int rounds = argc == 3 ? std::max(1, std::atoi(argv[2])) : 9;
  return farfield::run(argv[1], rounds);
}
