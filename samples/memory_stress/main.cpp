// SPDX-License-Identifier: Apache-2.0
// A forest that does not fit into memory, rendered inside budgets of 50, 25, 10, 5, 2 and 1 % of what full detail
// takes: instances of all assets of a folder on a plain, and a camera that pulls back from one of them until the forest
// is a texture. Read minimal_host first. New here: many assets and instances, and what a small budget does.
//
//   memory_stress ASSETS [INSTANCES [BUDGET_MIB [FOLDER]]]      ASSETS: NAME.farfield, or a folder of such
//
// For each budget (or the one given): what was accounted at the most, by how much the process has grown, how many
// levels coarser than asked it is on average. Last comes the smallest budget that there is. With FOLDER the pictures go
// there. It tries the promises, too; the first breach ends it with a line that names it, and exit code 1. What is
// accounted never exceeds the budget. A frame's pictures are the same: cold and warm, by one thread or by many, on the
// first visit and on a later one. In progressive mode a picture that needed no fallback is that of wait mode, and such
// a picture comes.
#include <farfield/embree.h>
#include <farfield/runtime.h>
#include <malloc.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <memory>
#include <vector>

#include "../common/host.h"

using glm::vec3;

namespace {

constexpr const char* kUsage = "usage: memory_stress ASSETS [INSTANCES [BUDGET_MIB [FOLDER]]]";
constexpr int kWidth = 96, kHeight = 54, kSamples = 4, kMaxDepth = 8;
constexpr float kFieldOfView = 0.6f;  // vertical, rad
constexpr float kCrowding = 2.0f;     // sizes of things per distance between them
constexpr size_t kFrames = 6;
constexpr int kPatience = 2000;  // pictures until the loader has to have brought all that a frame needs
constexpr double kShares[] = {0.5, 0.25, 0.1, 0.05, 0.02, 0.01};

using Picture = std::vector<vec3>;

double mib(uint64_t bytes) { return static_cast<double>(bytes) / (1 << 20); }

struct Arguments {
  std::vector<std::string> assets;
  size_t instances = 400;
  uint64_t budget_bytes = 0;  ///< 0: each of kShares
  std::string folder;         ///< of pictures; empty: none
};

/// What is no folder of assets is taken for an asset.
std::vector<std::string> assets_at(const std::string& path) {
  std::vector<std::string> assets;
  std::error_code none;
  for (const auto& entry : std::filesystem::directory_iterator(path, none))
    if (entry.path().extension() == ".farfield") assets.push_back(entry.path().string());
  std::sort(assets.begin(), assets.end());
  return assets.empty() ? std::vector<std::string>{path} : assets;
}

Arguments parse(int argc, char** argv) {
  if (argc < 2 || argc > 5) host::fail(kUsage);
  Arguments arguments;
  arguments.assets = assets_at(argv[1]);
  if (argc > 2) arguments.instances = host::parse_count(argv[2], 100'000'000, kUsage);
  if (argc > 3) arguments.budget_bytes = uint64_t{host::parse_count(argv[3], host::kMaxMib, kUsage)} << 20;
  if (argc > 4) arguments.folder = argv[4];
  return arguments;
}

/// A host with the forest. Instances and cameras are the same in each.
struct Forest {
  RTCDevice device = rtcNewDevice("");
  RTCScene scene = rtcNewScene(device);
  std::unique_ptr<farfield::Runtime> runtime;
  std::vector<host::Camera> cameras;  ///< of the frames

  Forest(const Arguments& arguments, farfield::RuntimeOptions options) {
    options.messages = host::messages_to_stderr();
    // Many instances and little memory: the scene is built small, and the budget is told so.
    rtcSetSceneBuildQuality(scene, RTC_BUILD_QUALITY_LOW);
    options.scene_bytes_per_instance = farfield::kSmallSceneBytesPerInstance;
    runtime = host::or_fail(farfield::Runtime::create(device, options));
    for (const std::string& folder : arguments.assets) open(folder);
    scatter(arguments.instances);
    host::or_fail(runtime->attach(scene));
    rtcCommitScene(scene);
  }
  ~Forest() {
    runtime.reset();
    rtcReleaseScene(scene);
    rtcReleaseDevice(device);
  }
  Forest(const Forest&) = delete;
  Forest& operator=(const Forest&) = delete;

