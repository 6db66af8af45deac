// SPDX-License-Identifier: Apache-2.0
// What does an instance take, and how long do a plan and the host's commit, with a million of them and more? For
// docs/results/scale.md.
//
//   build/release/bin/instance_figures ASSET.farfield [COUNT...]     without counts: 100000 and 1000000
#include <farfield/embree.h>
#include <farfield/runtime.h>
#include <fmt/format.h>
#include <time.h>
#include <unistd.h>

#include <chrono>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <limits>
#include <vector>

namespace farfield {
namespace {

/// Wall and CPU seconds since it was made. CPU of all threads.
class Stopwatch {
 public:
  double wall() const { return std::chrono::duration<double>(std::chrono::steady_clock::now() - wall_).count(); }
  double cpu() const { return cpu_now() - cpu_; }

 private:
  static double cpu_now() {
    timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
  }

  std::chrono::steady_clock::time_point wall_ = std::chrono::steady_clock::now();
  double cpu_ = cpu_now();
};

uint64_t resident_bytes() {
  uint64_t pages = 0, resident = 0;
  std::ifstream("/proc/self/statm") >> pages >> resident;
  return resident * static_cast<uint64_t>(sysconf(_SC_PAGESIZE));
}

/// The i-th of `count` places, on a square lattice as wide apart as the asset is.
glm::mat4x3 place(size_t i, size_t count, float distance) {
  const auto side = static_cast<size_t>(std::ceil(std::sqrt(static_cast<double>(count))));
  const auto along = [&](size_t k) { return distance * (static_cast<float>(k) - 0.5f * static_cast<float>(side)); };
  glm::mat4x3 local_to_world(1.0f);
  local_to_world[3] = glm::vec3(along(i % side), 0.0f, along(i / side));
  return local_to_world;
}

Result<void> measure(RTCDevice device, const char* folder, size_t count) {
  RTCScene scene = rtcNewScene(device);
  RuntimeOptions options;
  options.budget_bytes = uint64_t{64} << 30;
  auto runtime = Runtime::create(device, options);
  if (!runtime) return tl::unexpected(runtime.error());
  const auto asset = (*runtime)->open_asset(folder);
  if (!asset) return tl::unexpected(asset.error());
  glm::vec3 lower, upper;
  (*runtime)->bounds(*asset, lower, upper);
  const float distance = std::max(upper.x - lower.x, upper.z - lower.z);

  const uint64_t rss_before = resident_bytes(), accounted_before = (*runtime)->stats().accounted_bytes;
  const Stopwatch adding;
  for (size_t i = 0; i < count; ++i) {
    const auto added = (*runtime)->add_instance(*asset, place(i, count, distance));
    if (!added) return tl::unexpected(added.error());
  }
  const double add_seconds = adding.cpu();
  (*runtime)->set_cameras({{glm::vec3(0.0f, upper.y, 0.0f), 0.0f, 0.001f}});
  const Stopwatch planning;
  const auto plan = (*runtime)->plan_frame();
  if (!plan) return tl::unexpected(plan.error());
  const double plan_seconds = planning.cpu();
  const Stopwatch committing;
  const auto geometry = (*runtime)->attach(scene);
  if (!geometry) return tl::unexpected(geometry.error());
  rtcCommitScene(scene);
  const auto each = [&](uint64_t after, uint64_t before) {
    return static_cast<double>(after - before) / static_cast<double>(count);
  };
  fmt::print("| {} | {:.0f} | {:.0f} | {:.2f} | {:.2f} | {:.2f} | {:.2f} |\n", count,
             each((*runtime)->stats().accounted_bytes, accounted_before), each(resident_bytes(), rss_before),
             add_seconds, plan_seconds, committing.cpu(), committing.wall());
  std::fflush(stdout);
  runtime->reset();
  rtcReleaseScene(scene);
  return {};
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
  RTCDevice device = rtcNewDevice("");
  fmt::print(
      "| instances | accounted bytes each | RSS bytes each | add, CPU s | plan, CPU s | commit, CPU s | commit, s |\n"
      "|---|---|---|---|---|---|---|\n");
  for (const size_t count : counts) {
    if (const auto done = farfield::measure(device, argv[1], count); !done) {
      fmt::print(stderr, "instance_figures: {}\n", done.error().message);
      return 1;
    }
  }
  rtcReleaseDevice(device);
}
