// SPDX-License-Identifier: Apache-2.0
// The budget is what `ps` says: a program of its own, because other tests would have touched what this one measures.
#include <gtest/gtest.h>
#include <malloc.h>

#include <fstream>
#include <iostream>
#include <string>
#include <thread>

#include "base/bytes.h"
#include "base/parallel.h"
#include "tests/support/child_process.h"
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

/// Assets of so many leaves each, in a scene that is seen from near and far within each of the budgets.
void expect_within(int assets, uint32_t leaves, const std::vector<double>& budgets_mib) {
  const TemporaryFolder folder;
  test::in_a_child_process([&] {
    for (int i = 0; i < assets; ++i) {
      test::write_asset(folder.path() / std::to_string(i), test::foliage(leaves, static_cast<uint64_t>(10 * i)));
    }
    test::write_asset(folder.path() / "warm_up", test::foliage(3000, 99));
  });
  {  // code, stacks and thread-local memory are not the assets': touch them before the measurement
    Host host;
    host.add(folder.path() / "warm_up", stand(50));
    host.plan(vec3(0.5f, 0.5f, -5), 1e-3f);
    render(host, 5);
  }
  for (const double mib : budgets_mib) {
    const auto budget = static_cast<uint64_t>(mib * (1 << 20));
    const uint64_t baseline = reset_peak();
    std::string report;
    {
      RuntimeOptions options;
      options.budget_bytes = budget;
      Host host(options);
      for (int i = 0; i < assets; ++i) host.add(folder.path() / std::to_string(i), stand(510 / assets));
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
    ::testing::Test::RecordProperty("grown_of_" + std::to_string(budget), std::to_string(grown));
    if (std::getenv("FARFIELD_VERBOSE"))
      std::cout << format_bytes(budget) << " grown " << format_bytes(grown) << "\n" << report;
  }
}

TEST(Memory, TheProcessGrowsByNoMoreThanTheBudgetAndFivePercent) { expect_within(3, 60000, {3, 4, 8, 20}); }

TEST(Memory, NeitherDoesItInTinyBudgets) { expect_within(9, 8000, {1, 1.5, 2, 3}); }

}  // namespace
}  // namespace farfield
