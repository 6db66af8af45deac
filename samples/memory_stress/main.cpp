// SPDX-License-Identifier: Apache-2.0
// Tries the promise that a budget is never exceeded and that levels are a function of the plan, not of what happens to
// be in memory: many instances, cameras that jump about, a budget for a fraction of what they ask for, and rays of
// several threads that load levels as they meet them.
//
//   memory_stress ASSET.farfield [BUDGET_MIB]
//
// After every picture the accounted bytes and their peak must be within the budget. In wait mode a frame's pictures
// must be the same: cold and warm, by one thread or by many, on the first visit and on a later one. In progressive mode
// a picture that needed no fallback must be the one of wait mode, and such a picture must come. The first breach ends
// the program with a line that names it, and exit code 1. Without BUDGET_MIB the budget is a third of the way from what
// the roots take to what the cameras ask for.
#include <farfield/embree.h>
#include <farfield/runtime.h>

#include <cstdio>
#include <cstring>
#include <memory>
#include <optional>
#include <vector>

#include "../common/host.h"

using glm::vec3;

namespace {

constexpr const char* kUsage = "usage: memory_stress ASSET.farfield [BUDGET_MIB]";
constexpr int kWidth = 96, kHeight = 64;
constexpr float kFieldOfView = 0.7f;  // vertical, rad
constexpr int kInstances = 400;
constexpr size_t kFrames = 8, kVisits = 40;
constexpr size_t kCamerasPerFrame = 3;
constexpr int kPatience = 2000;  // pictures until the loader has to have brought all that a frame needs

/// A host with its scene. The instances and frames are the same in each.
struct Stage {
  RTCDevice device = rtcNewDevice("");
  RTCScene scene = rtcNewScene(device);
  std::unique_ptr<farfield::Runtime> runtime;
  std::vector<std::vector<host::Camera>> frames;  ///< the first camera of each takes the picture

  Stage(const char* asset_folder, uint64_t budget_bytes, farfield::Residency residency) {
    farfield::RuntimeOptions options;
    options.budget_bytes = budget_bytes;
    options.residency = residency;
    options.messages = host::messages_to_stderr();
    runtime = host::or_fail(farfield::Runtime::create(device, options));
    const farfield::AssetId asset = host::or_fail(runtime->open_asset(asset_folder));
    host::Box bounds;
    runtime->bounds(asset, bounds.lower, bounds.upper);
    add_instances(asset, bounds);
    place_cameras(bounds);
    host::or_fail(runtime->attach(scene));
    rtcCommitScene(scene);
  }
  ~Stage() {
    runtime.reset();
    rtcReleaseScene(scene);
    rtcReleaseDevice(device);
  }
  Stage(const Stage&) = delete;
  Stage& operator=(const Stage&) = delete;

 private:
  /// Anywhere in a cube, of any size between a half and the whole.
  void add_instances(farfield::AssetId asset, const host::Box& bounds) {
    farfield::Rng rng(1);
    for (int i = 0; i < kInstances; ++i) {
      const float scale = 0.5f + 0.5f * rng.next();
      const float x = rng.next(), y = rng.next(), z = rng.next();
      const vec3 place = 10.0f * bounds.longest_side() * (vec3(x, y, z) - 0.5f);
      glm::mat4x3 local_to_world(scale);
      local_to_world[3] = place - scale * bounds.center();
      host::or_fail(runtime->add_instance(asset, local_to_world));
    }
  }