 private:
  struct Kind {
    farfield::AssetId asset;
    host::Box bounds;
    float up_to;  ///< where its part of all instances ends, in [0, sum of parts]
  };

  /// Small things are many: each kind covers about the same ground.
  void open(const std::string& folder) {
    Kind kind{host::or_fail(runtime->open_asset(folder)), {}, kinds_.empty() ? 0.0f : kinds_.back().up_to};
    runtime->bounds(kind.asset, kind.bounds.lower, kind.bounds.upper);
    const float size = kind.bounds.longest_side();
    kind.up_to += 1.0f / (size * size);
    kinds_.push_back(kind);
  }

  /// On a square as large as the instances need, of any size between a half and the whole, and the cameras above it.
  void scatter(size_t count) {
    const float sum = kinds_.back().up_to;
    const float side = std::sqrt(static_cast<float>(count) * static_cast<float>(kinds_.size()) / sum) / kCrowding;
    farfield::Rng rng(1);
    for (size_t i = 0; i < count; ++i) {
      const float which = sum * rng.next(), scale = 0.5f + 0.5f * rng.next(), x = rng.next(), z = rng.next();
      const Kind& kind =
          *std::find_if(kinds_.begin(), kinds_.end() - 1, [&](const Kind& k) { return which < k.up_to; });
      glm::mat4x3 local_to_world(scale);
      local_to_world[3] = side * vec3(x - 0.5f, 0.0f, z - 0.5f) - scale * vec3(0.0f, kind.bounds.lower.y, 0.0f);
      host::or_fail(runtime->add_instance(kind.asset, local_to_world));
    }
    host::add_ground(device, scene, vec3(0.0f), side);
    const float nearest = kCrowding * 0.5f * side / std::sqrt(static_cast<float>(count)), farthest = 1.5f * side;
    for (size_t i = 0; i < kFrames; ++i) {
      const float time = static_cast<float>(i) / (kFrames - 1);
      const vec3 towards_camera = glm::normalize(vec3(0.3f, 0.3f, 1.0f));
      cameras.push_back(
          {nearest * std::pow(farthest / nearest, time) * towards_camera, vec3(0.0f), kFieldOfView, kWidth, kHeight});
    }
  }

