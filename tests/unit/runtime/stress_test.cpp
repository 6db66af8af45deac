// SPDX-License-Identifier: Apache-2.0
// Shots in a budget that holds a fraction of what they ask for, while somebody damages, cuts, replaces and removes the
// files that rays load: no crash, never more than the budget, and no other picture than that of sound files unless a
// message says so. Rays fly on threads of the host's own, so that the thread sanitizer sees who waits for whom.
#include <gtest/gtest.h>

#include <atomic>
#include <thread>

#include "base/parallel.h"
#include "base/random.h"
#include "farfield/runtime.h"
#include "tests/support/files.h"
#include "tests/support/level_builder.h"
#include "tests/support/random_unit.h"
#include "tests/support/runtime_host.h"

namespace farfield {
namespace {

using test::Host;
namespace fs = std::filesystem;

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr int kFrames = 12, kRays = 600;
#else
constexpr int kFrames = 60, kRays = 2000;
#endif
constexpr int kThreads = 4, kAssets = 3;
constexpr uint64_t kTightBudget = 1200 << 10;  // less than frames ask for

std::string name_of(int asset) { return "ball_" + std::to_string(asset) + ".farfield"; }

/// Harms one level file, or makes it whole again.
void harm(const fs::path& sound, const fs::path& damaged, Rng& rng) {
  const std::string asset = name_of(static_cast<int>(rng.next_uint() % kAssets));
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(sound / asset))
    if (entry.path().filename() != "manifest.json") files.push_back(entry.path().filename());
  std::ranges::sort(files);
  const fs::path name = files[rng.next_uint() % files.size()];
  const fs::path file = damaged / asset / name;
  std::error_code ignored;
  std::vector<std::byte> bytes = test::read_bytes(sound / asset / name);
  switch (rng.next_uint() % 6) {
    case 0:  // cut, in place
      fs::resize_file(file, rng.next_uint() % bytes.size(), ignored);
      break;
    case 1:  // overwritten, in place
      for (int i = 0; i < 64; ++i) bytes[rng.next_uint() % bytes.size()] ^= std::byte{0x5a};
      test::write_bytes(file, bytes);
      break;
    case 2:  // replaced
      bytes[bytes.size() / 2] ^= std::byte{1};
      test::write_bytes(file.string() + ".new", bytes);
      fs::rename(file.string() + ".new", file, ignored);
      break;
    case 3:
      fs::remove(file, ignored);
      break;
    default:
      test::write_bytes(file.string() + ".new", bytes);
      fs::rename(file.string() + ".new", file, ignored);
      break;
  }
}

struct Seen {
  float t;
  uint32_t element;
  uint32_t level;
  bool operator==(const Seen&) const = default;
};

/// What the rays of one frame see, traced on kThreads threads.
std::vector<Seen> look(const Host& host, int frame, const vec3& eye) {
  std::vector<Seen> seen(kRays);
  std::vector<std::thread> threads;
  for (int thread = 0; thread < kThreads; ++thread) {
    threads.emplace_back([&, thread] {
      for (int i = thread; i < kRays; i += kThreads) {
        Rng rng(static_cast<uint64_t>(frame), static_cast<uint64_t>(i));
        RayContext context;
        context.path_seed = rng.next_uint();
        context.ray_seed = rng.next_uint();
        context.cone_spread = 1e-3f;
        const vec3 target(3.0f * static_cast<float>(i % kAssets), 0.9f * (2 * rng.next() - 1), 2 * rng.next() - 1);
        EmbreeRayHit ray_hit;
        if (!host.trace(eye, glm::normalize(target - eye), context, ray_hit)) continue;
        const Interaction hit = host.interaction(ray_hit, context);
        EXPECT_NE(hit.kind, Interaction::Kind::None);
        const ScatterSample sample = hit.sample(rng);
        EXPECT_TRUE(is_finite(sample.weight) && std::isfinite(ray_hit.ray.tfar));
        seen[static_cast<size_t>(i)] = {ray_hit.ray.tfar, context.hit.element, hit.level};
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  return seen;
}

std::unique_ptr<Host> open(const fs::path& folder, Residency residency, Blend blend) {
  RuntimeOptions options;
  options.budget_bytes = kTightBudget;
  options.residency = residency;
  options.blend = blend;
  auto host = std::make_unique<Host>(options);
  for (int i = 0; i < kAssets; ++i) {
    mat4x3 place(1.0f);
    place[3] = vec3(3.0f * static_cast<float>(i), 0, 0);
    host->add(folder / name_of(i), {place});
  }
  return host;
}

/// Where the camera of a frame is.
vec3 eye_of(int frame) {
  Rng rng(17, static_cast<uint64_t>(frame));
  return {9.0f * rng.next() - 1.5f, 0.0f, 3.0f * std::exp2(6.0f * rng.next())};
}

/// `host` looks ahead; every fifth time at a frame that does not come.
void fly(Residency residency, Blend blend, bool looks_ahead = false) {
#ifdef __SANITIZE_THREAD__
  const ThreadLimit no_workers(1);  // TBB and Embree are not instrumented: how their workers wait is not seen
#endif
  const test::TemporaryFolder folder;
  const fs::path sound = folder.path() / "sound", damaged = folder.path() / "damaged";
  for (int i = 0; i < kAssets; ++i) test::write_asset(sound / name_of(i), test::white_sphere(48));
  fs::copy(sound, damaged, fs::copy_options::recursive);
  const auto reference = open(sound, Residency::Wait, blend), host = open(damaged, residency, blend);

  Rng rng(17);
  size_t hits = 0;
  uint64_t most_asked = 0;
  for (int frame = 0; frame < kFrames; ++frame) {
    const vec3 eye = eye_of(frame);
    most_asked = std::max(most_asked, reference->plan(eye).asked_bytes);
    host->plan(eye);
    std::atomic<bool> is_done{false};
    std::thread vandal([&, seed = rng.next_uint()] {
      Rng own(seed);
      while (!is_done) harm(sound, damaged, own);
    });
    if (looks_ahead) host->runtime().look_ahead({{eye_of(frame % 5 == 0 ? frame + kFrames : frame + 1), 0.0f, 1e-3f}});
    const std::vector<Seen> seen = look(*host, frame, eye);
    is_done = true;
    vandal.join();
    const std::vector<Seen> right = look(*reference, frame, eye);
    for (const Seen& ray : right) hits += ray.t > 0;
    const bool is_said = host->message_count() > 0 || host->runtime().stats().fallbacks > 0;
    EXPECT_TRUE(is_said || seen == right) << frame;
  }
  EXPECT_GT(most_asked, kTightBudget);
  EXPECT_TRUE(reference->messages.empty()) << reference->messages.front();
  EXPECT_GT(host->message_count(), 0u);  // some of the harm was met
  EXPECT_GT(hits, size_t{kFrames} * kRays / 20);
  EXPECT_GT(reference->runtime().stats().levels_released, uint64_t{kFrames} / 4);
  for (Host* each : {reference.get(), host.get()})
    EXPECT_LE(each->runtime().stats().peak_accounted_bytes, kTightBudget);
}

TEST(Stress, FilesAreDamagedWhileRaysWaitForThem) { fly(Residency::Wait, Blend::Dissolve); }
TEST(Stress, FilesAreDamagedWhileRaysGoOnWithout) { fly(Residency::Progressive, Blend::Dissolve); }
TEST(Stress, FilesAreDamagedWhileLevelsMorph) { fly(Residency::Wait, Blend::Morph); }
TEST(Stress, FilesAreDamagedWhileLevelsAreLoadedAhead) {
  fly(Residency::Wait, Blend::Dissolve, true);
  fly(Residency::Progressive, Blend::Dissolve, true);
  fly(Residency::Wait, Blend::Morph, true);
}

}  // namespace
}  // namespace farfield
