// SPDX-License-Identifier: Apache-2.0
// The budget is what `ps` says: a program of its own, because other tests would have touched what this one measures.
#include <gtest/gtest.h>
#include <malloc.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fstream>
#include <iostream>
#include <string>
#include <thread>

#include "base/bytes.h"
#include "base/parallel.h"
#include "tests/support/files.h"
#include "tests/support/level_builder.h"
#include "tests/support/runtime_host.h"

namespace farfield {
namespace {

using test::Host;
using test::TemporaryFolder;

uint64_t status_bytes(const std::string& field) {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);) {
    if (line.rfind(field + ":", 0) == 0) return std::stoull(line.substr(field.size() + 1)) << 10;
  }
  return 0;
}

/// Starts a new peak, and returns what is resident now.
uint64_t reset_peak() {
  malloc_trim(0);
  std::ofstream("/proc/self/clear_refs") << "5";
  return status_bytes("VmRSS");
}

/// What is done there leaves no holes in this process's heap, which would hide growth. Before any thread is started.
template <typename Work>
void in_a_child_process(const Work& work) {
  const pid_t child = fork();
  if (child == 0) {
    work();
    _exit(::testing::Test::HasFailure() ? 1 : 0);
  }
  int status = -1;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  ASSERT_EQ(status, 0);
}

/// Foliage that gets four times lighter per level, and a root of voxels.
std::vector<LevelData> foliage(uint32_t leaves, uint64_t seed) {
  std::vector<LevelData> levels;
  for (uint32_t k = 0; k < 5; ++k) {
    LevelData level = test::triangle_soup(leaves >> (2 * k), 0.02f * static_cast<float>(1u << k), seed + k);
    level.header.level = k;
    level.header.resolution = 0.005f * static_cast<float>(1u << k);
    if (k > 0) level.morph_vertex.assign(levels.back().positions.size(), 0);
    if (k > 1) {
      const int bricks = 64 >> k;
      test::set_volume(level, ivec3(bricks / 2), vec3(-0.3f),
                       [&](int x, int y, int z) { return (x * 7 + y * 3 + z) % 3 == 0 ? 2.0f : 0.0f; });
    }
    test::set_diffuse(level, vec3(0.5f));
    levels.push_back(std::move(level));
  }
  return levels;
}

/// Camera paths of a few bounces over the whole stand, on all threads.
void render(const Host& host, float distance) {
  parallel_for(20000, 64, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) {
      Rng rng(i);
      const vec3 eye(0.5f, 0.5f, -distance);
      vec3 origin = eye;
      vec3 direction = glm::normalize(vec3(20.0f * rng.next() - 10.0f, rng.next(), 20.0f * rng.next()) - eye);
      RayContext context;
      context.path_seed = rng.next_uint();
      context.cone_spread = 1e-3f;
      for (int bounce = 0; bounce < 4; ++bounce) {
        context.ray_seed = rng.next_uint();
        EmbreeRayHit hit;
        if (!host.trace(origin, direction, context, hit)) break;
        const Interaction interaction = host.interaction(hit, context);
        const ScatterSample sample = interaction.sample(rng);
        if (sample.pdf <= 0.0f) break;
        interaction.spawn(sample, hit.ray.tfar, context);
        origin = interaction.ray_origin(sample.wi);
        direction = sample.wi;
      }
    }
  });
}

std::vector<mat4x3> stand(int count) {
  std::vector<mat4x3> places;
  for (int i = 0; i < count; ++i) {
    mat4x3 m(1.0f);
    m[3] = vec3(static_cast<float>(i % 23) - 11.0f, 0.0f, static_cast<float>(i / 23));
    places.push_back(m);
  }
  return places;
}

TEST(Memory, TheProcessGrowsByNoMoreThanTheBudgetAndFivePercent) {
  const TemporaryFolder folder;
  in_a_child_process([&] {
    for (int i = 0; i < 3; ++i) {
      test::write_asset(folder.path() / std::to_string(i), foliage(60000, static_cast<uint64_t>(10 * i)));
    }
    test::write_asset(folder.path() / "warm_up", foliage(3000, 99));
  });
  {  // code, stacks and thread-local memory are not the assets': touch them before the measurement
    Host host;
    host.add(folder.path() / "warm_up", stand(50));
    host.plan(vec3(0.5f, 0.5f, -5), 1e-3f);
    render(host, 5);
  }
  for (const uint64_t budget : {uint64_t{3} << 20, uint64_t{4} << 20, uint64_t{8} << 20, uint64_t{20} << 20}) {
    const uint64_t baseline = reset_peak();
    std::string report;
    {
      RuntimeOptions options;
      options.budget_bytes = budget;
      Host host(options);
      for (int i = 0; i < 3; ++i) host.add(folder.path() / std::to_string(i), stand(170));
      for (const float distance : {1.0f, 3.0f, 10.0f, 40.0f, 200.0f, 2.0f}) {
        const PlanSummary plan = host.plan(vec3(0.5f, 0.5f, -distance), 1e-3f);
        render(host, distance);
        const Stats stats = host.runtime().stats();
        report += "  at " + std::to_string(distance) + ": finest " + std::to_string(plan.finest_level[0]) +
                  ", planned " + format_bytes(plan.planned_bytes) + ", accounted " +
                  format_bytes(stats.accounted_bytes) + ", grown " +
                  format_bytes(status_bytes("VmRSS") - std::min(baseline, status_bytes("VmRSS"))) + "\n";
        EXPECT_LE(stats.peak_accounted_bytes, budget);
        EXPECT_TRUE(host.messages.empty()) << host.messages[0];
      }
    }
    const uint64_t grown = status_bytes("VmHWM") - baseline;
    EXPECT_LE(grown, budget + budget / 20)
        << "budget " << format_bytes(budget) << ", grown at most " << format_bytes(grown) << "\n"
        << report;
    RecordProperty("grown_of_" + std::to_string(budget), std::to_string(grown));
    if (std::getenv("FARFIELD_VERBOSE"))
      std::cout << format_bytes(budget) << " grown " << format_bytes(grown) << "\n" << report;
  }
}

}  // namespace
}  // namespace farfield