  std::vector<Kind> kinds_;
};

farfield::Result<farfield::PlanSummary> plan(Forest& forest, size_t frame) {
  forest.runtime->set_cameras({forest.cameras[frame].tessellation()});
  return forest.runtime->plan_frame();
}

/// The light that comes along one path: an even sky's, and what glows.
vec3 light_along_path(const Forest& forest, const host::Camera& camera, int x, int y, farfield::Rng& rng) {
  vec3 origin = camera.eye, direction = camera.direction(static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f);
  vec3 throughput(1.0f), light(0.0f);
  farfield::RayContext context;
  context.path_seed = rng.next_uint();
  context.cone_spread = camera.pixel_spread();
  for (int depth = 0; depth < kMaxDepth; ++depth) {
    RTCRayHit ray = host::make_ray(origin, direction);
    context.ray_seed = rng.next_uint();
    rtcIntersect1(forest.scene, &context.embree, &ray);
    if (ray.hit.geomID == RTC_INVALID_GEOMETRY_ID) return light + throughput;
    if (ray.hit.geomID == forest.runtime->geometry_id()) {
      const farfield::Interaction interaction = forest.runtime->interaction(ray, context);
      light += throughput * interaction.emission;
      const farfield::ScatterSample sample = interaction.sample(rng);
      throughput *= sample.weight;
      interaction.spawn(sample, ray.ray.tfar, context);
      origin = interaction.ray_origin(sample.wi);
      direction = sample.wi;
    } else {  // the ground: Lambert's law
      context.origin_instance = farfield::kNoInstance;
      throughput *= host::kGroundAlbedo;
      context.cone_width += context.cone_spread * ray.ray.tfar;
      context.cone_spread += 0.25f;
      origin = host::above_ground(ray);
      direction = host::cosine_direction_up(rng);
    }
  }
  return light;
}

Picture render(const Forest& forest, size_t frame, unsigned threads) {
  Picture picture(static_cast<size_t>(kWidth) * kHeight, vec3(0.0f));
  host::for_each_row(kHeight, threads, [&](int y) {
    for (int x = 0; x < kWidth; ++x) {
      const size_t pixel = static_cast<size_t>(y) * kWidth + static_cast<size_t>(x);
      farfield::Rng rng(pixel);
      for (int sample = 0; sample < kSamples; ++sample)
        picture[pixel] += light_along_path(forest, forest.cameras[frame], x, y, rng) / static_cast<float>(kSamples);
    }
  });
  return picture;
}

[[noreturn]] void fail_at(const char* mode, size_t frame, const std::string& what) {
  host::fail("memory_stress FAILED in " + std::string(mode) + " mode, frame " + std::to_string(frame) + ": " + what);
}

void check_memory(const Forest& forest, uint64_t budget_bytes, const char* mode, size_t frame) {
  const farfield::Stats stats = forest.runtime->stats();
  const uint64_t most = std::max(stats.accounted_bytes, stats.peak_accounted_bytes);
  if (most <= budget_bytes) return;
  fail_at(mode, frame, std::to_string(most) + " bytes accounted, the budget has " + std::to_string(budget_bytes));
}

/// The whole shot, there and back again. Returns its pictures. `coarser`: by how many levels than asked, on average.
std::vector<Picture> shoot(Forest& forest, uint64_t budget_bytes, unsigned threads, double& coarser) {
  std::vector<Picture> pictures(kFrames);
  for (size_t visit = 0; visit < 2 * kFrames; ++visit) {
    const bool is_first = visit < kFrames;
    const size_t frame = is_first ? visit : 2 * kFrames - 1 - visit;
    coarser += host::or_fail(plan(forest, frame)).bias / (2 * kFrames);
    // On the way there only: the pictures of the way back show that it changes none.
    if (is_first && frame + 1 < kFrames) forest.runtime->look_ahead({forest.cameras[frame + 1].tessellation()});
    const Picture picture = render(forest, frame, is_first ? threads : 1);
    check_memory(forest, budget_bytes, "wait", frame);
    if (!is_first && picture != pictures[frame]) fail_at("wait", frame, "not the picture of the first visit");
    pictures[frame] = picture;
  }
  return pictures;
}

/// Frames are left while levels are still being loaded, and waited for on the second visit.
void shoot_progressively(Forest& forest, uint64_t budget_bytes, unsigned threads,
                         const std::vector<Picture>& expected) {
  const char* mode = "progressive";
  for (size_t visit = 0; visit < 2 * kFrames; ++visit) {
    const size_t frame = visit % kFrames;
    host::or_fail(plan(forest, frame));
    forest.runtime->prefetch();
    bool is_settled = false;
    for (int attempt = 0; attempt < kPatience && !is_settled; ++attempt) {
      const uint64_t before = forest.runtime->stats().fallbacks;
      const Picture picture = render(forest, frame, threads);
      check_memory(forest, budget_bytes, mode, frame);
      is_settled = forest.runtime->stats().fallbacks == before;
      if (is_settled && picture != expected[frame]) fail_at(mode, frame, "not the picture of wait mode");
      if (visit < kFrames) break;
    }
    if (!is_settled && visit >= kFrames) fail_at(mode, frame, "its levels do not come");
  }
}

/// Of this process, as `ps` says it.
uint64_t resident_bytes() {
  malloc_trim(0);
  uint64_t pages = 0, resident = 0;
  std::ifstream("/proc/self/statm") >> pages >> resident;
  return resident * static_cast<uint64_t>(sysconf(_SC_PAGESIZE));
}

void write_pictures(const std::string& folder, uint64_t budget_bytes, const std::vector<Picture>& pictures) {
  std::filesystem::create_directories(folder);
  for (size_t frame = 0; frame < kFrames; ++frame) {
    char name[64];
    std::snprintf(name, sizeof name, "/budget_%.2f_frame_%zu.ppm", mib(budget_bytes), frame);
    host::write_ppm(folder + name, kWidth, kHeight, pictures[frame]);
  }
}

/// What all takes if every instance shows its root (lambda 100) or its source (lambda 0). Loads roots alone.
uint64_t bytes_at(const Arguments& arguments, float lambda) {
  farfield::RuntimeOptions options;
  options.budget_bytes = ~uint64_t{0} >> 1;
  options.forced_lambda = lambda;
  Forest forest(arguments, options);
  return host::or_fail(plan(forest, 0)).planned_bytes;
}

/// Prints the line of a budget.
void stress(const Arguments& arguments, uint64_t budget_bytes) {
  const unsigned threads = std::max(4u, host::processor_count());  // more than one even on a small machine
  farfield::RuntimeOptions options;
  options.budget_bytes = budget_bytes;
  const uint64_t before = resident_bytes();
  double coarser = 0;
  std::vector<Picture> pictures;
  {
    Forest forest(arguments, options);
    pictures = shoot(forest, budget_bytes, threads, coarser);
    const farfield::Stats stats = forest.runtime->stats();
    std::printf("  wait: %.2f MiB at the most, grown by %.2f, %.2f levels coarser than asked, %llu released\n",
                mib(stats.peak_accounted_bytes), mib(resident_bytes()) - mib(before), coarser,
                static_cast<unsigned long long>(stats.levels_released));
    std::fflush(stdout);
  }
  options.residency = farfield::Residency::Progressive;
  Forest forest(arguments, options);
  shoot_progressively(forest, budget_bytes, threads, pictures);
  const farfield::Stats stats = forest.runtime->stats();
  std::printf("  progressive: %.2f MiB at the most, %llu fallbacks, %llu released\n", mib(stats.peak_accounted_bytes),
              static_cast<unsigned long long>(stats.fallbacks), static_cast<unsigned long long>(stats.levels_released));
  if (!arguments.folder.empty()) write_pictures(arguments.folder, budget_bytes, pictures);
}

}  // namespace

int main(int argc, char** argv) {
  const Arguments arguments = parse(argc, argv);
  const uint64_t full = bytes_at(arguments, 0.0f), least = bytes_at(arguments, 100.0f);
  std::printf("%zu instances of %zu assets: full detail %.2f MiB, at the least %.2f MiB\n", arguments.instances,
              arguments.assets.size(), mib(full), mib(least));
  std::vector<uint64_t> budgets = {arguments.budget_bytes};
  if (arguments.budget_bytes == 0) {
    budgets.clear();
    for (const double share : kShares) budgets.push_back(static_cast<uint64_t>(share * static_cast<double>(full)));
    budgets.push_back(least);
  }
  for (const uint64_t budget_bytes : budgets) {
    std::printf("%.2f MiB, %.1f %% of full detail%s\n", mib(budget_bytes),
                100.0 * static_cast<double>(budget_bytes) / static_cast<double>(full),
                budget_bytes < least ? ": less than instances and roots take" : "");
    if (budget_bytes >= least) stress(arguments, budget_bytes);
  }
  std::printf("memory_stress passed: budgets were kept and equal frames had equal pictures\n");
}