  /// Each frame's distance from the middle is another one, from among the instances to far away.
  void place_cameras(const host::Box& bounds) {
    farfield::Rng rng(2);
    for (size_t i = 0; i < kFrames; ++i) {
      const float distance = bounds.longest_side() * std::exp2(static_cast<float>(i) + 1.0f);
      std::vector<host::Camera> cameras;
      for (size_t camera = 0; camera < kCamerasPerFrame; ++camera) {
        const float angle = 2.0f * host::kPi * rng.next();
        const vec3 from(std::cos(angle), rng.next() - 0.5f, std::sin(angle));
        cameras.push_back({distance * from, vec3(0.0f), kFieldOfView, kWidth, kHeight});
      }
      frames.push_back(cameras);
    }
  }
};

farfield::Result<farfield::PlanSummary> plan(Stage& stage, size_t frame) {
  std::vector<farfield::TessellationCamera> cameras;
  for (const host::Camera& camera : stage.frames[frame]) cameras.push_back(camera.tessellation());
  stage.runtime->set_cameras(std::move(cameras));
  return stage.runtime->plan_frame();
}

/// FNV-1a.
template <typename T>
void add_to_hash(uint64_t& hash, const T& value) {
  unsigned char bytes[sizeof(T)];
  std::memcpy(bytes, &value, sizeof(T));
  for (const unsigned char byte : bytes) hash = (hash ^ byte) * 0x100000001b3ull;
}

/// What one pixel's path meets: a camera ray and where it scatters to, each with its level and distance.
uint64_t hash_of_path(const Stage& stage, const host::Camera& camera, int x, int y) {
  uint64_t hash = 0xcbf29ce484222325ull;
  farfield::Rng rng(static_cast<uint64_t>(y) * kWidth + static_cast<uint64_t>(x));
  vec3 origin = camera.eye, direction = camera.direction(static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f);
  farfield::RayContext context;
  context.path_seed = rng.next_uint();
  context.cone_spread = camera.pixel_spread();
  for (int depth = 0; depth < 2; ++depth) {
    RTCRayHit ray = host::make_ray(origin, direction);
    context.ray_seed = rng.next_uint();
    rtcIntersect1(stage.scene, &context.embree, &ray);
    if (ray.hit.geomID != stage.runtime->geometry_id()) break;
    const farfield::Interaction interaction = stage.runtime->interaction(ray, context);
    const farfield::ScatterSample sample = interaction.sample(rng);
    add_to_hash(hash, interaction.instance);
    add_to_hash(hash, interaction.level);
    add_to_hash(hash, ray.ray.tfar);
    add_to_hash(hash, sample.weight);
    context.cone_width += context.cone_spread * ray.ray.tfar;
    context.cone_spread = interaction.next_cone_spread(sample, context.cone_spread);
    context.set_origin(context.hit);
    origin = interaction.ray_origin(sample.wi);
    direction = sample.wi;
  }
  return hash;
}

uint64_t hash_of_picture(const Stage& stage, size_t frame, unsigned threads) {
  std::vector<uint64_t> pixels(static_cast<size_t>(kWidth) * kHeight);
  host::for_each_row(kHeight, threads, [&](int y) {
    for (int x = 0; x < kWidth; ++x) {
      pixels[static_cast<size_t>(y) * kWidth + static_cast<size_t>(x)] =
          hash_of_path(stage, stage.frames[frame][0], x, y);
    }
  });
  uint64_t hash = 0;
  for (const uint64_t pixel : pixels) add_to_hash(hash, pixel);
  return hash;
}

[[noreturn]] void fail_at(const char* mode, size_t visit, size_t frame, const std::string& what) {
  host::fail("memory_stress FAILED in " + std::string(mode) + " mode, visit " + std::to_string(visit) + ", frame " +
             std::to_string(frame) + ": " + what);
}

void check_memory(const Stage& stage, uint64_t budget_bytes, const char* mode, size_t visit, size_t frame) {
  const farfield::Stats stats = stage.runtime->stats();
  const uint64_t most = std::max(stats.accounted_bytes, stats.peak_accounted_bytes);
  if (most <= budget_bytes) return;
  fail_at(mode, visit, frame,
          std::to_string(most) + " bytes accounted, the budget has " + std::to_string(budget_bytes));
}

/// The budget that makes it tight: a third of the way from the roots to all that the frames ask for.
uint64_t tight_budget(const char* asset_folder) {
  Stage stage(asset_folder, ~uint64_t{0} >> 1, farfield::Residency::Wait);
  uint64_t least = ~uint64_t{0}, most = 0;
  for (size_t frame = 0; frame < kFrames; ++frame) {
    const uint64_t bytes = host::or_fail(plan(stage, frame)).planned_bytes;
    least = std::min(least, bytes);
    most = std::max(most, bytes);
  }
  return least + (most - least) / 3;
}

/// The frames in the order in which they are visited: jumping, each several times.
std::vector<size_t> visits() {
  farfield::Rng rng(3);
  std::vector<size_t> frames;
  for (size_t i = 0; i < kVisits; ++i) frames.push_back(i < kFrames ? (5 * i) % kFrames : rng.next_uint() % kFrames);
  return frames;
}

void print_stats(const char* mode, const farfield::Stats& stats) {
  std::printf(
      "%-11s %zu visits, %llu levels loaded, %llu released, peak %.2f MiB, %llu fallbacks\n", mode, kVisits,
      static_cast<unsigned long long>(stats.levels_loaded), static_cast<unsigned long long>(stats.levels_released),
      static_cast<double>(stats.peak_accounted_bytes) / (1 << 20), static_cast<unsigned long long>(stats.fallbacks));
}

/// Returns each frame's hash.
std::vector<uint64_t> stress_waiting(const char* asset_folder, uint64_t budget_bytes, unsigned threads) {
  const char* mode = "wait";
  Stage stage(asset_folder, budget_bytes, farfield::Residency::Wait);
  std::vector<std::optional<uint64_t>> hashes(kFrames);
  const std::vector<size_t> order = visits();
  for (size_t visit = 0; visit < order.size(); ++visit) {
    const size_t frame = order[visit];
    host::or_fail(plan(stage, frame));
    const uint64_t cold = hash_of_picture(stage, frame, threads);
    check_memory(stage, budget_bytes, mode, visit, frame);
    const uint64_t warm = hash_of_picture(stage, frame, 1);
    check_memory(stage, budget_bytes, mode, visit, frame);
    if (cold != warm) fail_at(mode, visit, frame, "the cold and the warm picture differ");
    if (hashes[frame] && *hashes[frame] != cold) fail_at(mode, visit, frame, "not the picture of an earlier visit");
    hashes[frame] = cold;
  }
  print_stats(mode, stage.runtime->stats());
  std::vector<uint64_t> result;
  for (const std::optional<uint64_t>& hash : hashes) result.push_back(hash.value());
  return result;
}

void stress_progressive(const char* asset_folder, uint64_t budget_bytes, unsigned threads,
                        const std::vector<uint64_t>& expected) {
  const char* mode = "progressive";
  Stage stage(asset_folder, budget_bytes, farfield::Residency::Progressive);
  const std::vector<size_t> order = visits();
  for (size_t visit = 0; visit < order.size(); ++visit) {
    const size_t frame = order[visit];
    host::or_fail(plan(stage, frame));
    stage.runtime->prefetch();
    bool is_settled = false;
    for (int picture = 0; picture < kPatience && !is_settled; ++picture) {
      const uint64_t before = stage.runtime->stats().fallbacks;
      const uint64_t hash = hash_of_picture(stage, frame, threads);
      check_memory(stage, budget_bytes, mode, visit, frame);
      is_settled = stage.runtime->stats().fallbacks == before;
      if (is_settled && hash != expected[frame]) fail_at(mode, visit, frame, "not the picture of wait mode");
      if (visit % 2 == 1) break;  // jump away while levels are still being loaded
    }
    if (!is_settled && visit % 2 == 0) fail_at(mode, visit, frame, "its levels do not come");
  }
  print_stats(mode, stage.runtime->stats());
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2 || argc > 3) host::fail(kUsage);
  const uint64_t budget_bytes =
      argc > 2 ? uint64_t{host::parse_count(argv[2], host::kMaxMib, kUsage)} << 20 : tight_budget(argv[1]);
  const unsigned threads = std::max(4u, host::processor_count());  // more than one even on a small machine
  std::printf("%d instances, %zu frames, %u threads, a budget of %.2f MiB\n", kInstances, kFrames, threads,
              static_cast<double>(budget_bytes) / (1 << 20));
  const std::vector<uint64_t> hashes = stress_waiting(argv[1], budget_bytes, threads);
  stress_progressive(argv[1], budget_bytes, threads, hashes);
  std::printf("memory_stress passed: the budget was kept and equal frames had equal pictures\n");
}
