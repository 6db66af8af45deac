// SPDX-License-Identifier: Apache-2.0
// What does an instance take, how long do a plan and the host's commit, with a million of them and more, and what do
// the flags of the host's scene and motion blur change? For docs/results/scale.md. Rays look down at the field from
// anywhere above it; each instance shows its root.
//
//   build/release/bin/instance_figures ASSET.farfield [COUNT...]     without counts: 100000 and 1000000
#include <farfield/random.h>
#include <farfield/runtime.h>
#include <fmt/format.h>
#include <malloc.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cmath>
#include <cstdlib>
#include <vector>

#include "base/embree.h"
#include "base/process_memory.h"
#include "base/process_time.h"
#include "base/result.h"

namespace farfield {
namespace {

/// Wall and CPU seconds since it was made. CPU of all threads.
class Stopwatch {
 public:
  double wall() const { return std::chrono::duration<double>(std::chrono::steady_clock::now() - wall_).count(); }
  double cpu() const { return process_cpu_seconds() - cpu_; }

 private:
  std::chrono::steady_clock::time_point wall_ = std::chrono::steady_clock::now();
  double cpu_ = process_cpu_seconds();
};

/// Anywhere on a square field, turned and of any size between 0.8 and 1.25; neighbours touch.
glm::mat4x3 place(Rng& rng, float side) {
  const float x = rng.next() - 0.5f, z = rng.next() - 0.5f, turn = 6.2831853f * rng.next();
  const float size = 0.8f + 0.45f * rng.next(), c = size * std::cos(turn), s = size * std::sin(turn);
  return {{c, 0, s}, {0, size, 0}, {-s, 0, c}, {side * x, 0, side * z}};
}

/// How a host may build its scene.
struct HostScene {
  const char* name;
  SceneBuild build;
  uint32_t bytes_per_instance = kSceneBytesPerInstance;
  enum class Moving { None, One, All } moving = Moving::None;  ///< while the shutter is open
};
constexpr HostScene kHostScenes[] = {
    {"default", SceneBuild::Default},
    {"compact", SceneBuild::Compact},
    {"low quality", SceneBuild::Small, kSmallSceneBytesPerInstance},
    {"high quality", SceneBuild::HighQuality},
    {"default, one moves", SceneBuild::Default, kSceneBytesPerInstance, HostScene::Moving::One},
    {"default, all move", SceneBuild::Default, kSceneBytesPerInstance, HostScene::Moving::All},
    {"low quality, one moves", SceneBuild::Small, kSmallSceneBytesPerInstance, HostScene::Moving::One}};

/// Nanoseconds of a ray from anywhere above a square field, steeply or along it.
double ray_nanoseconds(EmbreeSceneRef scene, float side, float height) {
  constexpr int kRays = 200'000;
  Rng rng(1);
  const Stopwatch watch;
  for (int i = 0; i < kRays; ++i) {
    const float x = rng.next() - 0.5f, z = rng.next() - 0.5f, turn = 6.2831853f * rng.next(), down = rng.next();
    RayContext context;
    context.path_seed = rng.next_uint();
    context.ray_seed = rng.next_uint();
    EmbreeRayHit ray = make_ray_hit(side * vec3(x, 0.0f, z) + vec3(0.0f, 1.5f * height, 0.0f),
                                    glm::normalize(vec3(std::cos(turn), -0.02f - down * down, std::sin(turn))));
    ray.ray.time = rng.next();
    trace_nearest(scene, context.embree, ray);
  }
  return 1e9 * watch.cpu() / kRays;
}

/// Prints a row. In a process of its own: what one measurement leaves in the heap is not the next one's.
Result<void> measure(const char* folder, size_t count, const HostScene& kind) {
  FARFIELD_TRY_LET(const auto device, make_embree_device());
  const EmbreeScene scene = new_scene(device.get());
  set_build(scene.get(), kind.build);
  RuntimeOptions options;
  options.budget_bytes = uint64_t{64} << 30;
  options.forced_lambda = 100.0f;  // the root
  options.scene_bytes_per_instance = kind.bytes_per_instance;
  FARFIELD_TRY_LET(auto runtime, Runtime::create(device.get(), options));
  FARFIELD_TRY_LET(const auto asset, runtime->open_asset(folder));
  glm::vec3 lower, upper;
  runtime->bounds(asset, lower, upper);
  const float side = std::max(upper.x - lower.x, upper.z - lower.z) * std::sqrt(static_cast<float>(count));

  malloc_trim(0);
  const uint64_t rss_before = resident_set_bytes(), accounted_before = runtime->stats().accounted_bytes;
  const PeakMemory peak;
  const Stopwatch adding;
  Rng rng(2);
  for (uint32_t i = 0; i < count; ++i) {
    const glm::mat4x3 start = place(rng, side);
    FARFIELD_TRY(runtime->add_instance(asset, start));
    if (kind.moving == HostScene::Moving::None || (kind.moving == HostScene::Moving::One && i > 0)) continue;
    glm::mat4x3 end = start;
    end[3].x += 0.2f;
    FARFIELD_TRY(runtime->move_instance(InstanceId{i}, {start, end}));
  }
  const double add_seconds = adding.cpu();
  const Stopwatch planning;
  FARFIELD_TRY(runtime->plan_frame());
  const double plan_seconds = planning.cpu();
  const Stopwatch committing;
  FARFIELD_TRY(runtime->attach(scene.get()));
  commit_scene(scene.get());
  const double commit_seconds = committing.cpu(), commit_wall = committing.wall();
  malloc_trim(0);
  const auto each = [&](uint64_t after, uint64_t before) {
    return (static_cast<double>(after) - static_cast<double>(before)) / static_cast<double>(count);
  };
  fmt::print("| {} | {} | {:.0f} | {:.0f} | {:.0f} | {:.2f} | {:.2f} | {:.2f} | {:.2f} | {:.0f} |\n", count, kind.name,
             each(runtime->stats().accounted_bytes, accounted_before), each(resident_set_bytes(), rss_before),
             each(peak.peak_bytes(), rss_before), add_seconds, plan_seconds, commit_seconds, commit_wall,
             ray_nanoseconds(scene.get(), side, upper.y));
  std::fflush(stdout);
  return {};
}

int measure_in_child(const char* folder, size_t count, const HostScene& kind) {
  const pid_t child = fork();
  if (child == 0) {
    const auto done = measure(folder, count, kind);
    if (!done) fmt::print(stderr, "instance_figures: {}\n", done.error().message);
    _exit(done ? 0 : 1);
  }
  int status = 1;
  return child > 0 && waitpid(child, &status, 0) == child && status == 0 ? 0 : 1;
}

}  // namespace
}  // namespace farfield

int main(int argc, char** argv) {
  if (argc < 2) {
    fmt::print("usage: instance_figures ASSET.farfield [COUNT...]\n");
    return 2;
  }
  std::vector<size_t> counts;
  for (int i = 2; i < argc; ++i) counts.push_back(std::strtoull(argv[i], nullptr, 10));
  if (counts.empty()) counts = {100'000, 1'000'000};
  fmt::print(
      "| instances | host's scene | accounted bytes each | RSS bytes each | at the peak | add, CPU s | plan, CPU s | "
      "commit, CPU s | commit, s | ray, ns |\n|---|---|---|---|---|---|---|---|---|---|\n");
  std::fflush(stdout);
  for (const size_t count : counts)
    for (const farfield::HostScene& kind : farfield::kHostScenes)
      if (farfield::measure_in_child(argv[1], count, kind) != 0) return 1;
}
